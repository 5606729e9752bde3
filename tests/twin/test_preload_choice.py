"""How much preload a stiffness under a process force needs: met, least, differentiable, or refused."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rack_pinion_systems import both

from twin._checks import InputError
from twin.drives.leipe import RATED_TORQUE, leipe_drive
from twin.drives.preload_choice import preload_for_stiffness, total_stiffness
from twin.drives.rack_pinion_operation import mesh_forces

DRIVE = leipe_drive()
SUPPLY = {"rated_torque": RATED_TORQUE, "torque_constant": 1.5, "resistance": 0.8}
WANTED = 1.3e8


def choose(stiffness=WANTED, drive=DRIVE, **options):
    return preload_for_stiffness(drive, stiffness, **{**SUPPLY, **options})


@pytest.mark.parametrize(("load", "velocity"), [(0.0, 0.0), (800.0, 0.05), (-1500.0, 0.05), (-800.0, -0.05)])
def test_the_stiffness_is_met_with_both_flanks_held(load, velocity):
    found = choose(load=load, velocity=velocity)
    assert float(found.stiffness) == pytest.approx(WANTED, rel=1e-8)
    f_1, f_2 = (float(f) for f in found.forces)
    assert f_1 > 0 > f_2
    law = DRIVE.train_1.mesh.stiffness
    assert float(law(f_1) + law(f_2)) == pytest.approx(WANTED, rel=1e-8)
    guides = float(DRIVE.table_friction(jnp.asarray(velocity)))
    assert f_1 + f_2 == pytest.approx(guides - load, abs=1e-6)
    tau_1, tau_2 = (float(t) for t in found.torques)
    assert float(found.preload) == pytest.approx(0.5 * (tau_1 - tau_2), rel=1e-12)
    assert max(abs(tau_1), abs(tau_2)) < RATED_TORQUE
    np.testing.assert_allclose(mesh_forces(DRIVE, found.torques, velocity), found.forces, rtol=1e-12)


def test_copper_losses():
    found = choose(load=900.0, velocity=0.1)
    tau_1, tau_2 = (float(t) for t in found.torques)
    assert float(found.copper_loss) == pytest.approx(0.8 / 1.5**2 * (tau_1**2 + tau_2**2), rel=1e-12)
    mean = 0.5 * (tau_1 + tau_2)
    assert float(found.extra_loss) == pytest.approx(float(found.copper_loss) - 0.8 / 1.5**2 * 2 * mean**2, rel=1e-9)
    assert float(found.extra_loss) == pytest.approx(0.8 / 1.5**2 * 2 * float(found.preload) ** 2, rel=1e-9)


@pytest.mark.parametrize("reserve", [0.0, 150.0])
def test_the_least_preload_where_the_drive_is_stiff_enough(reserve):
    """Then only the flank that carries less needs to stay: its force is the reserve."""
    found = choose(1e6, load=1000.0, reserve=reserve)
    assert float(found.stiffness) > 1e6
    smaller = np.min(np.abs(np.asarray(found.forces)))
    assert smaller == pytest.approx(reserve, abs=1e-6)
    assert np.sum(np.asarray(found.forces)) == pytest.approx(-1000.0, abs=1e-6)


def test_a_reserve_is_kept_where_the_stiffness_needs_less():
    plain = choose(1.02e8, load=0.0)
    less = float(np.min(np.abs(np.asarray(plain.forces))))
    kept = choose(1.02e8, load=0.0, reserve=less + 50.0)
    assert float(kept.preload) > float(plain.preload)
    assert float(np.min(np.abs(np.asarray(kept.forces)))) == pytest.approx(less + 50.0, abs=1e-6)
    assert float(choose(1.02e8, load=0.0, reserve=less - 50.0).preload) == pytest.approx(float(plain.preload), rel=1e-8)


def test_no_smaller_preload_will_do():
    found = choose(load=500.0)
    for part in (0.5, 0.9, 0.999):
        assert float(total_stiffness(DRIVE, part * found.preload, load=500.0)) < WANTED
    more = [float(choose(k, load=500.0).preload) for k in (1.1e8, 1.3e8, 1.5e8)]
    assert more == sorted(more)


def test_total_stiffness_in_all_four_quadrants():
    """Where both motors push the same way, as without preload, it is the sum of the same law."""
    law = DRIVE.train_1.mesh.stiffness
    found = total_stiffness(DRIVE, 0.0, load=-2000.0)
    assert float(found) == pytest.approx(2 * float(law(1000.0)), rel=1e-9)
    np.testing.assert_allclose(total_stiffness(DRIVE, 3.0), total_stiffness(DRIVE, -3.0), rtol=1e-12)


@jax.jit
def _preload(load, k1):
    drive = both(DRIVE, lambda t: (t.mesh.stiffness.k1,), 1.0)
    drive = eqx.tree_at(lambda d: (d.train_1.mesh.stiffness.k1, d.train_2.mesh.stiffness.k1), drive, (k1, k1))
    found = preload_for_stiffness(drive, WANTED, load=load, velocity=0.05, **SUPPLY)
    return jnp.stack([found.preload, found.copper_loss, found.forces[1]])


@pytest.mark.parametrize("load", [0.0, 700.0, -700.0])
def test_derivatives_agree_with_differences(load):
    k1 = float(DRIVE.train_1.mesh.stiffness.k1)
    by_load, by_k1 = jax.jit(jax.jacfwd(_preload, argnums=(0, 1)))(jnp.asarray(load), jnp.asarray(k1))
    h = 1.0
    np.testing.assert_allclose(
        by_load, (_preload(load + h, k1) - _preload(load - h, k1)) / (2 * h), rtol=1e-4, atol=1e-7
    )
    h = 1e-4 * k1
    np.testing.assert_allclose(by_k1, (_preload(load, k1 + h) - _preload(load, k1 - h)) / (2 * h), rtol=1e-4)


def test_it_runs_under_vmap():
    loads = jnp.array([-500.0, 0.0, 500.0])
    batch = jax.vmap(lambda load: _preload(load, DRIVE.train_1.mesh.stiffness.k1))(loads)
    np.testing.assert_allclose(batch[1], _preload(0.0, DRIVE.train_1.mesh.stiffness.k1), rtol=1e-8)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"stiffness": 1e9}, "cannot be reached: with the rated torque it is 1.6"),
        ({"load": 12000.0}, "leaves no room for a preload"),
        ({"load": -12000.0}, "leaves no room for a preload"),
        ({"reserve": 1e5}, "leaves no room for a preload"),
        ({"reserve": -1.0}, "reserve must not be negative"),
        ({"stiffness": 0.0}, "stiffness must be positive"),
        ({"stiffness": float("nan")}, "stiffness must be finite"),
        ({"rated_torque": -1.0}, "rated_torque must be positive"),
        ({"torque_constant": 0.0}, "torque_constant must be positive"),
        ({"resistance": 0.0}, "resistance must be positive"),
        ({"load": float("nan")}, "load must be finite"),
        ({"velocity": float("nan")}, "velocity must be finite"),
    ],
)
def test_bad_input_is_named(change, message):
    with pytest.raises(InputError, match=message):
        choose(**change)


def test_in_a_batch_what_cannot_be_is_not_a_number():
    loads = jnp.asarray([0.0, 1000.0, 20_000.0])
    preloads = jax.vmap(lambda load: choose(load=load).preload)(loads)
    np.testing.assert_array_equal(np.isnan(preloads), [False, False, True])
    assert np.isnan(jax.jit(lambda load: choose(1.9e8, load=load).preload)(0.0))


def test_derivative_where_the_reserve_decides():
    slope = jax.grad(lambda load: choose(1e6, load=load).preload)(1000.0)
    steps = [float(choose(1e6, load=1000.0 + h).preload) for h in (-1.0, 1.0)]
    assert float(slope) == pytest.approx((steps[1] - steps[0]) / 2, rel=1e-6)
