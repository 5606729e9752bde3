"""The record of the first fit: an axis of 82 kg, written as a controller's export writes it.

Decimal commas, semicolons, millimetres and ampere. The axis is simulated, so that the truth is known.
"""

import sys
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from twin.control import SampledLoop, SampledPositionVelocity
from twin.drives import ServoAxis
from twin.laws import StribeckFriction
from twin.references import JerkLimitedMove, SumReference
from twin.simulation import simulate

jax.config.update("jax_enable_x64", True)

PERIOD = 1e-3  # period of the controller [s]


def true_axis() -> SampledLoop:
    """The axis that is looked for: 82 kg, 60 N per ampere."""
    friction = StribeckFriction(
        coulomb=35.0, static=48.0, stribeck_velocity=8e-3, viscous=310.0, width=5e-4, exponent=1.0
    )
    axis = ServoAxis(mass=82.0, friction=friction, gain=60.0, offset=4.0)
    return SampledLoop(axis, SampledPositionVelocity(120.0, 100.0, command_limit=12.0), PERIOD)


def moves() -> SumReference:
    """There and back, fast and slow."""
    found, start = [], 0.1
    for distance, speed in ((0.15, 0.3), (-0.15, 0.15), (0.03, 0.02), (-0.03, 0.01)):
        found.append(JerkLimitedMove(distance, speed, 2.0, 60.0, start_time=start))
        start += float(found[-1].duration()) + 0.1
    return SumReference(tuple(found))


def write_csv(file: Path, seed: int = 1) -> Path:
    """Simulate the axis and write its record.

    Args:
        file: file to write.
        seed: of the noise.
    """
    reference = moves()
    times = PERIOD * jnp.arange(int((float(reference.switching_times()[-1]) + 0.2) / PERIOD))
    found = eqx.filter_jit(simulate)(true_axis(), reference, times)
    noise = np.random.default_rng(seed)
    position = 1e3 * np.asarray(found.channel("position")) + 1e-3 * noise.standard_normal(times.size)
    current = np.asarray(found.channel("command")) + 0.02 * noise.standard_normal(times.size)
    wanted = 1e3 * np.asarray(jax.vmap(reference)(times).position)
    rows = zip(1e3 * np.asarray(times), wanted, position, current, strict=True)
    lines = ["t [ms];x_soll [mm];x_ist [mm];i_q [A]"]
    lines += [f"{t:.0f};{w:.6f};{x:.4f};{i:.4f}".replace(".", ",") for t, w, x, i in rows]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file


if __name__ == "__main__":
    print(write_csv(Path(sys.argv[1] if len(sys.argv) > 1 else "axis.csv")))
