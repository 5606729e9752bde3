"""A published study as the command line repeats it, in a process of its own."""

import subprocess
import sys
from pathlib import Path


def reproduced(study: str, out: Path, *, says: str, timeout: float) -> Path:
    """Run `drivetwin reproduce STUDY` and return the folder of its results.

    Args:
        study: name of the study.
        out: the folder.
        says: what must be printed.
        timeout: time after which to give up [s].
    """
    code = "from fitting.cli import main; raise SystemExit(main())"
    command = [sys.executable, "-c", code, "reproduce", study, "--out", str(out)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=timeout, check=False)
    assert run.returncode == 0, run.stderr
    assert says in run.stdout
    return out
