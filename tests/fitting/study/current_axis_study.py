"""A record of an axis whose controller nobody knows: position, current and set position in a CSV."""

import numpy as np

TORQUE_CONSTANT, LEAD = 0.8, 0.010
GAIN = TORQUE_CONSTANT * 2 * np.pi / LEAD
TRUTH = {"mass": 2400.0, "friction.coulomb": 600.0, "friction.viscous": 3000.0, "offset": 50.0}
PERIOD = 1e-3
# Speed [m/s] and how long it is held [s], there and back.
MOVES = ((0.1, 0.5), (0.3, 0.3), (0.02, 0.6), (0.4, 0.3), (0.2, 0.2))


def motion(moves=MOVES):
    """Position, velocity and acceleration: smooth moves with rests between."""
    still = np.zeros(200)
    speed = [still]
    for top, hold in moves:
        for way in (1.0, -1.0):
            speed += [np.full(round(hold / PERIOD) + 150, way * top), still]
    window = np.hanning(151)
    velocity = np.convolve(np.concatenate(speed), window / window.sum(), "same")
    return (np.cumsum(velocity) - 0.5 * velocity) * PERIOD, velocity, np.gradient(velocity, PERIOD)


def write_axis(file, *, moves=MOVES, noise=0.05, seed=1, hold=300.0, lost=0.0):
    """Write the record; at rest the drive holds a force that friction balances.

    Args:
        file: CSV to write.
        moves: speeds and how long they are held.
        noise: standard deviation of the current [A].
        seed: of the noise.
        hold: force at rest [N].
        lost: force that the model does not know, a slow wave [N].
    """
    position, velocity, acceleration = motion(moves)
    moving = np.abs(velocity) > 0
    force = TRUTH["mass"] * acceleration + TRUTH["friction.viscous"] * velocity + TRUTH["offset"]
    force += np.where(moving, TRUTH["friction.coulomb"] * np.sign(velocity), hold - TRUTH["offset"])
    times = PERIOD * np.arange(position.size)
    force += lost * np.sin(2 * np.pi * 0.8 * times)
    current = force / GAIN + noise * np.random.default_rng(seed).standard_normal(times.size)
    rows = np.stack([times, 1e3 * np.round(position / 1e-7) * 1e-7, current, 1e3 * position], axis=1)
    lines = [";".join(f"{value:.5f}".replace(".", ",") for value in row) for row in rows]
    file.write_text("\n".join(["Zeit [s];Istposition [mm];Motorstrom [A];Sollposition [mm]", *lines]) + "\n")
