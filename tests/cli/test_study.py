"""The study commands: what they hand on, and how they refuse."""

import sys

import numpy as np
import pytest

from vibrojax.cli import main, study


def call(monkeypatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["vibrojax", *arguments])
    monkeypatch.setenv("COLUMNS", "200")
    with pytest.raises(SystemExit) as ended:
        main.main()
    return ended.value.code


@pytest.mark.parametrize("name", list(study.COMMANDS))
def test_every_command_has_help_with_its_example(monkeypatch, capsys, name):
    assert call(monkeypatch, name, "--help") == 0
    assert f"vibrojax {name} --model" in capsys.readouterr().out


def test_values():
    np.testing.assert_allclose(study._values("--gaps", "0,1e-3"), [0.0, 1e-3])
    np.testing.assert_allclose(study._values("--ratios", "1:2:5"), np.linspace(1, 2, 5))
    assert study._values("--ratios", "3:9:1") == [3.0]


@pytest.mark.parametrize("text", ["1:2", "a,b", "1:2:0", ""])
def test_bad_values_end_in_one_line(monkeypatch, capsys, tmp_path, text):
    rest = ("--model", str(tmp_path / "model.json"), "--base-amplitude", "1e-3", "--out", str(tmp_path / "out"))
    assert call(monkeypatch, "peterka", "--ratios", text, *rest) == 2
    assert f"error: --ratios is {text!r}: expected A:B:N" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_model_that_cannot_be_read_ends_in_one_line(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr("vibrojax.cli.study.prepare_jax", lambda: None)
    rest = ("--base-amplitude", "1e-3", "--out", str(tmp_path / "out"))
    assert call(monkeypatch, "peterka", "--model", str(tmp_path / "no.json"), *rest) == 2
    assert "cannot be read" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
