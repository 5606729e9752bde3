"""What a look tells: each suspicious spot is found where it was put, and not where it was not."""

import json
import tomllib

import numpy as np
import pytest

from fitting.cli import main
from twin.io.look import look
from twin.io.measurement import MeasuredChannel, Measurement

RATE = 1000.0
T = np.arange(4000) / RATE
RNG = np.random.default_rng(3)
NOISE = 1e-3 * RNG.standard_normal(T.size)
POSITION = 0.1 * np.sin(2 * np.pi * T) + 1e-6 * RNG.standard_normal(T.size)
SPEED = 0.2 * np.pi * np.cos(2 * np.pi * T)


def kinds(*channels, times=T):
    made = [
        MeasuredChannel(name, values, unit, None if times is None else times, "index" if times is None else "time")
        for name, values, unit in channels
    ]
    return {(finding.channel, finding.kind) for finding in look(Measurement("run", "run.csv", tuple(made))).findings}


def texts(*channels):
    made = [MeasuredChannel(name, values, unit, T, "time") for name, values, unit in channels]
    return " ".join(finding.text for finding in look(Measurement("run", "run.csv", tuple(made))).findings)


def test_a_sound_record_is_not_suspected():
    assert kinds(("x_ist", POSITION, "m"), ("i", 3 * np.sin(5 * T) + NOISE, "A")) == set()


def test_clipping_but_not_resting():
    assert ("i", "clipping") in kinds(("i", np.clip(3 * np.sin(20 * T), -2.5, 2.5), "A"))
    resting = np.clip(T - 1, 0, 1) ** 2 * (3 - 2 * np.clip(T - 1, 0, 1))
    assert ("x", "clipping") not in kinds(("x", resting, "m"))


def test_spikes():
    values = np.sin(5 * T) + NOISE
    values[777] += 1.0
    assert kinds(("i", values, "A")) == {("i", "spike")}
    assert "0.777 s" in texts(("i", values, "A"))
    assert ("u", "spike") in kinds(("u", np.where(np.arange(T.size) == 500, 4.0, np.sin(T)), "V"))


def test_stuck_constant_and_missing():
    values = np.sin(5 * T) + NOISE
    values[1000:1200] = values[1000]
    assert ("i", "stuck") in kinds(("i", values, "A"))
    assert kinds(("i", np.full(T.size, 2.0), "A")) == {("i", "constant")}
    values = np.sin(5 * T) + NOISE
    values[5] = np.nan
    assert kinds(("i", values, "A")) == {("i", "missing")}


def test_resolution_and_drift():
    assert "steps of 0.1" in texts(("i", np.round(np.sin(5 * T), 1), "A"))
    assert ("i", "drift") in kinds(("i", 5 * T + np.sin(5 * T), "A"))


def test_counters_and_switches():
    assert kinds(("count", np.arange(4000.0), "")) == {("count", "counter")}
    assert not kinds(("on", (np.arange(4000) % 400 > 200).astype(float), "")) - {("on", "drift")}


def test_units_that_are_unlikely():
    assert "is it in mm" in texts(("x_ist", 1e3 * POSITION, ""))
    assert "is it in 1/min" in texts(("n_ist", 3000 * np.sin(T), "rad/s"))
    assert ("time of 'i'", "unit") in kinds(("i", np.sin(T) + NOISE, "A"), times=1000 * T)


def test_mains_line():
    for mains in (50, 60):
        told = texts(("i", 0.01 * np.sin(2 * np.pi * mains * T) + 3e-3 * RNG.standard_normal(T.size), "A"))
        assert f"{mains} Hz" in told and float(told.split("amplitude ")[1].split()[0]) == pytest.approx(0.01, rel=0.05)


def test_clocks():
    values = np.sin(T) + NOISE
    jumped = T + 0.5 * (T >= 2)
    assert ("time of 'i'", "gap") in kinds(("i", values, "A"), times=jumped)
    back = T.copy()
    back[3000:] -= 2
    assert ("time of 'i'", "backwards") in kinds(("i", values, "A"), times=back)
    back = T.copy()
    back[100] = back[99]
    assert ("time of 'i'", "repeated") in kinds(("i", values, "A"), times=back)


def test_copies_and_derivatives():
    assert ("y", "copy") in kinds(("x", POSITION, "m"), ("y", POSITION, "m"))
    assert "-1000 times 'x'" in texts(("x", POSITION, "m"), ("y", -1e3 * POSITION, "mm"))
    delayed = -1e3 * np.interp(T - 0.004, T, SPEED)
    told = texts(("x", POSITION, "m"), ("v", delayed, "mm/s"))
    assert "signs is turned" in told
    ratio, delay = (float(told.split(word)[1].split()[0].strip(",")) for word in ("times ", "turned, "))
    assert ratio == pytest.approx(-1000, rel=1e-2) and delay == pytest.approx(0.004, abs=3e-4)
    assert "derivative" not in texts(("x", POSITION, "m"), ("i", np.sin(33 * T), "A"))


@pytest.fixture
def csv(tmp_path):
    rows = "".join(
        f"{t:.4f};{1e3 * x!r};{i!r}\n" for t, x, i in zip(T.tolist(), POSITION.tolist(), SPEED.tolist(), strict=True)
    )
    path = tmp_path / 'axis "1".csv'
    path.write_text("t [s];x_ist [mm];i\n" + rows)
    return path


def test_command_tells_and_draws(csv, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["look", str(csv), "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "x_ist" in printed and "1000" in printed
    study = tomllib.loads(printed[printed.index("[data.") : printed.index("Pictures in")])
    run = study["data"]["axis_1"]
    assert run["file"] == str(csv)
    assert run["channels"]["position"] == {"column": "x_ist", "unit": "mm"}
    assert run["channels"]["current"] == {"column": "i", "unit": ""}
    assert {file.name for file in out.glob("*.png")} == {"traces_1.png", "spectra_1.png"}
    assert main(["look", str(csv), "--out", str(out)]) == 2
    assert "--force" in capsys.readouterr().err


def test_command_for_programs_and_options(csv, capsys):
    assert main(["look", str(csv), "--json", "--option", "decimal=.", "--option", "header_line=1", "--time", "t"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [channel["name"] for channel in told["channels"]] == ["x_ist", "i"]
    for wrong in (["--option", "decimal"], ["--option", "rate=fast"], ["--format", "xls"], ["--option", "colour=1"]):
        assert main(["look", str(csv), *wrong]) == 2
        assert capsys.readouterr().err.startswith("drivetwin: ")


def test_hostile_names_are_only_names(tmp_path, capsys):
    path = tmp_path / "run.npz"
    np.savez(path, **{"../../up$x^2": POSITION, "a\x1b[31mb": SPEED, "t": T})
    assert main(["look", str(path), "--out", str(tmp_path / "out")]) == 0
    printed = capsys.readouterr().out
    assert "\x1b" not in printed and "../../up$x^2" in printed
    assert {file.name for file in tmp_path.iterdir()} == {"run.npz", "out"}
