"""A sign of life on the terminal."""

import io
import sys
import time

import pytest

from fitting.commands import _ticking


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_terminal_sees_the_time_go_by(monkeypatch):
    screen = Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    with _ticking.ticking("fit"):
        time.sleep(2.3)
    assert screen.getvalue().count("fit: 00:0") >= 2


def test_elsewhere_nothing_is_said(capsys):
    with pytest.raises(RuntimeError), _ticking.ticking("fit"):
        raise RuntimeError("the error passes through")
    assert capsys.readouterr().err == ""
