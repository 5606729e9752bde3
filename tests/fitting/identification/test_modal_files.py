"""Universal files that are cut short, or lack responses, are told before their modes are."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from modal_systems import FREQUENCY, LINES, RATIO, response, shapes_for, write_uff

from fitting.cli import main
from fitting.identification.modal_report import analyse_file
from twin._checks import InputError
from twin.io._whole_grid import largest_grid, missing
from twin.io.frf_uff import read_frf_uff, read_largest_frf_uff
from twin.io.modes_uff import write_modes_uff
from twin.modal import ReferenceModes

GAP = ("3 x", "2 x")


@pytest.fixture(scope="module")
def tapped():
    return response(
        FREQUENCY[:3], RATIO[:3], shapes_for(3), LINES[:160], inputs=(0, 1), form="accelerance", noise=0.005
    )[0]


@pytest.mark.parametrize("share", [0.3, 0.9, 0.999])
def test_a_file_that_was_cut_is_refused_as_look_does(tapped, tmp_path, capsys, share):
    whole = write_uff(tmp_path / "whole.uff", tapped).read_bytes()
    cut = tmp_path / "cut.uff"
    cut.write_bytes(whole[: int(share * len(whole))])
    told = []
    for command in (["look", str(cut)], ["modes", str(cut), "--out", str(tmp_path / "out")]):
        assert main(command) == 2
        told.append(capsys.readouterr().err.splitlines()[-1])
    assert told[0] == told[1] and "ends within a dataset" in told[0]


def test_what_is_no_universal_file_is_told(tmp_path):
    file = tmp_path / "table.csv"
    file.write_text("f,x\n1,2\n")
    with pytest.raises(InputError, match="holds no dataset"):
        read_frf_uff(file)


def test_missing_responses_are_told_and_gone_without(tapped, tmp_path):
    file = write_uff(tmp_path / "gap.uff", tapped, missing=[GAP])
    frf, remarks, component = read_largest_frf_uff(file)
    assert frf.outputs == tuple(f"{i} x" for i in (1, 2, 4, 5, 6, 7, 8)) and frf.inputs == ("1 x", "2 x")
    kept = np.asarray(tapped.values)[[0, 1, 3, 4, 5, 6, 7]]
    np.testing.assert_allclose(frf.values, kept, rtol=1e-4, atol=1e-4 * np.abs(kept).max())
    assert component == ""
    assert len(remarks) == 1 and "3 x / 2 x" in remarks[0] and "7 x 2, without response 3 x" in remarks[0]
    _, summary = analyse_file(file, tmp_path / "out", modes=3)
    assert remarks[0] in summary["warnings"]
    with pytest.raises(InputError, match="no response of '3 x' to '2 x'"):
        read_frf_uff(file)


def test_a_look_shows_lines_and_layout(tapped, tmp_path, capsys):
    file = write_uff(tmp_path / "gap.uff", tapped, missing=[GAP])
    assert main(["look", str(file)]) == 0
    text = capsys.readouterr().out
    assert "Layout: 8 responses x 2 excitations (16 frequency responses, 1 missing)." in text
    head, row = (line.split() for line in text.splitlines()[-18:-16])
    assert head[2:9] == ["lines", "first", "[Hz]", "last", "[Hz]", "step", "[Hz]"]
    assert row[-8:-4] == ["160", "10", "49.75", "0.25"]
    assert main(["look", str(file), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["channels"][0]["lines"] == {"first": 10.0, "last": 49.75, "step": 0.25} and "8 resp" in found["layout"]


def test_a_look_shows_the_modes_of_a_file_of_modes(tmp_path, capsys):
    modes = ReferenceModes([143.70004, 287.2], [0.009, 0.006], [[1.0, 2.0], [2.0, -1.0]], ("1 x", "2 x"))
    file = write_modes_uff(tmp_path / "m.uff", modes, notes=("measured: tap.uff", "component: BED"))
    assert main(["look", str(file)]) == 0
    text = capsys.readouterr().out
    assert "2 modes at 2 nodes" in text and "measured: tap.uff" in text and "component: BED" in text
    assert text.splitlines()[-1].split() == ["2", "287.2", "0.006"]
    assert main(["look", str(file), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["modes"]
    assert "143.70004 Hz" in found[0]["header"][0] and found[1]["number"] == 2


def test_a_look_shows_complex_modes(tmp_path, capsys):
    shapes = np.array([[1.0 + 0.5j, 2.0], [0.5, -1.0j]])
    file = write_modes_uff(tmp_path / "c.uff", ReferenceModes([10.0, 20.0], [0.01, 0.02], shapes, ("1 x", "2 x")))
    assert main(["look", str(file)]) == 0
    number, frequency, ratio = capsys.readouterr().out.splitlines()[-1].split()
    assert number == "2" and [float(frequency), float(ratio)] == pytest.approx([20.0, 0.02], rel=1e-4)


def test_a_whole_file_has_no_remark(tapped, tmp_path):
    assert read_largest_frf_uff(write_uff(tmp_path / "whole.uff", tapped))[1] == []


pairs = st.sets(st.tuples(st.sampled_from("abcd"), st.sampled_from("pqrst")), min_size=1)


@given(pairs)
def test_the_largest_grid_is_whole_and_no_other_is_larger(there):
    rows, columns = largest_grid(sorted(there))
    assert rows and columns and all((row, column) in there for row in rows for column in columns)
    for bits in range(1, 16):
        chosen = [row for i, row in enumerate("abcd") if bits >> i & 1]
        shared = [column for column in "pqrst" if all((row, column) in there for row in chosen)]
        assert len(chosen) * len(shared) <= len(rows) * len(columns)


@given(pairs)
def test_a_grid_lacks_what_makes_it_whole(there):
    full = there | set(missing(sorted(there)))
    assert missing(sorted(full)) == [] and len(full) == len({a for a, _ in there}) * len({b for _, b in there})


def test_the_emptiest_of_many_names_goes_first():
    names = [f"n{i}" for i in range(30)]
    there = [(a, b) for a in names for b in names if (a, b) != ("n3", "n7")]
    rows, columns = largest_grid(there)
    assert len(rows) * len(columns) == 29 * 30
