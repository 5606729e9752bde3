"""From a universal file to tables, shapes and pictures, without any Python in between."""

import hashlib
import json
import tomllib

import matplotlib
import numpy as np
import pandas as pd
import pytest
from modal_systems import FREQUENCY, LINES, RATIO, response, shapes_for, write_uff

from fitting.cli import main
from fitting.identification.modal_analysis import modal_analysis
from fitting.identification.modal_reciprocity import turned_around
from fitting.identification.modal_report import analyse_file
from fitting.plots_modal import mode_indicator, plot_mac, plot_shape, plot_stabilisation, plot_synthesis
from tests.fitting.report.html_page import Page
from twin._checks import InputError
from twin.frf import FRF
from twin.io.frf_uff import read_frf_uff
from twin.io.modes_uff import write_modes_uff
from twin.modal import ReferenceModes

matplotlib.use("Agg")


@pytest.fixture(scope="module")
def tapped():
    return response(FREQUENCY, RATIO, shapes_for(6), inputs=(0, 1), form="accelerance", noise=0.005)[0]


@pytest.fixture(scope="module")
def analysis(tapped):
    return modal_analysis(tapped)


@pytest.fixture(scope="module")
def done(tapped, tmp_path_factory):
    folder = tmp_path_factory.mktemp("modes")
    one = FRF(tapped.frequency, tapped.values[:, :1], tapped.outputs, tapped.inputs[:1], tapped.form)
    path = write_uff(folder / "tapped.uff", one)
    out = folder / "out"
    return out, *analyse_file(path, out, band=(15.0, 105.0))


def test_a_file_becomes_a_table_and_a_summary(done, tapped):
    out, text, summary = done
    assert "tapped.uff" in text and "verdict" in text and str(out) in text
    json.dumps(summary, allow_nan=False)
    assert [mode["frequency"] for mode in summary["modes"]] == pytest.approx(list(FREQUENCY), rel=1e-3)
    assert summary["converged"] and summary["mass_normalised"] and summary["form"] == "accelerance"
    assert summary["outputs"] == list(tapped.outputs)


def test_files_hold_the_modes(done):
    out, _, summary = done
    written = tomllib.loads((out / "modes.toml").read_text(encoding="utf-8"))
    assert [mode["frequency"] for mode in written["mode"]] == [mode["frequency"] for mode in summary["modes"]]
    table = pd.read_csv(out / "modes.csv", index_col="mode")
    np.testing.assert_allclose(table["damping ratio"], RATIO, rtol=2e-2)
    assert np.all(table["standard error [Hz]"] > 0)
    shapes = pd.read_csv(out / "shapes.csv", index_col="response")
    assert shapes.shape == (8, 18)
    assert np.all(table["95 % from [Hz]"] < table["frequency [Hz]"])
    assert np.all(table["damping ratio 95 % to"] > table["damping ratio"])
    assert not any("±" in name for name in (*table.columns, *shapes.columns)) and table.columns.is_unique
    for name in ("stabilisation.png", "responses.png", "mac.png", "shapes.png"):
        assert (out / name).stat().st_size > 10_000


def test_the_folder_says_what_was_asked_and_of_what(done):
    out, _, summary = done
    held = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert held["modes"] == summary["modes"] and held["asked"]["band"] == [15.0, 105.0] and "numpy" in held["versions"]
    file = out.parent / "tapped.uff"
    assert held["data"]["responses"] == {"file": file.name, "sha256": hashlib.sha256(file.read_bytes()).hexdigest()}
    low, high = held["modes"][0]["frequency_95"]
    assert low < held["modes"][0]["frequency"] < high


def test_the_report_has_all_sections(done):
    out, _, summary = done
    text = (out / "report.html").read_text(encoding="utf-8")
    assert len(Page(text).all("svg")) > 8 + 6
    for title in ("Modes", "Stabilisation diagram", "Shapes", "Likeness of the shapes (MAC)", "Responses at a glance"):
        assert f">{title}</h2>" in text
    assert summary["data"]["responses"]["sha256"] in text
    assert text.count("not explained (rms)") == 8


@pytest.fixture(scope="module")
def small():
    return response(
        FREQUENCY[:3], RATIO[:3], shapes_for(3, 3), LINES[:160], inputs=(0, 1), form="accelerance", noise=0.005
    )[0]


def test_fewer_points_than_modes_have_no_mac(small, tmp_path):
    few = FRF(small.frequency, small.values[:2], small.outputs[:2], small.inputs, small.form)
    text, summary = analyse_file(few, tmp_path, modes=3)
    assert "Shapes at 2 points do not tell 3 modes apart" in text and len(summary["warnings"]) >= 1
    assert not (tmp_path / "mac.png").exists()
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Likeness" not in page and "a MAC among them misleads" in page


def test_a_table_has_even_numbers(analysis):
    rows = [line.split() for line in repr(analysis).splitlines()[2:8]]
    for column in range(1, 5):
        assert len({len(row[column].partition(".")[2]) for row in rows}) == 1


@pytest.mark.parametrize(
    "words, said",
    [(["--modes", "20.0", "33", "--order", "12"], 2), (["--modes", "x"], "neither frequencies")],
)
def test_modes_and_order_on_the_command_line(small, tmp_path, capsys, words, said):
    file = write_uff(tmp_path / "a.uff", small)
    code = main(["modes", str(file), "--out", str(tmp_path / "out"), "--json", *words])
    told = capsys.readouterr()
    if isinstance(said, str):
        assert code == 2 and said in told.err
        return
    assert code == 0 and "looking for modes in a.uff" in told.err
    found = json.loads(told.out)
    assert len(found["modes"]) == said and found["asked"]["order"] == (12 if "--order" in words else None)


