import json

import numpy as np
import pytest

from benchmarks.concealed import level as command
from benchmarks.concealed.level import level


@pytest.mark.parametrize("inflation", [1.0, 2.0])
def test_level_is_the_quantile_of_an_exponential_tail(inflation):
    chances = np.exp(-inflation * np.random.default_rng(1).exponential(size=20_000))
    found = level(chances, 0.01, draws=50)
    assert found.inflation == pytest.approx(inflation, rel=0.03)
    assert np.log(found.alpha) == pytest.approx(inflation * np.log(0.01), rel=0.03)
    low, high = found.interval
    assert low < found.alpha < high
    assert np.mean(chances < found.alpha) == pytest.approx(0.01, rel=0.2)


def test_interval_holds_the_true_level_of_few_rigs():
    rng, true = np.random.default_rng(2), 0.01
    held = 0
    for _ in range(100):
        low, high = level(rng.uniform(size=60), 0.01, draws=200).interval
        held += low < true < high
    assert held >= 80


@pytest.mark.parametrize(("chances", "rate"), [([0.5], 0.01), ([0.5, 0.2], 0.6), ([0.5, 0.2], 0.0)])
def test_too_little_is_refused(chances, rate):
    with pytest.raises(ValueError, match="two rigs at least"):
        level(np.array(chances), rate)


def test_command_reads_complete_rigs_only(tmp_path, capsys, monkeypatch):
    lines = [
        {"key": "null-0", "effects": [], "diagnosis": {"chance": 0.5}},
        {"key": "null-1", "effects": [], "diagnosis": {"chance": 0.25}},
        {"key": "null-2", "effects": [], "failure": "ValueError: no"},
        {"key": "a", "effects": [{"name": "back_stop"}], "diagnosis": {"chance": 1e-30}},
    ]
    (tmp_path / "dev.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    monkeypatch.setattr("sys.argv", ["level", str(tmp_path / "dev.json"), "--rate", "0.1"])
    command.main()
    said = capsys.readouterr().out
    assert "2.5e-01" in said
    assert "1.0e-30" not in said
