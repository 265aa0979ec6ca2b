"""Diagnoses made by hand from any fit: its prediction is the augmented model's, the nominal one's is spoilt."""

import dataclasses

import numpy as np

from identification.diagnosis.diagnosis import (
    ADEQUATE,
    MISSING,
    NOT_FINISHED,
    RESTLESS,
    UNDECIDED,
    UNLISTED,
    Asserted,
    Considered,
    Diagnosis,
    Location,
    Profile,
    Side,
)
from identification.result.evidence import Disagreement, Unrest
from identification.result.result import FitResult, Quantity, RecordFit
from tests.identification.made_result import OF_BOTH
from vibrojax.effects import CoulombFriction, CubicStiffness

FRICTION = 0.03
"""N"""
UNREST = Unrest(force_rms=(0.021, 0.0015), memory=(0.0082, 0.0009), share=0.0123, reference="the spring's force", gain=412.0)


def made_diagnosis(result: FitResult, verdict: str) -> Diagnosis:
    """A diagnosis with the given verdict."""
    adequate = verdict in (ADEQUATE, RESTLESS)
    effect = CoulombFriction(friction_force=FRICTION) if verdict == MISSING else CubicStiffness(cubic_stiffness=4e4)
    sizes = {p: float(getattr(effect, p.field)) for p in effect.parameters}
    numbers = tuple(Quantity(name=p.name, symbol=p.symbol, unit=p.unit, value=size, stderr=1e-3 * size) for p, size in sizes.items())
    own = () if adequate else tuple(dataclasses.replace(n, name=f"{effect.name}.{n.name}") for n in numbers)
    model = result.model if adequate else dataclasses.replace(result.model, effects=(effect,))
    after = Side(
        model=model,
        parameters=_shared(result, 1.0) + own,
        chi2_reduced=result.chi2_reduced,
        held_out_nrmse=0.0123,
        records=result.records,
    )
    worse = tuple(_without_friction(record, float(result.model.mass)) for record in result.records)
    stiffness = float(result.model.values()["k_i"])
    before = Side(
        model=result.model,
        parameters=_shared(result, 1.004),
        chi2_reduced=14.2,
        held_out_nrmse=0.187,
        records=worse,
        disagreements=(
            Disagreement(
                name="k_i",
                chi2=87.3,
                degrees=1,
                chance=9.4e-21,
                records={"drop.csv": (stiffness, 1e-3 * stiffness), "cart1.csv": (1.02 * stiffness, 2e-3 * stiffness)},
            ),
        ),
    )
    return Diagnosis(
        experiment=result.experiment,
        verdict=verdict,
        sentences=_SENTENCES[verdict],
        effects=(Asserted(effect=effect, probability=0.9997, parameters=numbers),) if verdict == MISSING else (),
        free_form="force = -a_1 u^3 + a_2 |u'| u'" if verdict == UNLISTED else "",
        ambiguous_with=("quadratic_drag",) if verdict == MISSING else (),
        location=None if adequate else _location(worse),
        considered=_considered(adequate),
        nominal=after if adequate else before,
        augmented=after,
        unrest=UNREST if verdict == RESTLESS else None,
        next_experiment="" if adequate else "A free decay from 2 mm without contact would separate dry friction from drag by 40 σ.",
        reading_error=result.reading_error,
        warnings=_WARNINGS.get(verdict, ()),
        seconds={"nominal": 12.0, "search": 31.0},
        ring_downs=result.ring_downs if adequate else OF_BOTH,
    )


_WARNINGS = {
    MISSING: ("the search stopped after as many effects as it adds to <one> model",),
    UNDECIDED: (f"{NOT_FINISHED}: the budget of <5> minutes ended the search",),
}
_SENTENCES = {
    ADEQUATE: (
        "The nominal model explains the records to the noise.",
        "The strongest candidate, drag, would arise by chance in 1 of 4 such records.",
    ),
    RESTLESS: (
        "The misfit exceeds the sensors' noise, and no function of motion, drive, time or record explains it:"
        " a random force acts on the hammer.",
        UNREST.sentence(),
    ),
    MISSING: (
        "The nominal model leaves out dry friction in the suspension, 0.0300 ± 0.0001 N.",
        "With it the misfit falls from 3.8 to 1.0 times the noise, and the error on records held back from 0.19 to 0.012.",
    ),
    UNDECIDED: ("The budget ended the search: there is no verdict.", "The best of them, drag, is not asserted: it is no better."),
    UNLISTED: ("Something real is missing and no listed effect explains it.", "The best listed one, drag, leaves 2.9 times the noise."),
}


def _shared(result: FitResult, factor: float) -> tuple[Quantity, ...]:
    return tuple(
        Quantity(name=p.spec.name, symbol=p.spec.symbol, unit=p.spec.unit, value=factor * p.value, stderr=p.stderr)
        for p in result.parameters
    )


