"""The comparison of borders with brute force, on few points."""

import json
import sys

import pytest

from benchmarks import borders


def test_motions_differ_on_both_sides_of_every_border(tmp_path, monkeypatch):
    out = tmp_path / "borders.json"
    monkeypatch.setattr(borders, "GAPS", (2.5e-3, 3.5e-3))
    monkeypatch.setattr(sys, "argv", ["benchmarks.borders", "--points", "24", "--cycles", "800", "--json", str(out)])
    with pytest.raises(SystemExit) as ended:
        borders.main()
    rows = json.loads(out.read_text())["points"]
    assert ended.value.code == 0 and {row["kind"] for row in rows} == {"grazing", "fold"}
    assert len({(row["kind"], row["frequency_hz"], row["gap_m"]) for row in rows}) == len(rows)
    alone = [row["found"] for row in rows if not row["crowded"]]
    assert all(alone) and len(alone) > 5
