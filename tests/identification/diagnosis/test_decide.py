"""The rule by which an effect is asserted: a case for each of its conditions, and that nothing else is compared with a number."""

import ast
import dataclasses
import inspect
import math

import pytest

from identification.diagnosis import decide as module
from identification.diagnosis.decide import BEYOND_NOISE, IDENTIFIED, LEFT_OVER, LEVEL, Evidence, decide

SOUND = Evidence(
    gain=300.0, degrees=1, tried=200, strength=12.0, drives=2.0, held_out=40.0, errors=(0.2, 0.1), left=20.0, left_degrees=16, forms=3
)
"""An effect that is asserted."""


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({}, ""),
        ({"gain": 25.0}, "no more than chance"),
        ({"gain": 30.0}, ""),
        ({"gain": 30.0, "degrees": 4}, "no more than chance"),
        ({"gain": 30.0, "tried": 20_000}, "no more than chance"),
        ({"gain": -5.0}, "no more than chance"),
        ({"strength": 2.9}, "do not identify"),
        ({"strength": math.nan}, "do not identify"),
        ({"drives": 4.0}, "drive the motion"),
        ({"held_out": -1.0}, "does not predict better"),
        ({"held_out": math.nan}, "does not predict better"),
        ({"held_out": None}, ""),
        ({"errors": (0.1, 0.2)}, "rises with it"),
        ({"errors": (0.1, math.nan)}, "rises with it"),
        ({"errors": None}, ""),
        ({"left": 130.0}, "leaves much that a free form explains"),
        ({"left": 110.0}, ""),
        ({"left": 20.0, "gain": 40.0}, ""),
        ({"left": math.inf, "left_degrees": 16}, "leaves much that a free form explains"),
    ],
)
def test_every_condition_refuses_alone(changed, reason):
    found = decide(dataclasses.replace(SOUND, **changed))
    assert (reason in found) if reason else found == ""


def test_no_other_number_decides():
    """Levels are those four, three of them in the rule, which compares with one of these, nothing, or two numbers of evidence."""
    tree = ast.parse(inspect.getsource(module))
    assigned = {target.id: node.value for node in tree.body if isinstance(node, ast.Assign) for target in node.targets}
    assert {name: ast.literal_eval(value) for name, value in assigned.items()} == {
        "LEVEL": LEVEL,
        "IDENTIFIED": IDENTIFIED,
        "LEFT_OVER": LEFT_OVER,
        "BEYOND_NOISE": BEYOND_NOISE,
    }
    (rule,) = (node for node in tree.body if isinstance(node, ast.FunctionDef))
    numbers = [node.value for node in ast.walk(rule) if isinstance(node, ast.Constant) and isinstance(node.value, int | float)]
    places = [node.slice.value for node in ast.walk(rule) if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant)]
    for place in places:
        numbers.remove(place)
    assert numbers == [0.0]
    compared = {ast.unparse(side) for node in ast.walk(rule) if isinstance(node, ast.Compare) for side in (node.left, *node.comparators)}
    allowed = {"LEVEL", "IDENTIFIED", "LEFT_OVER * evidence.gain", "0.0", "None"}
    assert all(one in allowed or one.startswith(("evidence.", "chance(evidence.")) for one in compared), compared
