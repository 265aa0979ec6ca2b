import pytest

from identification.experiment import CHANNELS, ExperimentError, si_unit
from identification.experiment.channels import factor_to_si


@pytest.mark.parametrize(
    ("unit", "dimension", "factor"),
    [
        ("m", "displacement", 1.0),
        ("mm", "displacement", 1e-3),
        ("um", "displacement", 1e-6),
        ("\u00b5m", "displacement", 1e-6),
        ("\u03bcm", "displacement", 1e-6),
        ("cm", "displacement", 0.01),
        ("in", "displacement", 0.0254),
        ("ft", "displacement", 0.3048),
        ("V", "displacement", 1.0),
        ("s", "time", 1.0),
        ("ms", "time", 1e-3),
        ("us", "time", 1e-6),
        ("min", "time", 60.0),
        ("m/s^2", "acceleration", 1.0),
        ("m/s2", "acceleration", 1.0),
        ("m/s\u00b2", "acceleration", 1.0),
        ("g", "acceleration", 9.80665),
        ("gn", "acceleration", 9.80665),
        ("N", "force", 1.0),
        ("kN", "force", 1e3),
        ("mN", "force", 1e-3),
        ("lbf", "force", 4.4482216152605),
        ("kip", "force", 4448.2216152605),
        ("mil", "displacement", 2.54e-5),
        ("lbs", "force", 4.4482216152605),
        ("kgf", "force", 9.80665),
        ("mg", "acceleration", 9.80665e-3),
        ("rpm", "frequency", 1.0 / 60.0),
        ("1/min", "frequency", 1.0 / 60.0),
        ("degrees", "angle", 0.017453292519943295),
        ("V", "force", 1.0),
        (" mm ", "displacement", 1e-3),
    ],
)
def test_factor(unit, dimension, factor):
    assert factor_to_si(unit, dimension, "[here]") == pytest.approx(factor, rel=1e-15)


@pytest.mark.parametrize(("unit", "dimension"), [("MM", "displacement"), ("g", "force"), ("V", "acceleration"), ("", "time")])
def test_no_such_unit(unit, dimension):
    with pytest.raises(ExperimentError, match=rf"in \[here\] is .*: expected one of {dimension}, that is "):
        factor_to_si(unit, dimension, "[here]")


def test_every_channel_has_an_si_unit_of_its_dimension():
    for channel, dimension in CHANNELS.items():
        assert factor_to_si(si_unit(channel), dimension, "[here]") == 1.0
