"""Effects added on request."""

import pytest

from benchmarks.contact_free.rigs import Job, write_rig
from identification.diagnosis.search.on_request import extension
from identification.estimation.estimate import fit_experiment
from identification.experiment import load_experiment
from vibrojax.errors import InputError


def test_no_names_are_no_extension():
    assert extension(()) is None


@pytest.mark.parametrize("names", [("coulomb_frction",), "coulomb_friction", ""])
def test_names_are_checked(names):
    with pytest.raises(InputError, match="expected a list|did you mean"):
        extension(names)


@pytest.mark.thorough
def test_an_effect_that_acts_is_found_at_its_size(tmp_path):
    """A mass that rolls freely, against dry friction."""
    concealed = write_rig(tmp_path, Job(kind="unsprung", effect="coulomb_friction", seed=0, index=0))
    result = fit_experiment(load_experiment(tmp_path), extend=extension(["coulomb_friction"]))
    assert result.added is not None and result.added.gain > 50.0 and result.added.bic < -90.0
    (friction,) = result.parameters
    assert friction.stderr is not None and abs(friction.value - concealed["friction_force"]) < 4.0 * friction.stderr


def test_an_effect_that_does_not_act_gains_nothing(small):
    result = fit_experiment(small, extend=extension(["coulomb_friction"]))
    (friction,) = (one for one in result.parameters if one.spec.name == "coulomb_friction.friction_force")
    assert result.added is not None and result.added.names == ("coulomb_friction",)
    assert -0.5 < result.added.gain < 5.0 and result.added.held_back is None
    assert friction.stderr is None or abs(friction.value) < 4.0 * friction.stderr
