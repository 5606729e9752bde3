"""Frequency responses from tables, in every way they are written."""

import h5py
import numpy as np
import pytest
import pyuff
import scipy.io

from twin._checks import InputError
from twin.io.frf_table import ResponseChoice, read_frf

F = np.linspace(5.0, 200.0, 60)
G = 1e-6 / (1 - (F / 80) ** 2 + 0.06j * F / 80)  # m/N
PAIR = ("table", "motor")


def text(tmp_path, heading, *columns):
    path = tmp_path / "frf.csv"
    rows = (
        ";".join(heading)
        + "\n"
        + "".join(";".join(f"{v!r}" for v in row) + "\n" for row in np.stack(columns, 1).tolist())
    )
    path.write_text(rows)
    return path


@pytest.mark.parametrize(
    ("heading", "columns"),
    [
        (["f [Hz]", "Re [um/N]", "Im [um/N]"], (F, 1e6 * G.real, 1e6 * G.imag)),
        (["frequency", "Mag [m/N]", "Phase [deg]"], (F, abs(G), np.angle(G, deg=True))),
        (["f in kHz", "magnitude (dB)", "phase (rad)"], (F / 1e3, 20 * np.log10(abs(G)), np.angle(G))),
    ],
)
def test_tables_that_name_themselves(tmp_path, heading, columns):
    frf = read_frf(text(tmp_path, heading, *columns), form="receptance")
    np.testing.assert_allclose(frf.frequency, F, rtol=1e-12)
    np.testing.assert_allclose(frf.values[0, 0], G, rtol=1e-9)
    assert frf.form == "receptance" and frf.variance is None


def test_chosen_columns_units_and_variance(tmp_path):
    coherence = np.full(F.size, 0.9)
    path = text(tmp_path, ["w", "a", "b", "c", "s"], 2 * np.pi * F, 1e6 * abs(G), np.angle(G), coherence, 0.1 * abs(G))
    choice = ResponseChoice(magnitude="a", phase="b", phase_unit="rad", unit="um/N", expected="m/N")
    arguments = dict(frequency="w", frequency_unit="rad/s")
    frf = read_frf(path, {PAIR: choice}, **arguments)
    np.testing.assert_allclose(frf[PAIR], G, rtol=1e-9)
    with_coherence = ResponseChoice(magnitude="a", phase="b", phase_unit="rad", unit="um/N", coherence="c", averages=20)
    frf = read_frf(path, {PAIR: with_coherence}, **arguments)
    np.testing.assert_allclose(frf.variance[0, 0], abs(G) ** 2 * 0.1 / 0.9 / 20, rtol=1e-9)
    with_deviation = ResponseChoice(magnitude="a", phase="b", phase_unit="rad", unit="um/N", deviation="s")
    frf = read_frf(path, {PAIR: with_deviation}, **arguments)
    np.testing.assert_allclose(frf.standard_deviation(*PAIR), 1e-6 * 0.1 * abs(G), rtol=1e-9)
    for wrong, told in (
        (ResponseChoice(magnitude="a"), "no mixture"),
        (ResponseChoice(magnitude="a", phase="b", expected="m/N", unit="A"), "'A'"),
        (ResponseChoice(magnitude="a", phase="b", coherence="c"), "averages is None"),
        (ResponseChoice(magnitude="a", phase="gone"), "no channel 'gone'"),
    ):
        with pytest.raises(InputError, match=told):
            read_frf(path, {PAIR: wrong}, **arguments)
    with pytest.raises(InputError, match="no column of frequencies"):
        read_frf(path, {PAIR: choice}, frequency="omega")
    with pytest.raises(InputError, match="every response for every excitation"):
        read_frf(path, {PAIR: choice, ("x", "y"): choice}, **arguments)


def test_complex_columns_of_mat_and_hdf5(tmp_path):
    scipy.io.savemat(tmp_path / "frf.mat", {"freq": F, "G": G})
    with h5py.File(tmp_path / "frf.h5", "w") as file:
        file["freq"], file["G"] = F, G
    for name in ("frf.mat", "frf.h5"):
        np.testing.assert_allclose(read_frf(tmp_path / name).values[0, 0], G, rtol=1e-12)


def test_universal_file(tmp_path):
    path = tmp_path / "frf.uff"
    function = pyuff.prepare_58(
        binary=0, func_type=4, rsp_node=1, rsp_dir=1, ref_node=2, ref_dir=1, data=G, x=F, id1="", rsp_ent_name="NONE",
        ref_ent_name="NONE", abscissa_spacing=0, abscissa_spec_data_type=18, ordinate_spec_data_type=8,
        orddenom_spec_data_type=13,
    )  # fmt: skip
    pyuff.UFF(str(path)).write_sets([function], "add")
    frf = read_frf(path)
    assert frf.form == "receptance"
    np.testing.assert_allclose(frf["1 x", "2 x"], G, rtol=1e-6)
