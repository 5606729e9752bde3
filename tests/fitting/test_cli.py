"""The command line: the demo from end to end, and one clear line for input that cannot be used."""

import json

import numpy as np
import pytest

from fitting.cli import main
from fitting.result import FitResult
from twin.batch import StudyInterrupted, batched


@pytest.mark.slow
def test_demo_identifies_the_drive(tmp_path, capsys):
    out = tmp_path / "demo"
    assert main(["demo", "--out", str(out), "--force"]) == 0
    printed = capsys.readouterr().out
    summary = json.loads((out / "summary.json").read_text())
    assert str(out / "report.html") in printed
    assert "held back" in (out / "report.html").read_text()
    for path, row in summary["parameters"].items():
        assert path in printed
        assert row["value"] > 0
    # The bench has friction and cogging that the model has not; the laws themselves are what counts.
    assert summary["largest_stiffness_error"] < 0.02
    assert summary["largest_damping_error"] < 0.05
    assert abs(summary["parameters"]["train_1.mesh.stiffness.k1"]["value"] / 1.8709e7 - 1) < 0.05
    assert all(control["passed"] for control in summary["controls"])
    assert len(list((out / "records").glob("*.csv"))) == 5


def test_missing_data_is_one_clear_line(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("DRIVETWIN_DATA", str(tmp_path / "nowhere"))
    assert main(["reproduce", "emps", "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.startswith("drivetwin: ")
    assert "DRIVETWIN_DATA" in error


def test_out_that_is_a_file_is_refused(tmp_path, capsys):
    blocker = tmp_path / "file"
    blocker.write_text("")
    assert main(["demo", "--out", str(blocker)]) == 2
    assert str(blocker) in capsys.readouterr().err


def test_unknown_command_ends_with_usage():
    with pytest.raises(SystemExit) as stop:
        main(["reproduce", "nothing"])
    assert stop.value.code == 2


def test_status_of_a_study(tmp_path, capsys):
    batched(np.sum, np.ones((30, 2)), mode="loop", chunk_size=10, store=tmp_path / "study", progress=False)
    assert main(["study", "status", str(tmp_path / "study")]) == 0
    printed = capsys.readouterr().out
    assert "30 of 30 samples (3 of 3 chunks)" in printed
    assert "Complete." in printed
    next(tmp_path.glob("study/chunks/*")).unlink()
    assert main(["study", "status", str(tmp_path / "study")]) == 0
    assert "The same call with the same store goes on." in capsys.readouterr().out


def test_status_of_what_is_no_study(tmp_path, capsys):
    assert main(["study", "status", str(tmp_path / "nowhere")]) == 2
    assert "holds no study" in capsys.readouterr().err
    assert not (tmp_path / "nowhere").exists()


@pytest.mark.parametrize(
    ("error", "code", "told"),
    [
        (StudyInterrupted("The executor died. 3 chunks are kept"), 3, "drivetwin: The executor died. 3 chunks"),
        (KeyboardInterrupt(), 130, "drivetwin: stopped by Ctrl-C; what a study had stored is kept"),
    ],
)
def test_interruptions_are_one_sentence(tmp_path, capsys, monkeypatch, error, code, told):
    def interrupted(folder):
        raise error

    monkeypatch.setattr("fitting.rack_pinion_demo.run_demo", interrupted)
    assert main(["demo", "--out", str(tmp_path)]) == code
    assert capsys.readouterr().err.startswith(told)


def test_damaged_result_is_named(tmp_path):
    broken = tmp_path / "fit.npz"
    broken.write_bytes(b"PK\x03\x04 not an archive")
    with pytest.raises(ValueError, match=r"fit\.npz is not a readable fit result"):
        FitResult.load(broken, None)


def test_results_are_not_written_over_without_being_told(tmp_path, capsys, monkeypatch):
    def run(folder):
        (folder / "summary.json").write_text("{}")
        (folder / "plots").mkdir(exist_ok=True)
        (folder / "plots" / "fit.png").write_text("")
        return "done"

    monkeypatch.setattr("fitting.rack_pinion_demo.run_demo", run)
    out = tmp_path / "results"
    assert main(["demo", "--out", str(out)]) == 0
    assert main(["demo", "--out", str(out)]) == 2
    assert "--force" in capsys.readouterr().err
    (out / "mine.txt").write_text("mine")
    monkeypatch.setattr("fitting.rack_pinion_demo.run_demo", lambda folder: "done")
    assert main(["demo", "--out", str(out), "--force"]) == 0
    assert {path.name for path in out.rglob("*") if path.is_file()} == {".drivetwin.json", "mine.txt"}


def test_files_of_others_are_not_written_among(tmp_path, capsys):
    (tmp_path / "thesis.tex").write_text("mine")
    assert main(["demo", "--out", str(tmp_path)]) == 2
    assert "holds files already" in capsys.readouterr().err


def test_a_run_that_did_not_end_goes_on_in_its_folder(tmp_path, monkeypatch):
    def stopped(folder):
        (folder / "half").write_text("")
        raise KeyboardInterrupt

    monkeypatch.setattr("fitting.rack_pinion_demo.run_demo", stopped)
    assert main(["demo", "--out", str(tmp_path)]) == 130
    monkeypatch.setattr("fitting.rack_pinion_demo.run_demo", lambda folder: "done")
    assert main(["demo", "--out", str(tmp_path)]) == 0


def test_status_as_json(tmp_path, capsys):
    batched(np.sum, np.ones((30, 2)), mode="loop", chunk_size=10, store=tmp_path / "study", progress=False)
    assert main(["study", "status", str(tmp_path / "study"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["chunks"] == [3, 3]


def test_every_command_says_what_it_does(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--help"])
    assert stop.value.code == 0
    printed = capsys.readouterr().out
    assert all(name in printed for name in ("demo", "reproduce", "study"))


def test_an_error_of_the_program_does_not_pass_for_a_result(tmp_path, capsys, monkeypatch):
    from fitting.commands import look

    def broken(_):
        raise ZeroDivisionError("nobody thought of it")

    monkeypatch.setattr(look, "run", broken)
    assert main(["look", str(tmp_path)]) == 4
    assert "an error of drivetwin itself" in capsys.readouterr().err
