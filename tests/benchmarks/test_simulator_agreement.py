"""The program, and the simulator that shares no line with it, show the same record of a rig that conceals an effect."""

import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks.simulator import Hidden, RecordPlan
from benchmarks.simulator.example import RIG
from benchmarks.simulator.experiment import motion
from benchmarks.simulator.faults import ClockRate, Curve, HighPass, LowPass, Tone
from benchmarks.simulator.faults import ZeroDrift as FaultOfZero
from vibrojax.channels import channels
from vibrojax.contact import HuntCrossley
from vibrojax.effects import (
    ClockDrift,
    NonlinearReading,
    PowerLawDamping,
    QuinticStiffness,
    ReadingTone,
    RecorderLowPass,
    SensorHighPass,
    ZeroDrift,
)
from vibrojax.effects.free_form import TonalForce
from vibrojax.excitation import Harmonic, Unforced
from vibrojax.integrate import Landing
from vibrojax.model import Model
from vibrojax.suspension import Linear

FILE, HAMMER, FORCE = "cart1.csv", "hammer_displacement", "impact_force"
RECORDED = (HAMMER, "cart_displacement", "hammer_acceleration", FORCE)
PLAN = RecordPlan(
    file=FILE, kind="cart-excitation", gap=5e-4, true_gap=5e-4, samples=1401, excitation_frequency=7.5, base_phase=0.3, transient=0
)
CONCEALED = {
    "nothing": (Hidden(), None),
    "foreign_force": (
        Hidden(motion={"foreign_force": 0.15, "foreign_omega": 2.0 * np.pi * 11.3}, records={FILE: {"foreign_phase": 0.6}}),
        TonalForce(11.3, 0.15 * np.cos(0.6), 0.15 * np.sin(0.6)),
    ),
    "quintic_stiffness": (Hidden(motion={"quintic": 2e11}), QuinticStiffness(2e11)),
    "slow_power_law": (
        Hidden(motion={"power_loss": 0.4, "power_exponent": 0.5, "power_speed": 5e-4}),
        PowerLawDamping(0.4, 0.5),
    ),
    "fast_power_law": (
        Hidden(motion={"power_loss": 30.0, "power_exponent": 2.6, "power_speed": 5e-4}),
        PowerLawDamping(30.0, 2.6),
    ),
    "sensor_high_pass": (Hidden(faults=(HighPass(channel=FORCE, time_constant=0.08),)), SensorHighPass(0.08, FORCE)),
    "recorder_low_pass": (Hidden(faults=tuple(LowPass(channel=name, time_constant=1e-3) for name in RECORDED)), RecorderLowPass(1e-3)),
    "nonlinear_reading": (
        Hidden(faults=(Curve(channel=HAMMER, quadratic=5.0, cubic=-900.0),)),
        NonlinearReading(5.0, -900.0, HAMMER),
    ),
    "reading_tone": (
        Hidden(faults=(Tone(channel=HAMMER, amplitude=1e-4, frequency=17.0, decay=2.0, phases={FILE: -0.4}),)),
        ReadingTone(17.0, 2.0, 1e-4 * np.cos(0.4), -1e-4 * np.sin(0.4), HAMMER),
    ),
    "clock_drift": (Hidden(faults=(ClockRate(channel=HAMMER, ppm=-2000.0),)), ClockDrift(-2000.0, HAMMER)),
    "zero_drift": (
        Hidden(faults=(FaultOfZero(channel=HAMMER, size=-2e-4, time_constant=0.3),)),
        ZeroDrift(-2e-4 / 0.3, 1.0 / 0.3, HAMMER),
    ),
}


def simulated(hidden):
    """Record of the simulator, before noise and converter."""
    signals = motion(RIG, PLAN, hidden)
    for fault in hidden.faults:
        signals |= {fault.channel: fault.distort(FILE, signals["time"], signals[fault.channel])}
    return {name: values[: PLAN.samples] for name, values in signals.items()}


def shown(effect):
    """Record of the program."""
    model = Model(
        mass=RIG.m,
        suspension=Linear(damping_ratio=RIG.zeta, natural_frequency_hz=RIG.f_n),
        law=HuntCrossley(impact_stiffness=RIG.k_i, impact_exponent=RIG.n, impact_damping=RIG.lambda_i),
        effects=() if effect is None else (effect,),
    )
    base = Harmonic(base_amplitude=RIG.base_amplitude, base_phase=PLAN.base_phase, frequency_hz=PLAN.excitation_frequency)
    system = model.system(gap=PLAN.true_gap, base=base, applied=Unforced())
    ts = jnp.asarray(0.25e-3 * np.arange(PLAN.samples + 20))
    trajectory = Landing(contact_steps=300.0, flight_step=2e-4, most_steps=100_000)(system, ts, jnp.zeros(2))
    assert int(trajectory.result) == 0
    return {name: np.asarray(values)[: PLAN.samples] for name, values in channels(system, trajectory).items()}


@pytest.fixture(scope="module")
def plain():
    return simulated(Hidden())


@pytest.mark.parametrize("name", CONCEALED)
def test_both_show_the_same_record(name, plain):
    hidden, effect = CONCEALED[name]
    expected, found = simulated(hidden), shown(effect)
    assert np.count_nonzero(np.diff((plain[FORCE] > 0).astype(int)) == 1) >= 2
    changed = 0.0
    for channel in RECORDED:
        size = np.abs(expected[channel]).max()
        np.testing.assert_allclose(found[channel], expected[channel], atol=1e-3 * size, rtol=0, err_msg=channel)
        changed = max(changed, float(np.abs(expected[channel] - plain[channel]).max()) / size)
    assert (changed > 0.01) == (name != "nothing")
