"""The sweep for GPUs runs on whatever device there is, in both precisions."""

import json
import sys

import pytest

from benchmarks import gpu


def test_both_precisions_are_measured_on_the_device_that_is_there(tmp_path, monkeypatch):
    out = tmp_path / "gpu.json"
    asked = ("--lanes", "64", "--cycles", "100", "--checked", "64", "--json", str(out))
    monkeypatch.setattr(sys, "argv", ["benchmarks.gpu", *asked])
    gpu.main()
    found = json.loads(out.read_text())["precisions"]
    assert list(found) == ["float64", "float32"]
    for one in found.values():
        assert one["platform"] and set(one["problems"]) == {"soft", "stiff"}
        for each in one["problems"].values():
            assert each["lane_cycles_per_second"]["64"] > 0.0
            assert each["error"]["median"] < 5e-4
    errors = [one["problems"]["soft"]["error"]["median"] for one in found.values()]
    assert errors[0] != pytest.approx(errors[1], rel=1e-9)