def test_a_test_stays_as_it_was_measured(small, tmp_path, capsys):
    hammer = turned_around(small)
    file = write_uff(tmp_path / "a.uff", hammer)
    for i, words in enumerate(([], ["--as-measured"])):
        assert main(["modes", str(file), "--out", str(tmp_path / str(i)), "--json", "--modes", "1", *words]) == 0
        found = json.loads(capsys.readouterr().out)
        assert found["reciprocal"] == (not words) and len(found["outputs"]) == (2 if words else 3)


def test_options_of_measured_modes_are_not_for_studies(tmp_path, capsys):
    assert main(["modes", str(tmp_path / "a.toml"), "--order", "4"]) == 2
    assert "--order is for measured responses" in capsys.readouterr().err


def test_shapes_go_into_a_universal_file(done):
    import pyuff

    out, _, summary = done
    sets = pyuff.UFF(str(out / "shapes.uff")).read_sets()
    assert [one["freq"] for one in sets] == pytest.approx([mode["frequency"] for mode in summary["modes"]], rel=1e-5)
    assert sets[2]["modal_damp_vis"] == pytest.approx(summary["modes"][2]["damping_ratio"], rel=1e-5)
    assert list(sets[0]["node_nums"]) == list(range(1, 9))
    true = shapes_for(6)[:, 0]
    found = np.asarray(sets[0]["r1"])
    assert found * np.sign(found @ true) == pytest.approx(true, abs=0.02)
    assert not np.any(sets[0]["r2"])


def test_complex_shapes_and_names_of_nodes_in_a_universal_file(tmp_path):
    import pyuff

    shapes = np.array([[1.0 + 0.5j, 2.0], [0.5, -1.0j]])
    modes = ReferenceModes([10.0, 20.0], [0.01, 0.02], shapes, ("N6 x", "bed z"))
    sets = pyuff.UFF(str(write_modes_uff(tmp_path / "m.uff", modes))).read_sets()
    assert sets[0]["eig"] == pytest.approx(2 * np.pi * 10 * (-0.01 + 1j * np.sqrt(1 - 1e-4)), rel=1e-5)
    np.testing.assert_allclose(sets[1]["r3"], [0, -1.0j], atol=1e-6)
    assert "1=N6, 2=bed" in sets[0]["id4"]
    real = ReferenceModes([10.0], [0.01], [[1.0], [2.0]], ("N6 x", "N6 rz"))
    (one,) = [pyuff.UFF(str(write_modes_uff(tmp_path / "r.uff", real, mass_normalised=True))).read_sets()]
    assert one["r6"] == pytest.approx([2.0]) and one["modal_m"] == 1.0
    turning = ReferenceModes([10.0], [0.01], [[1.0], [2.0j]], ("N6 x", "N6 rz"))
    with pytest.raises(InputError, match="rotations"):
        write_modes_uff(tmp_path / "t.uff", turning)
    with pytest.raises(InputError, match="node and direction"):
        write_modes_uff(tmp_path / "t.uff", ReferenceModes([10.0], [0.01], [[1.0]], ("speed",)))
    with pytest.raises(InputError, match="folder"):
        write_modes_uff(tmp_path / "none" / "t.uff", real)


def test_rows_without_direction_have_no_universal_file(tmp_path):
    frf, _ = response(FREQUENCY[:3], RATIO[:3], shapes_for(3, rows=3), LINES[:160], form="accelerance")
    named = FRF(frf.frequency, frf.values, ("a", "b", "c"), ("a",), frf.form)
    analyse_file(named, tmp_path)
    assert not (tmp_path / "shapes.uff").exists() and (tmp_path / "modes.toml").exists()


def test_unusable_files(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        analyse_file(tmp_path / "none.uff", tmp_path)
    empty = tmp_path / "empty.uff"
    empty.write_text("")
    with pytest.raises(InputError):
        analyse_file(empty, tmp_path)


def test_the_file_is_read_as_written(tapped, tmp_path):
    frf = read_frf_uff(write_uff(tmp_path / "a.uff", tapped))
    np.testing.assert_allclose(frf.values, tapped.values, rtol=1e-4, atol=1e-4 * np.abs(tapped.values).max())


def test_stabilisation_diagram_shows_poles_and_modes(analysis):
    ax = plot_stabilisation(analysis)
    labels = ax.get_legend_handles_labels()[1]
    assert "and in shape" in labels and "modes taken" in labels
    assert ax.get_xlim() == (10.0, 109.75)
    indicator = mode_indicator(analysis.measured)
    assert indicator.shape == (2, LINES.size) and np.all(indicator[0] >= indicator[1])


def test_other_pictures_return_their_axes(analysis):
    above, below = plot_synthesis(analysis, "3 x", "1 x")
    assert above.get_yscale() == "log" and "phase" in below.get_ylabel()
    assert "m/(Ns²)" in above.get_ylabel()
    ax = plot_mac(analysis.shapes)
    assert len(ax.get_xticks()) == 6
    ax = plot_shape(analysis, 2)
    assert "33" in ax.get_title(loc="left") and ax.get_ylabel() == "shape [1/√kg]"
    with pytest.raises(InputError, match="no mode 9"):
        plot_shape(analysis, 9)
