"""The bridge between a model and a solver's vector: round trips, scales, slopes, bounds, priors, errors."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin._checks import InputError
from twin.drives import ServoAxis
from twin.laws import CoulombViscousFriction, PolynomialForce
from twin.parameters import Parameter, ParameterSpace

AXIS = ServoAxis(
    mass=95.0,
    friction=CoulombViscousFriction(20.0, 200.0, 1e-3),
    position_force=PolynomialForce(jnp.array([3.0, 4.0])),
)
SPACE = ParameterSpace(
    [
        Parameter("mass", "kg", 10.0, 1000.0, scale="log"),
        Parameter("friction.coulomb", "N", 0.0, 40.0),
        Parameter("friction.viscous", "N s/m", size=50.0),
        Parameter("position_force.coefficients.1", "N"),
    ]
)
# The compiler flushes subnormal numbers to zero, NumPy does not.
_values = st.tuples(
    *(st.floats(a, b, allow_subnormal=False) for a, b in ((1e-6, 1e12), (0.0, 1e6), (-1e9, 1e9), (-1e3, 1e3)))
)


@given(_values)
@settings(max_examples=50, deadline=None)
def test_unpack_then_pack_is_the_identity(values):
    model = SPACE.with_values(AXIS, jnp.asarray(values))
    np.testing.assert_allclose(SPACE.values(model), values, rtol=0)
    again = SPACE.unpack(AXIS, SPACE.pack(model))
    np.testing.assert_allclose(SPACE.values(again), values, rtol=2e-14, atol=1e-300)
    np.testing.assert_allclose(SPACE.pack(again), SPACE.pack(model), rtol=1e-14, atol=1e-14)


def test_what_is_not_free_stays():
    changed = SPACE.unpack(AXIS, SPACE.pack(AXIS) + 1.0)
    assert float(changed.gain) == 1.0
    assert float(changed.friction.width) == 1e-3
    assert float(changed.position_force.coefficients[0]) == 3.0


def test_scales():
    scaled = SPACE.pack(AXIS)
    assert float(scaled[0]) == pytest.approx(np.log(95.0), rel=1e-15)  # logarithm
    assert float(scaled[1]) == 20.0 / 40.0  # range of the bounds
    assert float(scaled[2]) == 200.0 / 50.0  # its own size
    assert float(scaled[3]) == 4.0  # neither


@given(_values)
@settings(max_examples=20, deadline=None)
def test_slopes_are_the_derivatives(values):
    vector = SPACE.scaled(jnp.asarray(values))
    # NumPy and XLA round logarithms and exponentials on their own, by a few units in the last place.
    np.testing.assert_allclose(SPACE.scaled_rows(np.asarray([values]))[0], vector, rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(SPACE.unscaled_rows(np.asarray(vector)[None])[0], SPACE.unscaled(vector), rtol=1e-14)
    np.testing.assert_allclose(jnp.diag(SPACE.slopes(SPACE.unscaled(vector))), _JACOBIAN(vector), rtol=1e-14)


_JACOBIAN = jax.jit(jax.jacfwd(SPACE.unscaled))


def test_bounds_in_scaled_variables():
    np.testing.assert_allclose(SPACE.lower, [np.log(10.0), 0.0, -np.inf, -np.inf], rtol=1e-15)
    np.testing.assert_allclose(SPACE.upper, [np.log(1000.0), 1.0, np.inf, np.inf], rtol=1e-15)


def test_an_unbounded_logarithm_starts_at_zero():
    parameter = Parameter("mass", "kg", scale="log")
    assert parameter.lower == 0.0
    space = ParameterSpace([parameter])
    assert float(space.lower[0]) == -np.inf
    assert float(space.upper[0]) == np.inf
    space.check_start(AXIS)


def test_order_units_and_look_up():
    assert SPACE.paths == ("mass", "friction.coulomb", "friction.viscous", "position_force.coefficients.1")
    assert SPACE.units == ("kg", "N", "N s/m", "N")
    assert len(SPACE) == 4
    assert SPACE["friction.coulomb"].upper == 40.0
    with pytest.raises(InputError, match=r"No free parameter 'gain'; the space has mass, friction\.coulomb"):
        SPACE["gain"]


def test_subset_keeps_the_order_asked_for():
    subset = SPACE.subset(["position_force.coefficients.1", "mass"])
    assert subset.paths == ("position_force.coefficients.1", "mass")
    assert subset["mass"].scale == "log"
    with pytest.raises(InputError, match="No free parameter 'gain'"):
        SPACE.subset(["mass", "gain"])


def test_prior_residual():
    space = ParameterSpace(
        [Parameter("mass", prior=(100.0, 10.0)), Parameter("gain"), Parameter("offset", prior=(1.0, 2.0))]
    )
    np.testing.assert_allclose(space.prior_residual(space.values(AXIS)), [-0.5, -0.5])
    assert SPACE.prior_residual(SPACE.values(AXIS)).shape == (0,)


def test_an_unknown_path_names_those_there_are():
    for use in (lambda s: s.values(AXIS), lambda s: s.with_values(AXIS, jnp.ones(1)), lambda s: s.check_start(AXIS)):
        with pytest.raises(InputError, match=r"Unknown parameter path 'friction.static'.*friction.coulomb"):
            use(ParameterSpace([Parameter("friction.static")]))


@pytest.mark.parametrize(
    ("parameter", "said"),
    [
        (Parameter("mass", "kg", 96.0, 200.0), r"start of mass is 95 kg, outside its bounds \[96, 200\]"),
        (Parameter("mass", "kg", 10.0, 94.0), r"start of mass is 95 kg, outside its bounds \[10, 94\]"),
        (Parameter("offset", "N", 0.0, 10.0, scale="log"), "start of offset is 0 N, outside"),
    ],
)
def test_a_start_outside_its_bounds(parameter, said):
    with pytest.raises(InputError, match=said):
        ParameterSpace([parameter]).check_start(AXIS)


def test_a_start_that_is_not_finite():
    space = ParameterSpace([Parameter("mass")])
    with pytest.raises(InputError, match="start of mass is nan"):
        space.check_start(space.with_values(AXIS, jnp.asarray([jnp.nan])))


def test_a_start_on_a_bound_passes():
    ParameterSpace([Parameter("mass", "kg", 95.0, 200.0)]).check_start(AXIS)


def test_a_traced_start_passes():
    space = ParameterSpace([Parameter("mass", "kg", 96.0, 200.0)])

    @jax.jit
    def masses(axis):
        space.check_start(axis)
        return space.values(axis)

    assert float(masses(AXIS)[0]) == 95.0


TIED = ParameterSpace(
    [Parameter("low.mass", "kg", tied=("high.mass",)), Parameter("low.offset"), Parameter("high.offset")]
)


def test_tied_paths_take_one_value():
    models = TIED.with_values({"low": AXIS, "high": AXIS}, jnp.asarray([50.0, 1.0, 2.0]))
    assert float(models["low"].mass) == float(models["high"].mass) == 50.0
    assert (float(models["low"].offset), float(models["high"].offset)) == (1.0, 2.0)
    np.testing.assert_array_equal(TIED.values(models), [50.0, 1.0, 2.0])
    TIED.check_start(models)
    assert TIED.paths == ("low.mass", "low.offset", "high.offset")


def weighing(value):
    return ServoAxis(value, CoulombViscousFriction(20.0, 200.0, 1e-3))


@given(st.floats(1e-3, 1e6), st.floats(1e-3, 1e6))
@settings(max_examples=20, deadline=None)
def test_ties_start_at_one_value(first, second):
    models = {"low": weighing(first), "high": weighing(second)}
    if abs(first - second) <= 1e-9 * max(first, second):
        TIED.check_start(models)
    else:
        with pytest.raises(InputError, match=r"low.mass and high.mass are tied, but start at .*with_values"):
            TIED.check_start(models)
        TIED.check_start(TIED.with_values(models, TIED.values(models)))


def test_a_tie_has_a_gradient_from_every_data_set():
    models = {"low": AXIS, "high": AXIS}

    def weigh(values):
        changed = TIED.with_values(models, values)
        return changed["low"].mass + 10.0 * changed["high"].mass

    np.testing.assert_array_equal(jax.grad(weigh)(TIED.values(models)), [11.0, 0.0, 0.0])


def test_ties_read_from_a_file_are_tuples():
    assert Parameter("a", tied=["b", "c"]) == Parameter("a", tied=("b", "c"))
    with pytest.raises(InputError, match=r"Write tied=\('high.mass',\)"):
        Parameter("low.mass", tied="high.mass")


def test_an_unknown_tie_names_what_there_is():
    space = ParameterSpace([Parameter("mass", tied=("weight",))])
    for use in (lambda: space.check_start(AXIS), lambda: space.with_values(AXIS, jnp.ones(1))):
        with pytest.raises(InputError, match=r"Unknown parameter path 'weight'.*friction.coulomb"):
            use()


def test_a_tied_path_is_reached_by_its_first():
    with pytest.raises(InputError, match=r"'high.mass' is tied to 'low.mass'"):
        TIED["high.mass"]


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Parameter("mass", "kg", 2.0, 1.0), "lower bound 2 is not below the upper bound 1 kg"),
        (lambda: Parameter("mass", "kg", 1.0, 1.0), "Exchange them, or leave the parameter out"),
        (lambda: Parameter("mass", lower=float("nan")), "a bound is NaN"),
        (lambda: Parameter("mass", scale="sqrt"), 'scale must be "linear" or "log", but is \'sqrt\''),
        (lambda: Parameter("mass", lower=-1.0, scale="log"), "lower bound -1 is negative, but the scale is log"),
        (lambda: Parameter("mass", size=0.0), "size must be positive"),
        (lambda: Parameter("mass", size=float("inf")), "size must be positive and finite"),
        (lambda: Parameter("mass", prior=(1.0, 0.0)), "positive standard deviation"),
        (lambda: Parameter("mass", prior=(float("nan"), 1.0)), "prior must be"),
        (lambda: ParameterSpace([]), "at least one parameter"),
        (lambda: ParameterSpace([Parameter("mass"), Parameter("mass")]), "'mass' is in the space twice"),
        (
            lambda: ParameterSpace([Parameter("mass"), Parameter("gain", tied=("mass",))]),
            "'mass' is in the space twice",
        ),
        (lambda: ParameterSpace([Parameter("mass", tied=("mass",))]), "'mass' is in the space twice"),
    ],
)
def test_bad_input_is_named(make, said):
    with pytest.raises(InputError, match=said):
        make()
