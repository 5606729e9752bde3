"""Pictures of sensitivity studies: what is drawn, in the axes given, and nothing shown."""

import matplotlib
import matplotlib.pyplot
import numpy as np
import pytest

from sensitivity import morris, sobol_indices, sobol_samples
from sensitivity.plots import plot_convergence, plot_effects, plot_heat_map, plot_indices
from twin._checks import InputError
from twin.parameters import Parameter, ParameterSpace

matplotlib.use("Agg")

SPACE = ParameterSpace([Parameter(f"mount{i}.k", "N/m", 1e7, 1e9, scale="log") for i in range(6)])
OUTPUTS = [f"MACXP mode {mode} z{position}" for position in (2, 3) for mode in (1, 2, 3)]
MIXING = np.abs(np.random.default_rng(2).normal(size=(6, 6))) ** 3


@pytest.fixture(autouse=True)
def _close():
    yield
    matplotlib.pyplot.close("all")


@pytest.fixture(scope="module")
def indices():
    samples = sobol_samples(SPACE, 64, seed=1)
    return sobol_indices(samples, np.sin(np.log10(samples.values) @ MIXING / 8), outputs=OUTPUTS)


def test_bars_show_the_strongest_with_their_intervals(indices):
    ax = plot_indices(indices, OUTPUTS[1], top=4, threshold=0.01)
    order = np.argsort(-indices.ST[1])[:4]
    assert [text.get_text() for text in ax.get_xticklabels()] == [indices.names[k] for k in order]
    heights = [bar.get_height() for bar in ax.patches]
    np.testing.assert_allclose(heights, [*indices.S1[1, order], *indices.ST[1, order]])
    assert ax.get_title() == "MACXP mode 2 z2, 95 % intervals"
    assert {text.get_text() for text in ax.get_legend().get_texts()} >= {"threshold 0.01"}


def test_heat_map_by_mode_and_position(indices):
    ax = plot_heat_map(indices, {"z2": OUTPUTS[:3], "z3": OUTPUTS[3:5]}, threshold=0.05)
    drawn = ax.images[0].get_array()
    assert drawn.shape == (6, 5)
    np.testing.assert_array_equal(np.ma.getmaskarray(drawn), indices.ST[:5].T <= 0.05)
    assert [text.get_text() for text in ax.get_xticklabels()] == ["1", "2", "3", "1", "2"]
    assert [text.get_text() for text in ax.texts] == ["z2", "z3"]
    assert [text.get_text() for text in ax.get_yticklabels()] == list(SPACE.paths)
    whole = plot_heat_map(indices, labels=[str(name) for name in OUTPUTS])
    assert whole.images[0].get_array().shape == (6, 6)


def test_convergence_has_a_line_for_each_of_the_strongest(indices):
    ax = plot_convergence(indices, 0, top=3)
    assert len(ax.containers) == 3
    line = ax.containers[0].lines[0]
    np.testing.assert_array_equal(line.get_ydata(), indices.ST_by_size[:, 0, np.argmax(indices.ST[0])])
    assert [text.get_text() for text in ax.get_xticklabels()] == ["8", "16", "32", "64"]
    first = plot_convergence(indices, 0, order="first")
    assert first.get_ylabel().startswith("first-order")


def test_effects_are_named():
    effects = morris(lambda x: x[0] * x[1] / 1e16, SPACE, seed=1, outputs=["power"])
    ax = plot_effects(effects, "power", top=2, unit="W")
    assert {text.get_text() for text in ax.texts} == {"mount0.k", "mount1.k"}
    assert ax.get_xlabel() == "μ* [W]"


def test_axes_given_are_drawn_in(indices):
    effects = morris(lambda x: 0 * x[0], SPACE, seed=1)
    for draw in (
        lambda ax: plot_indices(indices, 0, ax=ax),
        lambda ax: plot_heat_map(indices, ax=ax),
        lambda ax: plot_convergence(indices, 0, ax=ax),
        lambda ax: plot_effects(effects, 0, ax=ax),
    ):
        ax = matplotlib.pyplot.subplots()[1]
        assert draw(ax) is ax


def test_bad_input_is_named(indices):
    for call, message in (
        (lambda: plot_indices(indices, "mode 9"), "No output 'mode 9'"),
        (lambda: plot_indices(indices, 0, top=0), "top must be at least 1"),
        (lambda: plot_heat_map(indices, {"z": ["mode 9"]}), "No output 'mode 9'"),
        (lambda: plot_heat_map(indices, {}), "columns names no outputs"),
        (lambda: plot_heat_map(indices, labels=["a"]), "labels holds 1 texts"),
        (lambda: plot_convergence(indices, 0, order="second"), 'order must be "total" or "first"'),
    ):
        with pytest.raises(InputError, match=message):
            call()