def _without_friction(record: RecordFit, mass: float) -> RecordFit:
    """The prediction, wrong by a drift of the displacement within each window and a step of the acceleration at each reversal."""
    push = FRICTION * np.sign(record.relative_velocity) / mass
    since = record.time - record.time[np.searchsorted(record.window, record.window)]
    wrong = {
        "hammer_displacement": 8e-3 * push * np.minimum(since, 0.05),
        "hammer_acceleration": 8.0 * push * ~record.in_contact,
        "impact_force": 0.02 * record.predicted["impact_force"],
    }
    predicted = {name: values + wrong.get(name, 0.0) for name, values in record.predicted.items()}
    squares = {c: ((record.measured[c] - predicted[c]) / record.noise[c]) ** 2 for c in record.chi2_reduced}
    return dataclasses.replace(record, predicted=predicted, chi2_reduced={c: float(np.nanmean(s)) for c, s in squares.items()})


def _location(records: tuple[RecordFit, ...]) -> Location:
    excess = {r.file: sum(r.chi2_reduced.values()) for r in records}
    return Location(
        channel="hammer_acceleration",
        channels={"hammer_acceleration": 0.71, "hammer_displacement": 0.24, "impact_force": 0.05},
        records={file: value / sum(excess.values()) for file, value in excess.items()},
        phase="free flight",
        coordinate="velocity",
        interval=(-0.01, 0.01),
        time=None,
        record=None,
        sentence="A force of constant size acts against the velocity in free flight, in all records; it changes sign with the velocity.",
        profiles=tuple(_profile(*one) for one in _PROFILES),
        maps={r.file: _map(r) for r in records},
    )


_PROFILES = (
    ("velocity", "m/s", "force", 0.12, 1.0),
    ("displacement", "m", "force", 2e-3, 0.21),
    ("indentation", "m", "force", 8e-5, 0.18),
    ("time", "s", "stop", 0.7, 0.09),
    ("reading", "", "impact_force", 40.0, 0.02),
    ("reading", "", "cart_displacement", 1e-3, 0.0),
)


def _profile(coordinate: str, unit: str, quantity: str, reach: float, explained: float) -> Profile:
    draws, size = np.random.default_rng(3), {"force": FRICTION, "stop": 2e-5}.get(quantity, 4.0)
    center = np.linspace(0.0 if coordinate == "time" else -reach, reach, 16)
    mean = -size * (np.tanh(center / (0.02 * reach)) if coordinate == "velocity" else explained * np.sin(7 * center / reach))
    stderr = size * (0.02 + 0.06 * (np.abs(center) / reach) ** 2)
    return Profile(
        coordinate=coordinate,
        unit=unit,
        quantity=quantity,
        center=center,
        mean=mean + stderr * draws.standard_normal(16),
        stderr=stderr,
        explained=explained,
    )


def _map(record: RecordFit) -> np.ndarray:
    """Mean square residual of all channels in 24 parts of the record and of a period of 1/8 s."""
    total, count = np.zeros((24, 24)), np.zeros((24, 24))
    row = np.minimum((24 * np.arange(len(record.time))) // len(record.time), 23)
    column = np.minimum((24 * (8.0 * record.time % 1.0)).astype(int), 23)
    for channel in record.chi2_reduced:
        r = ((record.measured[channel] - record.predicted[channel]) / record.noise[channel]) ** 2
        np.add.at(total, (row, column), np.where(np.isfinite(r), r, 0.0))
        np.add.at(count, (row, column), np.isfinite(r))
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _considered(adequate: bool) -> tuple[Considered, ...]:
    rows = (
        ("coulomb_friction", "", 48211.0, 0.0, 48093.2, 0.0, ()),
        ("quadratic_drag", "", 22100.0, 0.0, 21050.0, 27043.0, ()),
        ("hysteresis", "memory of 0.1 mm", 40111.0, 0.0, 39000.0, 9093.0, ()),
        ("mains_hum", "hammer acceleration at 50.0 Hz", 181.0, 3.1e-38, None, None, ()),
        ("gap_step", "cart1.csv at 1.2 s", 61.0, 4.2e-11, 12.0, 48086.0, ()),
        ("force_lag", "", 9.1, 0.0026, None, None, ("coulomb_friction",)),
        ("cubic_stiffness", "", 4.4, 0.031, None, None, ("coulomb_friction",)),
        ("time_offset", "impact force", 0.8, 1.0, None, None, ("coulomb_friction",)),
    )
    found = tuple(Considered(name=n, detail=d, gain=g, chance=p, drop=x, bic=b, held_out=None, beside=s) for n, d, g, p, x, b, s in rows)
    if not adequate:
        return found
    return tuple(
        dataclasses.replace(one, gain=9.0 - k, chance=min(1.0, 0.24 * 1.6**k), drop=None, bic=None, beside=())
        for k, one in enumerate(found)
    )
