"""A two-mass drive as a study file, and records of it."""

import jax
import numpy as np

from twin._tree_names import leaf_name
from twin.drives import TwoMass
from twin.laws import ViscousFriction
from twin.references import SampledSignal
from twin.simulation import simulate

MODEL = """
[study]
title = "two masses"

[model]
type = "TwoMass"
motor_inertia = "2e-3 kg m^2"
load_inertia = "30 kg cm^2"
stiffness = "100 N m/rad"
damping = "0.02 N m s/rad"
gain = "0.5 N m/A"
motor_friction = { type = "ViscousFriction", viscous = "5e-3 N m s/rad" }
load_friction = { type = "ViscousFriction", viscous = "2e-3 N m s/rad" }
"""
FIT = """
[free]
load_inertia = { lower = "5e-4 kg m^2", upper = "2e-2 kg m^2", scale = "log" }
stiffness = { lower = "10 N m/rad", upper = "1000 N m/rad", scale = "log" }
damping = { lower = "0 N m s/rad", upper = "0.06 N m s/rad" }

[data.run1]
file = "records/run1.csv"
inputs = { command = "current" }

[data.run1.channels]
current = { column = "i" }
position = { column = "phi_m", deviation = "0.01 deg" }
load_position = { column = "phi_l", deviation = "0.01 deg" }
"""
TRUTH = {"load_inertia": 4.1e-3, "stiffness": 130.0, "damping": 0.03}


def truth(**changes):
    values = {"motor_inertia": 2e-3, "load_inertia": 3e-3, "stiffness": 100.0, "damping": 0.02} | changes
    return TwoMass(**values, motor_friction=ViscousFriction(5e-3), load_friction=ViscousFriction(2e-3), gain=0.5)


def write_record(file, *, model=None, seed=1, count=1200):
    """A pseudo-random current through the drive: semicolons, decimal commas, milliseconds, degrees."""
    file.parent.mkdir(exist_ok=True, parents=True)
    random = np.random.default_rng(seed)
    times = np.arange(count) * 5e-4
    current = np.repeat(random.choice([-2.0, 2.0], count // 20 + 1), 20)[:count] * (times > 0.02)
    plant = model or truth(**TRUTH)
    rest = plant.rest_inputs()
    names = [leaf_name(keys) for keys, _ in jax.tree_util.tree_leaves_with_path(rest)]
    signal = SampledSignal(times, type(rest)(*(current if name == "command" else 0 * times for name in names)))
    outputs = simulate(plant, signal, times).outputs
    noise = np.radians(0.01) * random.standard_normal((2, count))
    columns = [times * 1e3, current, *np.degrees(np.stack([outputs.position, outputs.load_position]) + noise)]
    rows = [";".join(f"{value:.6f}".replace(".", ",") for value in row) for row in np.transpose(columns)]
    file.write_text("Zeit [ms];i [A];phi_m [deg];phi_l [deg]\n" + "\n".join(rows) + "\n", encoding="utf-8")


def write_study(folder, text, name="study.toml"):
    folder.mkdir(exist_ok=True, parents=True)
    (folder / name).write_text(text, encoding="utf-8")
    return str(folder / name)
