"""Advice on further measurements: predictions against fits with the data added, words, pictures and errors in input."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest

from fitting.identification.machine import identify_machine
from fitting.identification.machine_advice import MeasurementAdvice, helpful_measurements
from fitting.identification.machine_candidates import modes_at, more_modes, repeated, usual_candidates
from fitting.identification.machine_measurement import measured_modes, noisy
from fitting.identification.machine_unknowns import unknown_space
from fitting.plots_advice import plot_advice
from twin._checks import InputError
from twin.structure.reference_machine import reference_machine
from twin.structure.reference_quantities import DISTURBABLE

matplotlib.use("Agg")

MACHINE = reference_machine()
SPACE = unknown_space(MACHINE, scale="log").subset(
    [
        "joints.mounting_1.stiffness.y",
        "joints.mounting_2.viscous.x",
        "joints.mounting_2.hysteretic.y",
        "joints.coupling.stiffness.rz",
        "joints.ball_screw.hysteretic.rz",
        "joints.guide.stiffness.rx",
    ]
)
UNCERTAIN = (DISTURBABLE[0], DISTURBABLE[3])
BELIEF = 0.03
OUTPUTS = ("N6 x", "N6 y", "N6 z", "N16 x", "N12 y", "N8b z")
PLACES, FURTHER = (-0.06, 0.33), -0.294
COUNT = 8
WEAK = "joints.coupling.stiffness.rz"
# Errors that are smaller than the weights say, so that estimates, which errors hang on, hardly differ.
QUIET = {"frequency": 2e-4, "shape": 2e-3, "damping": 1e-2}


@functools.cache
def identified(places=PLACES, belief=BELIEF):
    """The nominal machine identified from noisy modes, started at itself; two quantities uncertain."""
    exact = [measured_modes(MACHINE, [z], count=COUNT, outputs=OUTPUTS)[0] for z in places]
    references = [noisy([modes], seed, **QUIET)[0] for seed, modes in enumerate(exact)]
    return identify_machine(MACHINE, references, places, SPACE, uncertain=UNCERTAIN, uncertainty=belief, start=MACHINE)


@functools.cache
def advice():
    return helpful_measurements(identified(), [FURTHER])


def information(residual, machine, space):
    """JᵀJ of a residual by central differences in the scaled vector."""

    @jax.jit
    def values(vector):
        return residual(space.with_values(machine, space.unscaled(vector)))

    start, step = space.pack(machine), 1e-5
    steps = [step * row * max(1.0, abs(float(x))) for row, x in zip(np.eye(len(space)), start, strict=True)]
    columns = [(values(start + h) - values(start - h)) / (2 * h.sum()) for h in steps]
    slopes = np.stack(columns, axis=1)
    return slopes.T @ slopes


def relative_errors(matrix, result):
    slopes = np.asarray(result.space.slopes(jnp.asarray(result.values)))
    return np.sqrt(np.diag(np.linalg.inv(matrix))) * slopes / result.values


def test_now_is_what_the_fit_says():
    found = identified()
    assert found.fit.success
    np.testing.assert_allclose(advice().known, found.fit.standard_errors / found.fit.values, rtol=1e-9)
    assert advice().candidates[0] == "modes at z = -0.294 m"
    assert "damping ratios measured five times" in advice().candidates
    assert "12 modes at each position" in advice().candidates
    assert np.all(advice().predicted <= advice().known * (1 + 1e-9))


@pytest.mark.slow
def test_predictions_agree_with_information_by_finite_differences():
    """With what is believed of the uncertain quantities, which more measurements do not make more certain."""
    found, result = identified(), identified().fit
    own = information(found.evidence, found.machine, result.space)
    belief = np.zeros(len(result.space))
    belief[len(SPACE) :] = 1 / (BELIEF * believed()) ** 2
    table = advice().to_dataframe()
    np.testing.assert_allclose(table["now"], relative_errors(own + np.diag(belief), result), rtol=1e-4)
    candidate = {"all five times": repeated(found, 5)}
    both = helpful_measurements(found, (), candidate).to_dataframe()["all five times"]
    np.testing.assert_allclose(both, relative_errors(5 * own + np.diag(belief), result), rtol=1e-4)
    further = information(modes_at(found, FURTHER), found.machine, result.space)
    expected = relative_errors(own + further + np.diag(belief), result)
    np.testing.assert_allclose(table["modes at z = -0.294 m"], expected, rtol=1e-4)


def believed():
    space = identified().fit.space
    return np.asarray(space.values(MACHINE))[len(SPACE) :]


@pytest.mark.slow
def test_prediction_agrees_with_a_fit_with_the_data_added():
    added = identified((*PLACES, FURTHER)).fit
    predicted = advice().predicted[0]
    np.testing.assert_allclose(predicted, added.standard_errors / added.values, rtol=0.03)
    assert np.max(advice().known / predicted) > 1.2  # it does bring something


def test_a_kind_measured_more_often_helps_what_it_sees():
    table = advice().to_dataframe()
    now = table["now"]
    gain = table["damping ratios measured five times"] / now
    dampings = [path for path in SPACE.paths if ".stiffness." not in path]
    np.testing.assert_allclose(gain[dampings], 1 / np.sqrt(5), rtol=0.02)
    stiff = "joints.guide.stiffness.rx"
    assert gain[stiff] > 0.99
    assert table["shapes measured five times"][stiff] < 0.9 * now[stiff]


def test_weak_ones_are_named_with_what_helps():
    found = advice()
    assert found.weak[0] == WEAK
    assert found.best[WEAK] in found.candidates
    assert len(found.sentences()) == len(found.weak)
    assert found.sentences()[0].startswith(f"{WEAK} is known to ")
    assert "would bring it to" in found.sentences()[0]
    loose = helpful_measurements(identified(), [FURTHER], {}, limit=0.99)
    # What is not determined within its bounds is named whatever the limit.
    assert loose.weak == (WEAK,)
    assert loose.candidates == ("modes at z = -0.294 m",)
    assert WEAK in repr(found)
    assert WEAK in found._repr_html_()


def made(known, predicted, *, limit=0.1, on_bound=(False, False), determined=(True, True)):
    return MeasurementAdvice(
        ("joints.a.stiffness.x", "joints.a.viscous.x"),
        ("modes at z = 0.1 m", "shapes measured twice"),
        limit,
        np.asarray(known),
        np.asarray(predicted),
        np.asarray(on_bound),
        np.asarray(determined),
    )


def test_words_for_every_case():
    good = made([0.01, 0.05], [[0.01, 0.05], [0.01, 0.04]])
    assert good.weak == good.sentences() == ()
    assert good.message == "All 2 parameters are known to 10 % or better."
    name = "joints.a.viscous.x"
    one = made([0.01, 0.34], [[0.01, 0.12], [0.01, 0.15]])
    assert one.weak == (name,)
    assert one.best == {name: "modes at z = 0.1 m"}
    assert one.sentences() == (
        f"{name} is known to 34 % only; modes at z = 0.1 m would bring it to 12 %, shapes measured twice to 15 %. None "
        "of them brings it to 10 %.",
    )
    nothing = made([0.01, 0.34], [[0.01, 0.34], [0.01, 0.34]])
    assert nothing.best == {}
    assert nothing.sentences() == (f"{name} is known to 34 % only; none of these measurements would help.",)
    unseen = made([0.01, np.inf], [[0.01, 0.05], [0.01, np.inf]])
    assert unseen.sentences() == (f"{name} is not seen; modes at z = 0.1 m would bring it to 5 %.",)
    bound = made([0.01, 0.05], [[0.01, 0.02], [0.01, 0.05]], on_bound=(False, True))
    assert bound.sentences() == (f"{name} sits on a bound; modes at z = 0.1 m would bring it to 2 %.",)
    open_ = made([0.01, 0.05], [[0.01, 0.02], [0.01, 0.05]], determined=(True, False))
    assert "is not identified within its bounds, though known to 5 %" in open_.sentences()[0]
    worst_first = made([0.2, 3.0], [[0.2, 3.0], [0.2, 3.0]])
    assert worst_first.weak == (name, "joints.a.stiffness.x")
    assert "300 %" in worst_first.sentences()[0]


def test_picture():
    shown = made([0.01, np.inf], [[0.01, 0.05], [0.01, np.inf]], on_bound=(False, True))
    ax = plot_advice(shown)
    assert [label.get_text() for label in ax.get_yticklabels()] == ["a.viscous.x *", "a.stiffness.x"]
    assert ax.get_xlabel() == "relative standard error [%]"
    words = [text.get_text() for text in ax.get_legend().get_texts()]
    assert "with modes at z = 0.1 m" in words
    assert "limit 10 %" in words
    own = plt.subplots()[1]
    assert plot_advice(shown, own, most=1) is own
    assert len(own.get_yticklabels()) == 1
    with pytest.raises(InputError, match="most"):
        plot_advice(shown, most=0)
    plt.close("all")


def test_more_modes_are_those_that_are_not_measured():
    found = identified()
    np.testing.assert_allclose(
        more_modes(found, COUNT + 2).frequency,
        [modes.frequency[COUNT:] for modes in measured_modes(found.machine, PLACES, count=COUNT + 2)],
    )
    # The third mode was not found at the second position.
    left_out = eqx.tree_at(lambda e: e.weight, found.evidence, found.evidence.weight.at[1, 2].set(0.0))
    own = measured_modes(found.machine, PLACES, count=COUNT)[1].frequency
    missed = int(found.evidence.pairs(found.machine).order[1, 2])
    further = more_modes(found._replace(evidence=left_out), COUNT)
    np.testing.assert_array_equal(np.sum(further.weight > 0, axis=1), [0, 1])
    np.testing.assert_allclose(further.frequency[1, 0], own[missed])


def test_bad_input():
    found = identified()
    with pytest.raises(InputError, match="limit must be a share"):
        helpful_measurements(found, [FURTHER], limit=0.0)
    with pytest.raises(InputError, match=r"0.1 for 10 %"):
        helpful_measurements(found, [FURTHER], limit=10.0)
    with pytest.raises(InputError, match="rail"):
        helpful_measurements(found, [2.0], {})
    with pytest.raises(InputError, match="place on the rail"):
        helpful_measurements(found, [float("nan")], {})
    with pytest.raises(InputError, match="measured already"):
        helpful_measurements(found, [0.33], {})
    with pytest.raises(InputError, match="no candidate"):
        helpful_measurements(found, (), {})
    with pytest.raises(InputError, match="times must be above 1"):
        repeated(found, 1)
    with pytest.raises(InputError, match="phase"):
        repeated(found, 2, kinds=("phase",))
    with pytest.raises(InputError, match="kinds is empty"):
        repeated(found, 2, kinds=())
    with pytest.raises(InputError, match="8 modes are all measured"):
        more_modes(found, COUNT)
    with pytest.raises(InputError, match="fewer modes"):
        more_modes(found, 1000)
    with pytest.raises(InputError, match="at least 1"):
        modes_at(found, FURTHER, count=0)
    assert len(usual_candidates(found)) == 4
