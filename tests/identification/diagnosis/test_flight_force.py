import numpy as np

from identification.diagnosis.diagnosis import MISSING
from identification.report.diagnosis_figures import flight_force
from tests.identification.diagnosis.made_diagnosis import FRICTION, made_diagnosis
from tests.identification.made_result import made_result


def test_the_force_that_a_model_adds_is_that_of_its_effect():
    made = made_diagnosis(made_result(), MISSING)
    force = flight_force(made.augmented.records, made.model)
    fast = np.abs(force["velocity"]) > 0.02
    assert fast.sum() > 1000
    assert np.abs(force["added"] + FRICTION * np.sign(force["velocity"]))[fast].max() < 1e-9
    assert flight_force(made.augmented.records, made.nominal_model) is None
