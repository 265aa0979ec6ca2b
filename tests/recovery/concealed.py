"""One effect concealed in a small rig, by the simulator that shares no line with the program, and the search for it."""

from pathlib import Path

import numpy as np

from benchmarks.simulator import Order, draw_case, write_case
from identification.diagnosis.errors import numbers
from identification.diagnosis.search.forward import COMPLETE, search
from identification.estimation.nominal import nominal_fit
from identification.experiment import load_experiment
from identification.windows.prepare import prepare

SUSPENSION = (
    "coulomb_friction",
    "quadratic_drag",
    "asymmetric_damping",
    "cubic_stiffness",
    "constant_force",
    "hysteresis",
    "second_mode",
    "frequency_drift",
)
STOP_AND_CART = (
    "stop_compliance",
    "contact_adhesion",
    "back_stop",
    "missing_stop",
    "deep_stop",
    "gap_drift",
    "gap_step",
    "base_harmonics",
    "cart_recoil",
)
SENSORS = ("force_lag", "force_clipping", "force_saturation", "mains_hum", "gain_error", "time_offset")


_DRIVEN = {"missing_stop": 3}
"""Records with a moving cart; a stop that the experiment does not declare needs more than one."""


def assert_recovered(name: str, folder: Path) -> None:
    """The search names the effect and no other, and the nominal parameters beside it are right within four standard errors."""
    rng = np.random.default_rng(1)
    case = draw_case(rng, Order(kind="soft", driven=_DRIVEN.get(name, 1), samples=(1601, 4001), effects=((name, 1.0),)))
    write_case(folder, case, rng)
    found = search(nominal_fit(prepare(load_experiment(folder))).fitted, deadline=np.inf)
    assert (found.fitted.names, found.ended) == ((name,), COMPLETE)
    beside = {p.name: p for p in numbers(found.fitted) if p.name in case.rig.fitted}
    assert set(beside) == {"zeta", "f_n"} | (set() if name == "missing_stop" else {"k_i", "n", "lambda_i"})
    for p in beside.values():
        assert p.stderr is not None and abs(p.value - case.rig.fitted[p.name]) < 4.0 * p.stderr, p.name
