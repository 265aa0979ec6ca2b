"""The level of chance that complete rigs ask for."""

import json

import numpy as np
import pytest

from benchmarks.concealed import level as command
from benchmarks.concealed.level import level

KINDS = 25


def exact(rigs, seed, kinds=KINDS):
    """Chances as an exact test states them, independent of each other."""
    return list(np.random.default_rng(seed).uniform(size=(rigs, kinds)))


@pytest.mark.parametrize("kinds", [1, KINDS])
def test_an_exact_test_needs_no_inflation(kinds):
    found = level(exact(20_000, 1, kinds), 0.01, draws=50)
    assert found.inflation == pytest.approx(1.0, rel=0.03)
    assert found.alpha == pytest.approx(-np.expm1(np.log1p(-0.01) / kinds), rel=0.1)
    low, high = found.interval
    assert low < found.alpha < high


def test_an_inflated_test_needs_a_smaller_level():
    """Of one kind, whose gains are twice what chance should give: p becomes its square."""
    chances = [one**2 for one in exact(20_000, 2, 1)]
    found = level(chances, 0.01, draws=50)
    assert found.inflation == pytest.approx(2.0, rel=0.03)
    assert found.alpha == pytest.approx(1e-4, rel=0.2)
    assert np.mean(np.concatenate(chances) < found.alpha) == pytest.approx(0.01, rel=0.2)


def test_interval_holds_the_true_level_of_few_rigs():
    true, held = -np.expm1(np.log1p(-0.01) / KINDS), 0
    for seed in range(100):
        low, high = level(exact(60, seed), 0.01, draws=200).interval
        held += low < true < high
    assert held >= 80


@pytest.mark.parametrize(
    ("chances", "rate", "said"),
    [
        ([[0.5]], 0.01, "two rigs or more"),
        ([[0.5], [0.2]], 0.5, "a rate between 0 and 0.5"),
        ([[0.5], [0.2]], 0.0, "a rate between 0 and 0.5"),
        ([[1.0]] * 70 + [[0.01]] * 30, 0.45, "a rate between 0 and 0.3"),
    ],
)
def test_what_cannot_be_determined_is_refused(chances, rate, said):
    with pytest.raises(ValueError, match=said):
        level([np.array(one) for one in chances], rate)


def written(path, lines):
    path.parent.mkdir(exist_ok=True)
    path.with_suffix(".jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    return str(path)


def run(monkeypatch, *arguments):
    monkeypatch.setattr("sys.argv", ["level", *arguments])
    command.main()


def test_command_reads_complete_rigs_of_every_file(tmp_path, capsys, monkeypatch):
    rigs = [{"key": f"null-{k}", "effects": [], "diagnosis": {"chances": [0.5, 0.25 / (k + 1)]}} for k in range(3)]
    others = [
        {"key": "null-9", "effects": [], "failure": "ValueError: no"},
        {"key": "a", "effects": [{"name": "back_stop"}], "diagnosis": {"chances": [1e-30]}},
    ]
    files = [written(tmp_path / folder / "dev.json", [*rigs, *others]) for folder in ("one", "two")]
    monkeypatch.setenv("COLUMNS", "300")
    run(monkeypatch, *files, "--rate", "0.1")
    said = capsys.readouterr().out
    assert all(file in said for file in files)
    assert "8.3e-02" in said
    assert "1.0e-30" not in said
    assert [line.split()[3] for line in said.splitlines() if line.startswith("│ all")] == ["6"]


@pytest.mark.parametrize(("lines", "said"), [(None, "is not there"), ([{"key": "n", "effects": [], "diagnosis": {}}], "older version")])
def test_command_says_what_a_file_lacks(lines, said, tmp_path, capsys, monkeypatch):
    file = tmp_path / "dev.json" if lines is None else written(tmp_path / "dev.json", lines)
    with pytest.raises(SystemExit) as ended:
        run(monkeypatch, str(file))
    assert ended.value.code == 2
    assert said in capsys.readouterr().err
