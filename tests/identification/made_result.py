"""A fit result made by hand: two records of a hammer at a stop, integrated here, with noise of a known size."""

import dataclasses
from pathlib import Path

import numpy as np

from identification.experiment import Experiment, Record, Sensor, Suspension
from identification.result.evidence import Disagreement, Unrest
from identification.result.result import (
    NOT_IDENTIFIABLE,
    OK,
    FitResult,
    ParameterEstimate,
    Quantity,
    RecordFit,
    SensorError,
)
from identification.result.ring_down import RingDown, RingDowns
from vibrojax.channels import UNITS
from vibrojax.contact import HuntCrossley
from vibrojax.model import Model
from vibrojax.suspension import Linear

MASS, K_I, N, LAMBDA_I, ZETA, F_N = 0.5, 2e6, 1.5, 0.4, 0.01, 6.0
NOISE = {"hammer_displacement": 1e-5, "cart_displacement": 1e-5, "hammer_acceleration": 0.05, "impact_force": 0.15}
MODEL = Model(
    mass=MASS,
    suspension=Linear(damping_ratio=ZETA, natural_frequency_hz=F_N),
    law=HuntCrossley(impact_stiffness=K_I, impact_exponent=N, impact_damping=LAMBDA_I),
)


def _ring_down(slope: float) -> RingDown:
    """Of the drop test: damping that rises by `slope` of itself while the amplitude falls to a fifth."""
    amplitude = np.geomspace(3e-3, 6e-4, 8)
    damping = ZETA * (1.0 + slope * np.linspace(0.0, 1.0, 8))
    columns = {"amplitude": amplitude, "damping": damping, "damping_stderr": np.full(8, 5e-4), "frequency": np.full(8, F_N)}
    columns |= {"frequency_stderr": np.full(8, 2e-3)}
    return RingDown(file="drop.csv", **{name: tuple(values.tolist()) for name, values in columns.items()})


RING_DOWNS = RingDowns(
    measured=(_ring_down(0.31),),
    models={"nominal": (_ring_down(0.0),)},
    left_out={"cart1.csv": "driven <throughout>, so that nothing decays"},
)
OF_BOTH = dataclasses.replace(RING_DOWNS, models={"nominal": (_ring_down(0.0),), "augmented": (_ring_down(0.3),)})
"""Of a diagnosis."""


def made_result(
    *,
    misfit: float = 0.0,
    channels: tuple[str, ...] = tuple(NOISE),
    samples: int = 1500,
    notices: tuple[str, ...] = (),
    unrest: Unrest | None = None,
) -> FitResult:
    """A fit that explains its records to the noise, or with the force wrong by `misfit` of its value in the second record."""
    records = (
        _record("drop.csv", "drop-test", 0.0, channels, samples, 0.0, 1, notices),
        _record("cart1.csv", "cart-excitation", 5e-4, channels, samples, misfit, 2, ()),
    )
    counted = np.concatenate([((r.measured[c] - r.predicted[c]) / r.noise[c]) ** 2 for r in records for c in r.chi2_reduced])
    names = [p.name for p in MODEL.parameters]
    matrix = np.eye(len(names)) + 0.999 * (np.eye(len(names), k=1) * [0, 1, 0, 0, 0] + np.eye(len(names), k=-1) * [1, 0, 0, 0, 0])
    return FitResult(
        experiment=_experiment(records),
        model=MODEL,
        parameters=tuple(_estimate(p) for p in MODEL.parameters),
        derived=(Quantity(name="k", symbol="k", unit="N/m", value=710.6, stderr=0.5),),
        correlation=matrix,
        correlated=tuple(names),
        chi2_reduced=float(counted.mean()),
        degrees=len(counted) - 20,
        records=records,
        converged=True,
        discretisation=0.012,
        warnings=(),
        unrest=unrest,
        reading_error={
            name: SensorError(
                rms=1.02 * NOISE[name],
                unit=UNITS[name],
                order=order,
                over_noise=1.02,
                variance=1.01,
                correlation=-0.01,
                samples=4000,
            )
            for order, name in enumerate(channels)
        },
        force_share=0.0,
        seed=7,
        seconds={"fit": 1.5},
        between_records=(
            Disagreement(
                name="k_i",
                chi2=0.5,
                degrees=1,
                chance=0.48,
                records={"drop.csv": (2.0e6, 2e4), "cart1.csv": (2.02e6, 2e4)},
            ),
        ),
        ring_downs=RING_DOWNS,
    )


