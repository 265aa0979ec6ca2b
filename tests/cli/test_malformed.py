"""Every malformed experiment through the real command: one clear line, exit status 2, nothing written."""

import re
import sys

import pytest

from tests.identification.experiment.malformed import MALFORMED, write_valid
from vibrojax.cli import fit


@pytest.mark.parametrize(("damage", "message"), [case[1:] for case in MALFORMED], ids=[case[0] for case in MALFORMED])
def test_bad_input_gives_one_line_and_status_two(damage, message, monkeypatch, capsys, tmp_path):
    """As a user meets it, from `fit-parameters FOLDER --out DIR` on."""
    folder, out = tmp_path / "place" / "rig", tmp_path / "out"
    folder.mkdir(parents=True)
    write_valid(folder)
    damage(folder)
    before = sorted(tmp_path.rglob("*"))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["fit-parameters", str(folder), "--out", str(out), "--quiet"])
    with pytest.raises(SystemExit) as ended:
        fit.main()
    told = capsys.readouterr()
    assert ended.value.code == 2
    assert told.out == ""
    assert len(told.err.strip().splitlines()) == 1
    assert re.search(message, told.err)
    assert sorted(tmp_path.rglob("*")) == before
