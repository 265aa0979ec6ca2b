"""`--recipe NAME --data DIR`: half of it, too much of it, unknown names and missing recordings end in one line and status 2."""

import sys

import pytest

from vibrojax.cli import fit
from vibrojax.cli.source import experiment_source
from vibrojax.data_files import data_path


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--recipe", "silverbox"], "--recipe silverbox needs the folder of its recordings: add --data DIR"),
        (["--data", "."], "--data . is given without --recipe NAME: expected both or neither; add the recipe's name"),
        (
            ["rig", "--recipe", "silverbox", "--data", "."],
            "both rig and --recipe silverbox are given: expected one experiment; leave one out",
        ),
        (["--recipe", "billiards", "--data", "."], "unknown recipe 'billiards': expected one of airtrack_collisions"),
        (["--recipe", "silverbox", "--data", "."], ". lacks 1 of 1 files of recipe 'silverbox', the first 'SNLS80mV.mat'"),
    ],
)
def test_bad_sources_are_one_line(monkeypatch, capsys, tmp_path, arguments, message):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("vibrojax.cli.source.prepare_jax", lambda: None)
    monkeypatch.setattr(sys, "argv", ["fit-parameters", *arguments, "--quiet"])
    with pytest.raises(SystemExit) as ended:
        fit.main()
    assert ended.value.code == 2
    error = capsys.readouterr().err
    assert error.startswith(f"error: {message}")
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_without_a_recipe_the_path_is_handed_on():
    rig = data_path("example") / "experiment.toml"
    with experiment_source(rig, None, None) as source:
        assert source == rig
    with experiment_source(None, None, None) as source:
        assert source == data_path("example")
