import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from twin._checks import InputError
from twin.io.csv import read_csv

COLUMNS = {"position": ("x", "mm"), "speed": ("n", "1/min")}
ROWS = [f"{0.1 * k:.1f},{k},{60 * k}" for k in range(10)]


def write(tmp_path, *lines, encoding="utf-8"):
    path = tmp_path / "run.csv"
    path.write_bytes("\n".join(lines).encode(encoding) + b"\n")
    return path


def refuses(path, *words, columns=None, **arguments):
    with pytest.raises(InputError) as caught:
        read_csv(path, columns or COLUMNS, **arguments)
    for word in ("run.csv", *words):
        assert word in str(caught.value)


def test_reads_in_si(tmp_path):
    record = read_csv(write(tmp_path, "t, x, n", *ROWS), COLUMNS)
    np.testing.assert_allclose(record.channel("position"), 1e-3 * np.arange(10), rtol=1e-14)
    np.testing.assert_allclose(record.channel("speed"), 2 * np.pi * np.arange(10), rtol=1e-14)
    assert record.units == {"position": "m", "speed": "rad/s"} and record.name == "run"


def test_decimal_comma_preamble_units_line_and_old_encoding(tmp_path):
    lines = ["Prüfstand 3", "Zeit;Weg", "ms;µm", *(f"{100 * k};{k},5" for k in range(10))]
    path = write(tmp_path, *lines, "", encoding="latin-1")
    settings = dict(delimiter=";", decimal=",", header_line=2, first_data_line=4)
    record = read_csv(path, {"position": ("Weg", "um", "m")}, time=("Zeit", "ms"), encoding="latin-1", **settings)
    np.testing.assert_allclose(record.channel("position"), 1e-6 * (np.arange(10) + 0.5), rtol=1e-14)
    assert float(record.sample_rate) == pytest.approx(10.0)
    refuses(path, "utf-8", "latin-1", time=("Zeit", "ms"), columns={"position": ("Weg", "um")}, **settings)


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=8, max_size=12))
def test_round_trip_to_the_last_bit(tmp_path, values):
    lines = [f"{float(k)!r};{value!r}".replace(".", ",") for k, value in enumerate(values)]
    path = write(tmp_path, "t;x", *lines)
    record = read_csv(path, {"position": ("x", "m")}, delimiter=";", decimal=",")
    np.testing.assert_array_equal(record.channel("position"), np.asarray(values, dtype=np.float64))


@pytest.mark.parametrize("row", ["0.5,bad,3", "0.5,,3", "0.5,nan,3", "0.5,inf,3", "0.5,1;5,3"])
def test_cell_that_is_no_number(tmp_path, row):
    refuses(write(tmp_path, "t,x,n", *ROWS[:5], row, *ROWS[6:]), "line 7", "'x'", "position")


@pytest.mark.parametrize("row, count", [("0.5,1", 2), ("0.5,1,2,3", 4)])
def test_row_of_another_length(tmp_path, row, count):
    refuses(write(tmp_path, "t,x,n", *ROWS[:5], row, *ROWS[6:]), f"{count} columns", "line 7", "3 headings")


def test_point_beside_a_decimal_comma_is_refused(tmp_path):
    path = write(tmp_path, "t;x", *(f"{k};1.234" for k in range(10)))
    refuses(path, "line 2", "'1.234'", columns={"position": ("x", "m")}, delimiter=";", decimal=",")


def test_rows_all_longer_than_the_header(tmp_path):
    # pandas takes the first column for row labels then and shifts all others.
    refuses(write(tmp_path, "t,x,n", *(row + ",9" for row in ROWS)), "4 columns", "line 2")


def test_headings_without_rows(tmp_path):
    refuses(write(tmp_path, "t,x,n"), "no table of numbers")


def test_missing_and_double_column(tmp_path):
    refuses(write(tmp_path, "t,y,n", *ROWS), "no column 'x'", "'t', 'y', 'n'")
    refuses(write(tmp_path, "t,x,x", *ROWS), "2 columns 'x'")
    refuses(write(tmp_path, "t;x;n", *ROWS), "delimiter is probably")
    refuses(write(tmp_path, "t,x,n", *ROWS), "no line 40", header_line=40)


def test_wrong_unit(tmp_path):
    path = write(tmp_path, "t,x,n", *ROWS)
    refuses(path, "'position'", "'mm'", "Give it in 'N'", columns={"position": ("x", "mm", "N")})
    refuses(path, "time", "'mm'", time=("t", "mm"))


@pytest.mark.parametrize("given", [dict(delimiter=",", decimal=","), dict(delimiter="ab"), dict(decimal="x")])
def test_bad_separators(tmp_path, given):
    with pytest.raises(InputError, match="delimiter must be"):
        read_csv(write(tmp_path, "t,x,n", *ROWS), COLUMNS, **given)


def test_bad_lines_and_reserved_name(tmp_path):
    path = write(tmp_path, "t,x,n", *ROWS)
    with pytest.raises(InputError, match="header_line"):
        read_csv(path, COLUMNS, header_line=3, first_data_line=3)
    with pytest.raises(InputError, match="'time'"):
        read_csv(path, {"time": ("t", "s")})


def test_unusable_files(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        read_csv(tmp_path / "gone.csv", COLUMNS)
    (tmp_path / "run.csv").write_bytes(b"")
    refuses(tmp_path / "run.csv", "empty")
    (tmp_path / "run.csv").write_bytes(b"\x00\x01\xff" * 100)
    refuses(tmp_path / "run.csv")
