import json

import pytest

from benchmarks import convergence


@pytest.mark.thorough
def test_the_quick_run_writes_everything(tmp_path, capsys):
    convergence.main(out=tmp_path, quick=True)
    report = json.loads((tmp_path / "convergence.json").read_text(encoding="utf-8"))
    assert {path.name for path in tmp_path.glob("*.png")} == {"trajectories.png", "gradients.png", "bifurcations.png"}
    assert all(3.2 < curve["slope"] < 3.8 for curve in report["trajectories"])
    assert all(3.0 < curve["slope"] < 4.2 for curve in report["gradients"])
    assert "slope" in capsys.readouterr().out
