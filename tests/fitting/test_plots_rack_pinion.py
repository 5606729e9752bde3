"""Pictures of a preloaded drive: labels with units, what is drawn of the points given, with axes given and without."""

import jax.numpy as jnp
import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest

from fitting.identification.load_surface import LoadSurfaceFit, fit_root_stiffness
from fitting.identification.peak_picking import pick_peak
from fitting.identification.preload_chain import ChainPoint
from fitting.plots_rack_pinion import plain_ticks, plot_load_surface, plot_preload_responses, plot_quadrants
from fitting.residuals.load_surface import total_over_contacts
from twin._checks import InputError
from twin.drives.leipe import leipe_drive
from twin.frf import FRF

matplotlib.use("Agg")

LAW = leipe_drive().train_1.mesh.stiffness
LINES = np.arange(30.0, 201.0)
FORCES = np.array([[400.0, 1500.0, 3000.0, 4700.0], [-300.0, -1400.0, -2900.0, -4600.0]])


def point(percent, force, used):
    stiffness, s = 2 * float(LAW(force)), 2j * np.pi * LINES
    g = (4e4 * s + stiffness) / (403.8 * s**2 + 4e4 * s + stiffness)
    response = FRF(jnp.asarray(LINES), jnp.asarray(g)[None, None], ("table",), ("motor",))
    peak = pick_peak(LINES, g, 403.8) if used else None
    return ChainPoint(percent, (force, -force), response, peak, used)


POINTS = [point(3.0, 140.0, False), point(20.0, 900.0, True), point(100.0, 4700.0, True)]


@pytest.fixture(scope="module")
def surface():
    return fit_root_stiffness(FORCES, np.asarray(total_over_contacts(LAW, FORCES)))


@pytest.fixture(autouse=True)
def _close():
    yield
    plt.close("all")


def legend(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


@pytest.mark.parametrize("given", [False, True])
def test_responses(given):
    axes = plt.subplots(2)[1] if given else None
    grid = plot_preload_responses(POINTS, axes=axes)
    if given:
        assert list(grid) == list(axes)
    assert [ax.get_ylabel() for ax in grid] == ["|V_T/V_1| [dB]", "phase [°]"]
    assert grid[1].get_xlabel() == "frequency [Hz]"
    assert legend(grid[0]) == ["3 %, not fitted", "20 %", "100 %"]
    curves = [line for line in grid[0].lines if len(line.get_xdata()) == LINES.size]
    assert [line.get_linestyle() for line in curves] == [":", "-", "-"]
    expected = 20 * np.log10(np.abs(np.asarray(POINTS[1].response.values[0, 0])))
    np.testing.assert_allclose(curves[1].get_ydata(), expected)
    marks = [line for line in grid[1].lines if line.get_marker() == "o"]
    np.testing.assert_allclose(
        [line.get_xdata()[0] for line in marks], [p.peak.frequency for p in POINTS if p.peak is not None]
    )
    np.testing.assert_array_equal([line.get_ydata()[0] for line in marks], -90.0)
    grid[0].figure.canvas.draw()
    assert [t.get_text() for t in grid[1].get_xticklabels()] == ["30", "40", "60", "80", "100", "150", "200"]


def test_responses_want_two_axes():
    with pytest.raises(InputError, match="holds 1 axes, but 2"):
        plot_preload_responses(POINTS, axes=[plt.subplots()[1]])


def test_ticks_keep_the_limits():
    ax = plt.subplots()[1]
    ax.set_xscale("log")
    ax.set_xlim(25.0, 90.0)
    plain_ticks(ax, [20, 30, 50, 100])
    assert ax.get_xlim() == (25.0, 90.0)
    assert [t.get_text() for t in ax.get_xticklabels()] == ["30", "50"]
    assert ax.get_xticklabels(minor=True) == []


@pytest.mark.parametrize("given", [False, True])
def test_load_surface(surface: LoadSurfaceFit, given):
    ax = plt.figure().add_subplot(projection="3d") if given else None
    totals = np.asarray(surface.surface(FORCES))
    found = plot_load_surface(surface, FORCES, totals, label="k [N/µm]", scale=1e6, ax=ax)
    if given:
        assert found is ax
    assert (found.get_xlabel(), found.get_ylabel()) == ("|F₁| [kN]", "|F₂| [kN]")
    assert found.get_zlabel() == "k [N/µm]"
    assert "remaining error" in found.get_title()
    assert legend(found) == ["one drive train", "measured"]
    (points,) = [line for line in found.lines if line.get_label() == "measured"]
    x, y, z = points.get_data_3d()
    np.testing.assert_allclose([x, y], np.abs(FORCES) / 1e3)
    np.testing.assert_allclose(z, totals / 1e6)
    found.figure.canvas.draw()


@pytest.mark.parametrize("given", [False, True])
def test_quadrants(given):
    ax = plt.subplots()[1] if given else None
    found = plot_quadrants(LAW, FORCES, ax=ax)
    if given:
        assert found is ax
    assert (found.get_xlabel(), found.get_ylabel()) == ("F₁ [kN]", "F₂ [kN]")
    assert legend(found) == ["motion", "start"]
    np.testing.assert_allclose(found.lines[0].get_xdata(), FORCES[0] / 1e3)
    assert [text.get_text() for text in found.texts] == ["(1)", "(2)", "(3)", "(4)"]
    labels = [other.get_ylabel() for other in found.figure.axes]
    assert "k(F₁) + k(F₂) [N/µm]" in labels
    assert found.get_xlim()[1] == pytest.approx(1.15 * 4.7)
    found.figure.canvas.draw()


def test_quadrants_reach_as_far_as_asked():
    found = plot_quadrants(LAW, FORCES, reach=6000.0)
    np.testing.assert_allclose([*found.get_xlim(), *found.get_ylim()], [-6, 6, -6, 6])
