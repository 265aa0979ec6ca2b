from tests.effects.rig import Reference, assert_same, simulate
from vibrojax.effects import BackStop


def test_agrees_with_an_independent_integration():
    # The load cell in front does not feel the stop behind; the accelerometer does.
    readings, _ = simulate(BackStop(2.5e-3))
    reference = Reference(back_gap=2.5e-3)
    assert_same(readings, reference, touches=4)
    assert reference()[0].min() < -2.5e-3
