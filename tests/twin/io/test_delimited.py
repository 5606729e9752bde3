"""Delimited text of every sort: the layout is found, told, and can be overridden."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from twin._checks import InputError
from twin.io.formats._shared import looks_like_unit, split_unit
from twin.io.measurement import read_measurement

ROWS = 24


def write(tmp_path, text, encoding="utf-8"):
    path = tmp_path / "run.txt"
    path.write_bytes(text.encode(encoding))
    return path


def table(delimiter, decimal, columns=("{t:.2f}", "{x:.3f}", "{k}")):
    rows = (delimiter.join(columns).format(t=k / 100, x=0.5 * k - 3, k=k) for k in range(ROWS))
    return "".join(row.replace(".", decimal) + "\n" for row in rows)


@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize("delimiter", [";", "\t", ",", "|", " ", "   ", " ; "])
def test_delimiters_and_decimals(tmp_path, delimiter, decimal):
    if delimiter == "," and decimal == ",":
        return
    found = read_measurement(
        write(tmp_path, delimiter.join(["t [s]", "x[mm]", "n"]) + "\n" + table(delimiter, decimal))
    )
    assert found.names == ("x", "n") and found["x"].unit == "mm"
    np.testing.assert_allclose(found["x"].values, 0.5 * np.arange(ROWS) - 3, atol=1e-12)
    np.testing.assert_allclose(found["x"].times, np.arange(ROWS) / 100, atol=1e-12)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "latin-1", "cp1252", "utf-32"])
def test_encodings(tmp_path, encoding):
    text = "Prüfstand\nZeit;Weg\nms;µm\n" + table(";", ",", ("{k}", "{x:.3f}"))
    found = read_measurement(write(tmp_path, text, encoding))
    assert found["Weg"].unit == "µm" and found["Weg"].rate == pytest.approx(1000.0)


@pytest.mark.parametrize(
    ("head", "unit"),
    [
        ("t/s;x/mm;n\n", "mm"),
        ("t in s;x in mm;n\n", "mm"),
        ("t (s);x (mm);n\n", "mm"),
        ("t;x;n\n[s];[mm];[-]\n", "mm"),
        ("t;x;n\ns;mm;\n", "mm"),
        ("# comment\n# t [s];x [mm];n\n", "mm"),
        ("Rig 3\nRate;1000\n\nt;x (filtered);n\n\n", ""),
        ("t;x [counts];n\nfloat;float;float\n", None),
    ],
)
def test_headings_and_units(tmp_path, head, unit):
    found = read_measurement(write(tmp_path, head + table(";", ",")))
    if unit is None:
        return
    channel = found.channels[0]
    assert channel.name == ("x (filtered)" if "filtered" in head else "x") and channel.unit == unit
    assert channel.times is not None and found.names[1] == "n"


def test_split_of_headings():
    told = {
        "x [mm]": ("x", "mm"), "v (mm/s)": ("v", "mm/s"), "n/(1/min)": ("n", "1/min"), "F/N": ("F", "N"),
        "a/b": ("a/b", ""), "x (raw)": ("x (raw)", ""),
        "M in Nm": ("M", "Nm"), "made in house": ("made in house", ""),
        "Temp [°C]": ("Temp", "degC"), "n [U/min]": ("n", "rpm"), "p": ("p", ""), "x, mm": ("x", "mm"),
    }  # fmt: skip
    assert {heading: split_unit(heading) for heading in told} == told
    assert looks_like_unit("m/s²") and looks_like_unit("N·m") and not looks_like_unit("speed")


def test_no_headings_and_rate_above(tmp_path):
    found = read_measurement(write(tmp_path, table(" ", ".")))
    assert found.names == ("column 2", "column 3") and found["column 2"].rate == pytest.approx(100.0)
    told = "Sampling rate: 2 kHz\nx;n\n" + table(";", ".", ("{x}", "{k}"))
    assert read_measurement(write(tmp_path, told))["n"].rate == pytest.approx(2000.0)
    told = "Abtastzeit = 0,5 ms\nx;n\n" + table(";", ".", ("{x}", "{k}"))
    assert read_measurement(write(tmp_path, told))["n"].rate == pytest.approx(2000.0)


@pytest.mark.parametrize(
    ("clock", "step"),
    [
        ("2024-01-05T12:30:{:02d}.500", 1.0),
        ("2024-01-05 12:30:{:02d},500+01:00", 1.0),
        ("05.01.2024 12:30:{:02d}", 1.0),
        ("12:30:00.{:03d}", 1e-3),
        ("12:{:02d}", 60.0),
    ],
)
def test_clock_times(tmp_path, clock, step):
    text = "stamp;x\n" + "".join(f"{clock.format(k)};{k}\n" for k in range(ROWS))
    np.testing.assert_allclose(read_measurement(write(tmp_path, text))["x"].times, step * np.arange(ROWS), atol=1e-6)


def test_clock_over_midnight_beside_a_date(tmp_path):
    stamps = [f"05.01.2024;23:59:{50 + k},5" if k < 10 else f"06.01.2024;00:00:{k - 10:02d},5" for k in range(ROWS)]
    text = "Datum;Uhrzeit;Weg [mm]\n" + "".join(f"{stamp};{k},5\n" for k, stamp in enumerate(stamps))
    found = read_measurement(write(tmp_path, text))
    np.testing.assert_allclose(found["Weg"].times, np.arange(ROWS), atol=1e-9)
    assert any("dates" in remark for remark in found.remarks)


def test_thousands_text_columns_and_a_footer(tmp_path):
    text = "t;x;state\n" + "".join(f"{k};1.234,{k:02d};ok\n" for k in range(ROWS)) + "End of measurement\n"
    found = read_measurement(write(tmp_path, text))
    np.testing.assert_allclose(found["x"].values, 1234 + np.arange(ROWS) / 100)
    assert found.names == ("x",) and any("last lines" in remark for remark in found.remarks)


def test_missing_samples_stay_missing(tmp_path):
    text = "t;x;y\n" + "".join(f"{k};{'' if k == 5 else k};{'NaN' if k == 7 else k}\n" for k in range(ROWS))
    found = read_measurement(write(tmp_path, text))
    assert np.flatnonzero(np.isnan(found["x"].values)).tolist() == [5]
    assert np.flatnonzero(np.isnan(found["y"].values)).tolist() == [7]


@pytest.mark.parametrize(
    ("row", "told"),
    [
        ("7;bad;7", "'bad' in column 'x'"),
        ("7;7", "2 cells instead of 3"),
        ("7;7;7;7", "4 cells"),
        ("7;1.2.3;7", "1.2.3"),
    ],
)
def test_bad_rows_are_named(tmp_path, row, told):
    rows = table(";", ".").splitlines()
    text = "\n".join(["t;x;n", *rows[:7], row, *rows[8:]])
    with pytest.raises(InputError, match=r"run\.txt.*on line 9") as caught:
        read_measurement(write(tmp_path, text))
    assert told in str(caught.value)


def test_everything_can_be_overridden(tmp_path):
    text = "a;b\nc;d\n" + "".join(f"{k};{2 * k}\n" for k in range(ROWS))
    path = write(tmp_path, text)
    assert read_measurement(path).names == ("c", "d")
    found = read_measurement(path, header_line=1, first_data_line=5, time="a", time_unit="ms")
    assert found.names == ("b",) and found["b"].values[0] == 4 and found["b"].rate == pytest.approx(1000.0)
    assert read_measurement(path, header_line=0, rate=10.0).channels[0].name == "column 1"
    for wrong in (dict(delimiter="ab"), dict(decimal="x"), dict(header_line=3, first_data_line=2), dict(encoding="no")):
        with pytest.raises(InputError):
            read_measurement(path, **wrong)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(st.floats(-1e12, 1e12), min_size=9, max_size=15),
    st.sampled_from([";", "\t", " ", "|"]),
    st.sampled_from([".", ","]),
)
def test_round_trip_to_the_last_bit(tmp_path, values, delimiter, decimal):
    rows = "".join(f"{float(k)!r}{delimiter}{value!r}\n".replace(".", decimal) for k, value in enumerate(values))
    found = read_measurement(write(tmp_path, f"t{delimiter}x\n{rows}"))
    np.testing.assert_array_equal(found["x"].values, values)
