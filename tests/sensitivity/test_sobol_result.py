"""A Sobol study kept: saved and loaded without pickle, as table, in a notebook."""

import numpy as np
import pytest

from sensitivity import SobolIndices, sobol
from tests.sensitivity_functions import ISHIGAMI, ishigami
from twin._checks import InputError


@pytest.fixture(scope="module")
def found():
    return sobol(ishigami, ISHIGAMI, n=64, seed=1, outputs=["torque"], second_order=True, groups={"both": ["x1", "x3"]})


def test_round_trip(found, tmp_path):
    found.save(tmp_path / "study.1")
    loaded = SobolIndices.load(tmp_path / "study.1")
    for name in ("S1", "S1_conf", "ST", "ST_conf", "S2", "S2_conf", "variance", "sizes"):
        np.testing.assert_array_equal(getattr(loaded, name), getattr(found, name))
    assert loaded.space == found.space
    assert (loaded.groups, loaded.outputs, loaded.n, loaded.seed) == (("both", "x2", "both"), ("torque",), 64, 1)
    assert repr(loaded) == repr(found)


def test_another_kind_of_file_is_refused(found, tmp_path):
    np.savez(tmp_path / "other.npz", x=np.ones(2))
    with pytest.raises(InputError, match=r"is not a readable Sobol study"):
        SobolIndices.load(tmp_path / "other")
    with pytest.raises(InputError, match=r"Give the file that SobolIndices\.save wrote"):
        SobolIndices.load(tmp_path / "missing")


def test_tables(found):
    table = found.to_dataframe()
    assert table.index.names == ["output", "parameter"]
    assert table.loc[("torque", "x2"), "ST"] == found.ST[0, 1]
    assert found.second_order_dataframe().index.tolist() == [("torque", "both", "x2")]
    assert found.units == ("", "rad")
    html = found._repr_html_()
    assert "1 outputs, 2 parameters or groups, n = 64, seed 1, half widths at 95 %" in html and "<table" in html


def test_convergence(found):
    assert found.sizes.tolist() == [8, 16, 32, 64]
    early = found.at(16)
    assert early.n == 16 and early.sizes.tolist() == [8, 16]
    np.testing.assert_array_equal(early.ST, found.ST_by_size[1])
    assert found.at(64).S2.size == 0


def test_the_seed_decides():
    runs = [sobol(ishigami, ISHIGAMI, n=16, seed=seed) for seed in (1, 1, 2)]
    np.testing.assert_array_equal(runs[0].ST_conf, runs[1].ST_conf)
    assert np.all(runs[0].ST != runs[2].ST)
