"""A sign of life while something runs that cannot say how far it is: one fit, one compilation."""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def ticking(what: str) -> Iterator[None]:
    """Show on a terminal what runs and for how long; elsewhere say nothing.

    Args:
        what: what runs.
    """
    if not sys.stderr.isatty():
        yield
        return
    from tqdm import tqdm

    over = threading.Event()
    with tqdm(desc=what, bar_format="{desc}: {elapsed}", leave=False) as bar:

        def tick() -> None:
            while not over.wait(1.0):
                bar.refresh()

        clock = threading.Thread(target=tick, daemon=True)
        clock.start()
        try:
            yield
        finally:
            over.set()
            clock.join()
