"""`vibrojax datasets`: every recipe with its facts; with --data, what is there."""

import dataclasses
import hashlib
import sys

import pytest

from identification.recipes.load import DIFFERS, MISSING, PRESENT, load_recipe, recipe_names, recording_states
from vibrojax.cli import main


@pytest.fixture
def listed(monkeypatch, capsys):
    """Run the command; its exit status and what it says."""

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["vibrojax", "datasets", *arguments])
        with pytest.raises(SystemExit) as ended:
            main.main()
        said = capsys.readouterr()
        return ended.value.code, said.out, said.err

    return run


def test_every_recipe_is_listed_with_all_its_facts(listed):
    status, out, _ = listed()
    assert status == 0
    unwrapped = " ".join(out.split())
    for name in recipe_names():
        recipe = load_recipe(name)
        for fact in (name, recipe.origin, recipe.licence, recipe.citation, recipe.obtain, *recipe.sha256.values()):
            assert " ".join(fact.split()) in unwrapped


def test_files_are_found_missing_and_other(tmp_path):
    (tmp_path / "same.bin").write_bytes(b"recorded")
    (tmp_path / "other.bin").write_bytes(b"something else")
    digest = hashlib.sha256(b"recorded").hexdigest()
    recipe = dataclasses.replace(load_recipe("silverbox"), sha256={"same.bin": digest, "other.bin": digest, "none.bin": digest})
    assert recording_states(recipe, tmp_path) == {"same.bin": PRESENT, "other.bin": DIFFERS, "none.bin": MISSING}


def test_what_is_missing_is_reported_and_no_error(listed, tmp_path):
    status, out, _ = listed("silverbox", "--data", str(tmp_path))
    assert status == 0
    assert f"missing   {load_recipe('silverbox').sha256['SNLS80mV.mat']}  silverbox/SNLS80mV.mat" in out
    assert "0 of 1 files present" in out
    assert "not ready" in out


def test_what_is_there_is_ready(listed, shared):
    if not (shared / "recordings" / "silverbox").is_dir():
        pytest.skip("needs the shared recordings")
    _, out, _ = listed("silverbox", "--data", str(shared / "recordings"))
    assert "1 of 1 files present" in out
    assert "ready: fit-parameters --recipe silverbox --data" in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("billiards",), "unknown recipe 'billiards': expected one of "),
        (("--data", "nowhere"), "--data nowhere is not a folder: expected one that holds recordings; correct it or leave it out"),
    ],
)
def test_bad_input_is_one_line(listed, monkeypatch, tmp_path, arguments, message):
    monkeypatch.chdir(tmp_path)
    status, out, err = listed(*arguments)
    assert (status, out) == (2, "")
    assert err.startswith(f"error: {message}")
    assert err.count("\n") == 1
