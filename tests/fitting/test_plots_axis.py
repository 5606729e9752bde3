"""Pictures of a controlled axis: what is drawn, labels with units, with axes given and without."""

import jax.numpy as jnp
import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest

from fitting.plots_axis import plot_closed_loop, plot_spring_deformations, plot_time_response
from twin._checks import InputError
from twin.drives import mauro_axis, spring_deformations
from twin.drives.screw_outputs import ScrewAxisOutputs
from twin.frf import FRF
from twin.references import JerkLimitedMove
from twin.trajectory import SimulationStatus, Trajectory

matplotlib.use("Agg")

F = jnp.geomspace(1.0, 300.0, 40)
LAG = 1 / (1 + 2j * jnp.pi * F / 60.0)


@pytest.fixture(autouse=True)
def close():
    yield
    plt.close("all")


def test_closed_loop_in_decibel_and_degrees():
    one = FRF(F, LAG[None, None], ("position",), ("reference",))
    axes = plot_closed_loop(one, label="model")
    again = plot_closed_loop(one, label="machine", axes=axes)
    assert again[0] is axes[0] and len(axes[0].lines) == 2
    np.testing.assert_allclose(axes[0].lines[0].get_ydata(), 20 * np.log10(np.abs(LAG)))
    np.testing.assert_allclose(axes[1].lines[0].get_ydata(), np.degrees(np.angle(LAG)))
    assert axes[0].get_ylabel() == "amplitude [dB]" and axes[1].get_ylabel() == "phase [°]"
    assert axes[1].get_xlabel() == "frequency [Hz]" and axes[1].get_xscale() == "log"
    assert [text.get_text() for text in axes[0].get_legend().get_texts()] == ["model", "machine"]
    both = FRF(F, jnp.stack([LAG, 2 * LAG])[:, None], ("position", "torque"), ("reference",))
    assert "torque" in plot_closed_loop(both, output="torque")[0].get_ylabel()
    with pytest.raises(InputError, match="Name one"):
        plot_closed_loop(both)
    with pytest.raises(InputError, match="2 are drawn"):
        plot_closed_loop(one, axes=axes[:1])


def test_time_response_has_position_reference_and_torque():
    t = jnp.linspace(0.0, 1.0, 11)
    outputs = ScrewAxisOutputs(*(0.01 * (k + 1) * t for k in range(9)))
    run = Trajectory(t, (), outputs, SimulationStatus.successful, jnp.zeros(()))
    move = JerkLimitedMove(0.1, 0.5, 3.0, 60.0)
    position, torque = plot_time_response(run, move)
    reference, found = position.lines
    np.testing.assert_allclose(found.get_ydata(), 1e3 * outputs.position)
    assert reference.get_ydata()[-1] == pytest.approx(100.0)
    np.testing.assert_allclose(torque.lines[0].get_ydata(), outputs.torque)
    assert (position.get_ylabel(), torque.get_ylabel()) == ("position [mm]", "motor torque [Nm]")
    assert torque.get_xlabel() == "time [s]"


def test_bars_of_the_springs_are_relative_to_the_largest():
    found = spring_deformations(mauro_axis())
    ax = plt.subplots()[1]
    assert plot_spring_deformations(found, ax=ax) is ax
    heights = [bar.get_height() for bar in ax.patches]
    assert len(heights) == 5 and max(heights) == heights[2] == 1.0
    assert heights[3] == pytest.approx(abs(float(found.axial.nut / found.axial.support)))
    assert "[-]" in ax.get_ylabel()
