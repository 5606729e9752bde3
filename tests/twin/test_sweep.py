"""Sweeps: against a plain loop, one compilation, units and bounds, failed points marked, and the pictures."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest
from jaxtyping import Array, Float

from twin._checks import InputError
from twin.drives import TwoMass, two_mass_modes
from twin.laws import ViscousFriction
from twin.parameters import Parameter, ParameterSpace
from twin.paths import set_leaves
from twin.plots import plot_sweep, plot_sweep_panels
from twin.sweep import sweep

matplotlib.use("Agg")

MODEL = TwoMass(4.8e-3, 3.9e-3, 548.0, 0.03, ViscousFriction(0.02), ViscousFriction(0.05))
STIFFNESS = Parameter("stiffness", "N m/rad", 100.0, 5000.0, scale="log")
TRACES = {"count": 0}


class Found(NamedTuple):
    resonance: Float[Array, ""]
    damping: Float[Array, ""]


def modes(model):
    TRACES["count"] += 1
    found = two_mass_modes(model)
    return Found(found.resonance, found.damping_ratio)


def resonance(model):
    return two_mass_modes(model).resonance


def fragile(model):
    """NaN for soft shafts, as a failed simulation gives."""
    return {"frequency": jnp.sqrt(jnp.where(model.stiffness > 300, model.stiffness, jnp.nan)), "one": 1.0}


def vector(model):
    return model.stiffness * jnp.arange(3.0)


def complex_result(model):
    return 1j * model.stiffness


def nothing(model):
    return ()


@pytest.fixture(autouse=True)
def _close():
    yield
    plt.close("all")


@pytest.mark.parametrize("chunk_size", ["auto", 1, 4, 7, 100])
def test_agrees_with_a_loop(chunk_size):
    stiffness = np.linspace(200.0, 900.0, 7)
    found = sweep(MODEL, {"stiffness": stiffness}, modes, chunk_size=chunk_size)
    one_by_one = [jax.jit(modes)(set_leaves(MODEL, {"stiffness": k})) for k in stiffness]
    np.testing.assert_allclose(found["resonance"], [x.resonance for x in one_by_one], rtol=1e-12)
    np.testing.assert_allclose(found["damping"], [x.damping for x in one_by_one], rtol=1e-12)
    assert not found.failed.any()


def test_grid_of_two_and_an_element_of_a_law():
    stiffness, friction = np.array([300.0, 500.0, 900.0]), np.array([0.0, 0.1])
    found = sweep(MODEL, {"stiffness": stiffness, "load_friction.viscous": friction}, modes)
    assert found["damping"].shape == (3, 2)
    for i, k in enumerate(stiffness):
        for j, b in enumerate(friction):
            alone = modes(set_leaves(MODEL, {"stiffness": k, "load_friction.viscous": b}))
            assert found["damping"][i, j] == pytest.approx(float(alone.damping), rel=1e-12)
    table = found.to_dataframe()
    assert list(table.columns) == ["stiffness", "load_friction.viscous", "resonance", "damping", "remark"]
    row = table[(table["stiffness"] == 500.0) & (table["load_friction.viscous"] == 0.1)]
    assert float(row["damping"].iloc[0]) == found["damping"][1, 1]


def test_same_sweep_with_other_values_is_not_compiled_again():
    """Trap 35."""
    sweep(MODEL, {"stiffness": np.linspace(200.0, 900.0, 9)}, modes)
    TRACES["count"] = 0
    sweep(MODEL, {"stiffness": np.linspace(300.0, 400.0, 9)}, modes)
    sweep(MODEL, {STIFFNESS: np.linspace(300.0, 500.0, 9)}, modes)
    sweep(MODEL, {"stiffness": list(np.linspace(0.5, 1.5, 9))}, modes, relative=True)
    heavier = set_leaves(MODEL, {"load_inertia": 8e-3})
    sweep(heavier, {"stiffness": np.linspace(300.0, 500.0, 9)}, modes, units={"resonance": "Hz"})
    assert TRACES["count"] == 0
    sweep(MODEL, {"stiffness": np.linspace(300.0, 500.0, 10)}, modes)
    assert TRACES["count"] == 0


def test_relative_values_and_units():
    space = ParameterSpace([STIFFNESS, Parameter("load_inertia", "kg m^2")])
    found = sweep(MODEL, {"stiffness": [0.5, 1.0, 1.5]}, modes, relative=True, space=space, units={"resonance": "Hz"})
    table = found.to_dataframe()
    assert list(table.columns)[:3] == ["stiffness [N m/rad]", "stiffness [relative]", "resonance [Hz]"]
    np.testing.assert_allclose(table["stiffness [N m/rad]"], [274.0, 548.0, 822.0])
    # Without damping the frequency grows with the root; here nearly so.
    np.testing.assert_allclose(found["resonance"] / found["resonance"][1], np.sqrt([0.5, 1.0, 1.5]), rtol=1e-2)
    assert "now 548 N m/rad" in found._repr_html_() and "relative" in repr(found)
    assert plot_sweep(found, "damping").get_xlabel() == "stiffness / (548 N m/rad)"


def test_tied_parameters_follow():
    tied = Parameter("motor_inertia", "kg m^2", tied=("load_inertia",))
    found = sweep(MODEL, {tied: [2e-3, 5e-3]}, resonance)
    for inertia, value in zip([2e-3, 5e-3], found["value"], strict=True):
        both = set_leaves(MODEL, {"motor_inertia": inertia, "load_inertia": inertia})
        assert value == pytest.approx(float(resonance(both)), rel=1e-12)


def test_a_list_of_points():
    over = {"stiffness": [300.0, 500.0, 900.0], "damping": [0.1, 0.2, 0.3]}
    found = sweep(MODEL, over, modes, grid=False)
    for i in range(3):
        alone = modes(set_leaves(MODEL, {path: values[i] for path, values in over.items()}))
        assert found["damping"][i] == pytest.approx(float(alone.damping), rel=1e-12)
    labelled = found.to_xarray()
    assert labelled.sizes == {"point": 3}
    np.testing.assert_array_equal(labelled["damping (result)"], found["damping"])
    np.testing.assert_array_equal(labelled.coords["stiffness"], over["stiffness"])


def test_labelled_by_values_and_units():
    over = {STIFFNESS: [300.0, 500.0], "damping": [0.1, 0.2, 0.3], "load_inertia": [1e-3, 2e-3, 3e-3, 4e-3]}
    both = {"resonance": resonance, "inertias": lambda m: jnp.stack([m.motor_inertia, m.load_inertia])}
    found = sweep(MODEL, over, both, units={"resonance": "Hz", "inertias": "kg m^2"})
    labelled = found.to_xarray()
    assert dict(labelled.sizes) == {"stiffness": 2, "damping": 3, "load_inertia": 4, "inertias.0": 2}
    assert labelled["resonance"].attrs["units"] == "Hz"
    assert labelled["stiffness"].attrs == {"long_name": "stiffness", "units": "N m/rad", "present": 548.0}
    point = set_leaves(MODEL, {"stiffness": 500.0, "damping": 0.2, "load_inertia": 3e-3})
    picked = labelled.sel(stiffness=500.0, damping=0.2, load_inertia=3e-3)
    assert float(picked["resonance"]) == pytest.approx(float(resonance(point)), rel=1e-12)
    np.testing.assert_allclose(picked["inertias"], [4.8e-3, 3e-3])
    assert len(found.to_dataframe()) == 24
    assert "inertias" not in found.to_dataframe()  # no number of its own
    with pytest.raises(InputError, match="over 3 parameters"):
        found.plot("resonance")
    with pytest.raises(InputError, match="not one number at each point"):
        sweep(MODEL, {"stiffness": [300.0]}, both).plot("inertias")


def test_list_and_line_in_one_line():
    ax = sweep(MODEL, {STIFFNESS: [300.0, 500.0]}, resonance, units={"value": "Hz"}).plot()
    assert ax.get_xlabel() == "stiffness [N m/rad]" and ax.get_ylabel() == "value [Hz]"
    with pytest.raises(InputError, match="list of points"):
        sweep(MODEL, {"stiffness": [300.0, 500.0], "damping": [0.1, 0.2]}, resonance, grid=False).plot()


def test_a_long_sweep_goes_on(tmp_path):
    over = {"stiffness": np.linspace(200.0, 900.0, 50)}
    first = sweep(MODEL, over, modes, store=tmp_path / "study", chunk_size=8)
    for file in sorted((tmp_path / "study" / "chunks").iterdir())[3:]:
        file.unlink()
    second = sweep(MODEL, over, modes, store=tmp_path / "study")
    np.testing.assert_array_equal(first["damping"], second["damping"])
    with pytest.raises(InputError, match=r"another study: the function .* was changed"):
        sweep(set_leaves(MODEL, {"damping": 0.2}), over, modes, store=tmp_path / "study")


def test_points_that_all_raise_are_counted():
    def refused(model):
        return {"k": eqx.error_if(model.stiffness, model.stiffness > 0, "no")}

    found = sweep(MODEL, {"stiffness": [300.0, 500.0]}, refused, units={"k": "N m/rad"})
    assert found.failed.tolist() == [True, True]
    assert "2 of 2 points" in repr(found)
    assert list(found.to_dataframe()["remark"]) == ["EquinoxRuntimeError: no"] * 2


def test_elements_of_a_vector():
    class Chain(eqx.Module):
        stiffness: Float[Array, "_"]

    found = sweep(Chain(jnp.array([1.0, 2.0])), {"stiffness.1": [3.0, 4.0]}, lambda m: jnp.sum(m.stiffness))
    np.testing.assert_array_equal(found["value"], [4.0, 5.0])


def test_points_that_fail_are_marked_and_harm_no_other():
    found = sweep(MODEL, {"stiffness": [100.0, 200.0, 400.0, 900.0]}, fragile)
    np.testing.assert_array_equal(found.failed, [True, True, False, False])
    np.testing.assert_allclose(found["frequency"][2:], [20.0, 30.0])
    assert list(found.to_dataframe()["remark"]) == ["NaN: frequency", "NaN: frequency", "", ""]
    assert "2 of 4 points" in found._repr_html_()


@pytest.mark.parametrize(
    ("function", "over", "options", "named"),
    [
        (modes, {"stifness": [1.0]}, {}, "stifness.*stiffness"),
        (modes, {"load_friction": [1.0]}, {}, "not a number"),
        (modes, {}, {}, "one parameter or more"),
        (modes, {"stiffness": [1.0, 2.0], "damping": [1.0]}, {"grid": False}, "stiffness has 2, damping has 1"),
        (modes, {"stiffness": []}, {}, "at least one"),
        (modes, {"stiffness": [1.0], Parameter("damping", tied=("stiffness",)): [1.0]}, {}, "swept twice"),
        (modes, {"stiffness": [[1.0]]}, {}, "vector"),
        (modes, {"stiffness": [1.0, np.nan]}, {}, "finite"),
        (modes, {STIFFNESS: [50.0]}, {}, "outside of its bounds"),
        (modes, {STIFFNESS: [0.01]}, {"relative": True}, "outside of its bounds"),
        (modes, {"load_friction.viscous": [2.0]}, {"relative": True}, "zero in the model"),
        (modes, {"stiffness": [500.0]}, {"chunk_size": 0}, "chunk_size"),
        (modes, {"stiffness": [500.0]}, {"units": {"frequency": "Hz"}}, "resonance, damping"),
        (complex_result, {"stiffness": [500.0]}, {}, "complex"),
        (nothing, {"stiffness": [500.0]}, {}, "nothing"),
    ],
)
def test_bad_input_is_named(function, over, options, named):
    model = set_leaves(MODEL, {"load_friction.viscous": 0.0}) if "relative" in options else MODEL
    with pytest.raises(InputError, match=named):
        sweep(model, over, function, **options)
    with pytest.raises(InputError, match="no result"):
        sweep(MODEL, {"stiffness": [500.0]}, resonance)["frequency"]


def test_line():
    found = sweep(MODEL, {STIFFNESS: np.geomspace(200.0, 2000.0, 6)}, modes, units={"resonance": "Hz"})
    ax = plot_sweep(found, "resonance")
    assert ax.get_xlabel() == "stiffness [N m/rad]" and ax.get_ylabel() == "resonance [Hz]"
    assert ax.get_xscale() == "log"
    np.testing.assert_array_equal(ax.lines[0].get_ydata(), found["resonance"])
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["present value"]
    with pytest.raises(InputError, match="resonance, damping"):
        plot_sweep(found)
    given = plt.subplots()[1]
    assert plot_sweep(found, "damping", ax=given) is given
    panels = plot_sweep_panels(found)
    assert [panel.get_ylabel() for panel in panels] == ["resonance [Hz]", "damping"]
    with pytest.raises(InputError, match="1 axes, but 2"):
        plot_sweep_panels(found, axes=[given])


def test_line_marks_what_is_nan():
    ax = plot_sweep(sweep(MODEL, {"stiffness": [100.0, 200.0, 400.0, 900.0]}, fragile), "frequency")
    marks = next(line for line in ax.lines if line.get_label() == "NaN")
    np.testing.assert_array_equal(marks.get_xdata(), [100.0, 200.0])
    nowhere = plot_sweep(sweep(MODEL, {"stiffness": [100.0]}, fragile), "frequency")
    assert nowhere.lines


@pytest.mark.parametrize("function", [modes, fragile])
def test_map(function):
    over = {STIFFNESS: [900.0, 150.0, 500.0, 700.0], "damping": np.geomspace(0.01, 0.3, 5)}
    found = sweep(MODEL, over, function)
    name = next(iter(found.results))
    ax = plot_sweep(found, name)
    assert ax.get_xlabel() == "stiffness [N m/rad]" and ax.get_ylabel() == "damping" and ax.get_yscale() == "log"
    drawn = np.ma.filled(ax.collections[0].get_array(), np.nan).reshape(5, 4)
    np.testing.assert_array_equal(drawn, found[name][[1, 2, 3, 0]].T)
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert ("NaN" in labels) == (function is fragile) and "present values" in labels


def test_maps_of_a_single_value_or_a_constant_are_drawn():
    plot_sweep(sweep(MODEL, {"stiffness": [500.0], "damping": [0.1, 0.2]}, fragile), "frequency")
    ax = plot_sweep(sweep(MODEL, {"stiffness": [400.0, 500.0, 600.0], "damping": [0.1, 0.2, 0.3]}, fragile), "one")
    ax.figure.canvas.draw()
    plot_sweep(sweep(MODEL, {"stiffness": [100.0, 200.0, 110.0], "damping": [0.1, 0.2, 0.3]}, fragile), "frequency")
