"""What a new process is asked for: `python -m tests.benchmarks.first_use_tasks TASK RECORD [CACHE]`.

Prints one line of JSON: what the import and the first result took, and where the time went. Nothing is loaded before
the clock runs.
"""

import json
import sys
import time
from collections.abc import Callable
from typing import Any

TICKS = 400


def simulation(record: str) -> Callable[[], Any]:
    """Closed loop of a servo axis through a jerk-limited move of 0.4 s, 1 kHz."""
    import equinox as eqx
    import jax.numpy as jnp

    from twin.simulation import simulate

    axis, reference, _ = _problem()
    times = jnp.arange(TICKS) * axis.period
    return lambda: eqx.filter_jit(simulate)(axis, reference, times).outputs.position


def fit(record: str) -> Callable[[], Any]:
    """Mass and friction of this axis from its record, with intervals."""
    import numpy as np

    from fitting.identification.output_error import output_error
    from twin.record import Record

    axis, reference, space = _problem()
    start = space.with_values(axis, np.asarray([50.0, 5.0, 300.0]))
    with np.load(record) as file:
        measured = Record.create(file["times"], {"position": file["position"]}, {"position": "m"})

    def identify() -> Any:
        found = output_error(measured, start, reference, space, deviation={"position": 1e-6})
        return np.concatenate([found.values, found.intervals().ravel()])

    return identify


TASKS = {"simulation": simulation, "fit": fit}


def _problem() -> tuple[Any, Any, Any]:
    from twin.control import SampledLoop, SampledPositionVelocity
    from twin.drives import ServoAxis
    from twin.laws import CoulombViscousFriction
    from twin.parameters import Parameter, ParameterSpace
    from twin.references import JerkLimitedMove

    axis = ServoAxis(mass=95.0, friction=CoulombViscousFriction(coulomb=18.0, viscous=210.0, width=1e-3), gain=35.0)
    space = ParameterSpace(
        [
            Parameter("plant.mass", "kg", 10.0, 1000.0, scale="log"),
            Parameter("plant.friction.coulomb", "N", 0.0, 200.0),
            Parameter("plant.friction.viscous", "N s/m", 0.0, 2000.0),
        ]
    )
    loop = SampledLoop(axis, SampledPositionVelocity(position_gain=160.0, velocity_gain=240.0), period=1e-3)
    return loop, JerkLimitedMove(0.02, 0.15, 2.0, 60.0, start_time=0.02), space


def main(task: str, record: str, cache: str | None) -> dict[str, Any]:
    """Import, first result, second result.

    Args:
        task: name of a task.
        record: file with the record to fit.
        cache: folder of the compile cache; None for none.
    """
    begin = time.perf_counter()
    import jax

    from twin.compile_cache import use_compile_cache

    jax.config.update("jax_enable_x64", True)
    if cache:
        use_compile_cache(cache)
    compiling, taken = [0.0], [0]

    def add_time(event: str, seconds: float, **_: Any) -> None:
        if event == "/jax/core/compile/backend_compile_duration":
            compiling[0] += seconds

    def add_program(event: str, **_: Any) -> None:
        taken[0] += event == "/jax/compilation_cache/cache_hits"

    jax.monitoring.register_event_duration_secs_listener(add_time)
    jax.monitoring.register_event_listener(add_program)
    run = TASKS[task](record)
    imported = time.perf_counter()
    before = compiling[0]
    first = jax.block_until_ready(run())
    solved = time.perf_counter()
    compiled = compiling[0] - before
    jax.block_until_ready(run())
    again = time.perf_counter() - solved
    return {
        "import": imported - begin,
        "trace": max(solved - imported - compiled - again, 0.0),
        "compile": compiled,
        "run": again,
        "total": solved - begin,
        "taken": taken[0],
        "value": [float(x) for x in first],
    }


if __name__ == "__main__":
    from twin._loop_option import make_small_loops_one_function

    make_small_loops_one_function()
    print(json.dumps(main(sys.argv[1], sys.argv[2], sys.argv[3] if len(sys.argv) > 3 else None)))
