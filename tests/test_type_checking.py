"""The import hook checks types and shapes in both packages: a module dropped into either one rejects a wrong shape."""

import importlib

import jaxtyping
import numpy as np
import pytest

PROBE = """
from jaxtyping import Float
from numpy import ndarray

def total(samples: Float[ndarray, " time"]) -> float:
    return float(samples.sum())
"""


@pytest.mark.parametrize("package", ["vibrojax", "identification"])
def test_wrong_shapes_and_types_are_rejected(package, tmp_path, monkeypatch):
    (tmp_path / "type_probe.py").write_text(PROBE)
    parent = importlib.import_module(package)
    monkeypatch.setattr(parent, "__path__", [*parent.__path__, str(tmp_path)])
    probe = importlib.import_module(f"{package}.type_probe")
    assert probe.total(np.ones(3)) == 3.0
    with pytest.raises(jaxtyping.TypeCheckError, match="samples"):
        probe.total(np.ones((3, 2)))
    with pytest.raises(jaxtyping.TypeCheckError, match="samples"):
        probe.total(np.ones(3, dtype=int))
