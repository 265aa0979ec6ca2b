"""`vibrojax report` as a user meets it."""

import hashlib
import json
import sys

import pytest

from identification.result.files import StoredFit, fit_dataset
from identification.result.store import write_dataset
from tests.identification.made_result import made_result
from vibrojax.cli import main


def call(monkeypatch, *arguments, prepare_jax=lambda: None):
    monkeypatch.setattr("vibrojax.cli.experiments.prepare_jax", prepare_jax)
    monkeypatch.setattr(sys, "argv", ["vibrojax", "report", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        main.main()
    return ended.value.code


def test_page_and_plots_appear_beside_the_result_or_elsewhere(tmp_path, monkeypatch, capsys):
    write_dataset(fit_dataset(StoredFit(result=made_result(samples=600), reference=None, provenance={"seed": 7})), tmp_path / "result.nc")
    (tmp_path / "fit.json").write_text("{}")
    assert call(monkeypatch, tmp_path, "--out", tmp_path / "page") == 0
    assert "made <by> hand" in capsys.readouterr().out
    assert call(monkeypatch, tmp_path, "--quiet") == 0
    assert capsys.readouterr() == ("", "")
    drawn = {path.name for path in (tmp_path / "page").iterdir()}
    assert {"report.html", "residuals.png"} <= drawn
    assert {path.name for path in tmp_path.iterdir()} == drawn | {"result.nc", "fit.json", "page"}


def test_the_fit_states_the_pages_checksum_anew_and_a_foreign_file_stays(tmp_path, monkeypatch):
    write_dataset(fit_dataset(StoredFit(result=made_result(samples=600), reference=None, provenance={"seed": 7})), tmp_path / "result.nc")
    (tmp_path / "fit.json").write_text('{"schema": 1, "files": {"result.nc": "ab", "report.html": "cd"}}')
    assert call(monkeypatch, tmp_path, "--quiet") == 0
    stated = json.loads((tmp_path / "fit.json").read_text())
    assert stated["schema"] == 1 and stated["files"]["result.nc"] == "ab"
    drawn = {path for path in tmp_path.iterdir() if path.suffix in (".html", ".png", ".pdf")}
    assert {name: stated["files"][name] for name in (path.name for path in drawn)} == {
        path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in drawn
    }
    (tmp_path / "fit.json").write_text("[1, 2")
    assert call(monkeypatch, tmp_path, "--quiet") == 0
    assert (tmp_path / "fit.json").read_text() == "[1, 2"


def test_black_and_white_or_a_clear_refusal(tmp_path, monkeypatch, capsys):
    write_dataset(fit_dataset(StoredFit(result=made_result(samples=600), reference=None, provenance={"seed": 7})), tmp_path / "result.nc")
    assert call(monkeypatch, tmp_path, "--quiet", "--style", "print") == 0
    assert '<body class="print">' in (tmp_path / "report.html").read_text(encoding="utf-8") and (tmp_path / "residuals.pdf").exists()
    assert call(monkeypatch, tmp_path, "--style", "sepia", prepare_jax=lambda: pytest.fail("JAX was loaded")) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "'--style': 'sepia' is no style; expected screen|print" in line


@pytest.mark.parametrize("there", [[], ["fit.json"], ["diagnosis.json", "model.json", "report.html"]])
def test_a_folder_without_a_result_is_one_line_and_nothing_written(tmp_path, monkeypatch, capsys, there):
    for name in there:
        (tmp_path / name).write_text("{}")
    assert call(monkeypatch, tmp_path, prepare_jax=lambda: pytest.fail("JAX was loaded")) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.startswith("error: ")
    assert "result.nc cannot be read (no such file): expected the result.nc that a fit or a diagnosis writes" in told.err
    assert len(told.err.splitlines()) == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(there)
