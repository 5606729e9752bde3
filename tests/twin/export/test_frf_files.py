"""Frequency responses written as universal files and text come back as they were."""

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from reference_systems import two_mass

from twin._checks import InputError
from twin.export import write_frf_csv, write_frf_uff
from twin.frf import FRF
from twin.io.frf_uff import read_frf_uff
from twin.linear import frequency_response

PLACES = {"position": "1 rz", "load_position": "2 rz", "command": "1 rz", "load": "2 rz"}


def response(frequency):
    return frequency_response(two_mass().second_order(1.0), frequency)


def random_frf(seed, frequency, form="receptance"):
    random = np.random.default_rng(seed)
    values = random.normal(size=(2, 2, frequency.size)) + 1j * random.normal(size=(2, 2, frequency.size))
    return FRF(jnp.asarray(frequency), jnp.asarray(values * 1e-7), ("3 x", "14 rz"), ("3 x", "3 z"), form)


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    seed=st.integers(0, 1000),
    form=st.sampled_from(["receptance", "mobility", "accelerance"]),
    binary=st.booleans(),
    even=st.booleans(),
)
def test_universal_files_come_back(tmp_path, seed, form, binary, even):
    frequency = 2.0 + 0.25 * np.arange(40) if even else np.geomspace(1.0, 900.0, 40)
    frf = random_frf(seed, frequency, form)
    back = read_frf_uff(write_frf_uff(tmp_path / "a.uff", frf, binary=binary))
    np.testing.assert_allclose(back.frequency, frf.frequency, rtol=1e-15 if binary or even else 6e-6)
    np.testing.assert_allclose(back.values, frf.values, rtol=0 if binary else 1e-11)
    assert (back.outputs, back.inputs, back.form) == (frf.outputs, frf.inputs, form)


def test_a_simulated_response_is_given_places_and_a_form(tmp_path):
    frf = response(np.arange(1.0, 50.0))
    back = read_frf_uff(write_frf_uff(tmp_path / "a.uff", frf, places=PLACES, form="receptance"))
    assert (back.outputs, back.inputs, back.form) == (("1 rz", "2 rz"), ("1 rz", "2 rz"), "receptance")
    np.testing.assert_allclose(back.values, frf.values, rtol=1e-11)


def test_measured_against_the_direction(tmp_path):
    frf = response(np.arange(1.0, 50.0))
    path = write_frf_uff(tmp_path / "a.uff", frf, places=PLACES | {"position": "1 -rz"}, form="receptance")
    assert "1  -6" in path.read_text()
    np.testing.assert_allclose(read_frf_uff(path).values, frf.values, rtol=1e-11)


@pytest.mark.parametrize("even", [True, False])
def test_binary_files_say_how_long_they_are(tmp_path, even):
    frequency = np.arange(1.0, 50.0) if even else np.geomspace(1.0, 50.0, 49)
    data = write_frf_uff(tmp_path / "a.uff", random_frf(1, frequency), binary=True).read_bytes()
    head = data.split(b"    58b")[1].split(b"\n")[0].decode()
    begin = data.index(b"58b")
    # Eleven lines follow the first one; the numbers run from there to the mark of the end.
    for _ in range(12):
        begin = data.index(b"\n", begin) + 1
    assert int(head[24:36]) == data.index(b"    -1\n", begin) - begin == 49 * 8 * (2 if even else 3)


def test_what_the_format_cannot_hold_is_refused(tmp_path):
    frf = response(np.arange(1.0, 50.0))
    with pytest.raises(InputError, match=r"output 'position' has no node.*places=\{'position': '1 x'\}"):
        write_frf_uff(tmp_path / "a.uff", frf, form="receptance")
    with pytest.raises(InputError, match="form 'ratio'"):
        write_frf_uff(tmp_path / "a.uff", frf, places=PLACES)
    with pytest.raises(InputError, match="both at '1 rz'"):
        write_frf_uff(tmp_path / "a.uff", frf, places=PLACES | {"load": "1 rz"}, form="mobility")
    with pytest.raises(InputError, match="binary=True"):
        write_frf_uff(tmp_path / "a.uff", random_frf(1, 100 + 1e-5 * np.arange(9) ** 1.1))
    with pytest.raises(InputError, match="folder"):
        write_frf_uff(tmp_path / "gone" / "a.uff", random_frf(1, np.arange(1.0, 9.0)))
    assert list(tmp_path.iterdir()) == []


def test_text_keeps_every_digit(tmp_path):
    frf = response(np.arange(1.0, 50.0))
    units = {("position", "command"): "rad/A"}
    path = write_frf_csv(tmp_path / "a.csv", frf.with_variance(np.abs(frf.values)), units=units, delimiter=";")
    head = path.read_text().splitlines()[0].split(";")
    assert head[:4] == [
        "frequency [Hz]",
        "real position/command [rad/A]",
        "imaginary position/command [rad/A]",
        "variance position/command [(rad/A)^2]",
    ]
    table = np.loadtxt(path, delimiter=";", skiprows=1)
    np.testing.assert_array_equal(table[:, 0], frf.frequency)
    np.testing.assert_array_equal(table[:, 1] + 1j * table[:, 2], frf["position", "command"])
    with pytest.raises(InputError, match=r"\.csv"):
        write_frf_csv(tmp_path / "a.h5", frf)