def with_unknown(result: FitResult, name: str) -> FitResult:
    """The same, but one parameter is not determined by the records."""
    changed = tuple(
        dataclasses.replace(p, stderr=None, ci95=None, interval="", status=NOT_IDENTIFIABLE, reason="nothing <moves> it")
        if p.spec.name == name
        else p
        for p in result.parameters
    )
    return dataclasses.replace(result, parameters=changed)


def _estimate(parameter) -> ParameterEstimate:
    value = float(MODEL.values()[parameter.name])
    ends = (value * 0.998, value * 1.002)
    return ParameterEstimate(spec=parameter, value=value, stderr=value * 1e-3, ci95=ends, interval="normal", initial=value * 0.9, status=OK)


def _experiment(fits: tuple[RecordFit, ...]) -> Experiment:
    records = tuple(
        Record(
            file=fit.file,
            kind=fit.kind,
            gap=fit.gap,
            time=fit.time,
            excitation_frequency=8.0 if fit.kind == "cart-excitation" else None,
            channels=fit.measured,
            noise=fit.noise,
            sha256="ab" * 32,
            notices=fit.notices,
        )
        for fit in fits
    )
    sensors = {name: Sensor(unit="m") for name in fits[0].measured}
    return Experiment(
        name="made <by> hand",
        folder=Path("."),
        mass=MASS,
        suspension=Suspension(kind="linear"),
        records=records,
        sha256="cd" * 32,
        sensors=sensors,
    )


def _motion(gap: float, amplitude: float, samples: int) -> dict[str, np.ndarray]:
    """Semi-implicit Euler in 20 steps a sample: rough, but drawn and measured from the same numbers."""
    dt, inner, omega, drive = 5e-4, 20, 2 * np.pi * F_N, 2 * np.pi * 8.0
    u, v, rows = (-3e-3 if amplitude == 0 else 0.0), 0.0, []
    for sample in range(samples):
        for step in range(inner):
            t = (sample + step / inner) * dt
            depth = max(u - gap, 0.0)
            force = K_I * depth**N * max(1 + LAMBDA_I * v, 0.0)
            y2 = -amplitude * drive**2 * np.sin(drive * t)
            a = -2 * ZETA * omega * v - omega**2 * u - force / MASS - y2
            if step == 0:
                rows.append((t, u, v, u + amplitude * np.sin(drive * t), amplitude * np.sin(drive * t), a + y2, force))
            v += a * dt / inner
            u += v * dt / inner
    names = ("time", "u", "v", "hammer_displacement", "cart_displacement", "hammer_acceleration", "impact_force")
    return dict(zip(names, np.array(rows).T, strict=True))


def _record(file: str, kind: str, gap: float, channels, samples: int, misfit: float, seed: int, notices) -> RecordFit:
    motion = _motion(gap, 1.5e-3 if kind == "cart-excitation" else 0.0, samples)
    draws = np.random.default_rng(seed)
    predicted = {name: motion[name] for name in NOISE} | {"relative_displacement": motion["u"]}
    measured = {name: motion[name] + NOISE[name] * draws.standard_normal(samples) for name in channels}
    if "impact_force" in measured:
        measured["impact_force"] = measured["impact_force"] + misfit * motion["impact_force"]
    noise = {name: NOISE[name] for name in channels}
    rms = {name: float(np.sqrt(np.mean((measured[name] - predicted[name]) ** 2))) for name in channels}
    return RecordFit(
        file=file,
        kind=kind,
        gap=gap,
        nuisances=(Quantity(name="gap_error", unit="m", value=1e-6, stderr=2e-7),),
        time=motion["time"],
        measured=measured,
        predicted=predicted,
        noise=noise,
        nrmse={name: rms[name] / float(np.std(measured[name])) for name in channels},
        chi2_reduced={name: (rms[name] / noise[name]) ** 2 for name in channels},
        relative_displacement=motion["u"],
        relative_velocity=motion["v"],
        in_contact=motion["u"] > gap,
        window=np.arange(samples) // 500,
        notices=notices,
    )
