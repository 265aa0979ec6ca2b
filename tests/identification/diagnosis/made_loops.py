"""The example as if its sensors had shown another contact law along the same motion."""

import dataclasses

import jax.numpy as jnp
import numpy as np

from tests.identification.diagnosis import made_fit
from vibrojax.contact import HuntCrossley

FRONT = HuntCrossley(2e6, 1.5, 0.4)


def with_loops(motion, law_of, *, too_small: float = 0.0, load_cell: bool = True):
    """Loops of the law that `law_of` makes of the deepest indentation, and noise; all gaps set so much too small."""
    experiment = motion.prepared.experiment
    pairs = list(zip(experiment.records, motion.prepared.motions, strict=True))
    law = law_of(max(float(m.u.max()) - r.gap for r, m in pairs if m.touching.any()))
    forces = [_force(law, m.u - r.gap, m.v) for r, m in pairs]
    draws, noise = np.random.default_rng(3), 0.01 * max(float(force.max()) for force in forces)
    shown = []
    for (record, seen), force in zip(pairs, forces, strict=True):
        u, v, base = (jnp.asarray(values) for values in (seen.u, seen.v, seen.base_acceleration))
        free = experiment.mass * np.asarray(motion.prepared.model.suspension.acceleration(u, v, -base))
        noisy = force + noise * draws.standard_normal(len(force))
        by_inertia = {"force": None, "inertia": noisy - free - experiment.mass * seen.base_acceleration}
        touching = (seen.u > record.gap) & seen.touching
        shown.append(dataclasses.replace(seen, touching=touching, **({"force": noisy} if load_cell else by_inertia)))
    records = tuple(dataclasses.replace(record, gap=record.gap - too_small) for record in experiment.records)
    prepared = dataclasses.replace(motion.prepared, motions=tuple(shown), experiment=dataclasses.replace(experiment, records=records))
    found = made_fit.scored(motion.fitted(motion.shown()), motion.courses, *map(made_fit.candidate, ("deep_stop", "coulomb_friction")))
    return dataclasses.replace(found, fitted=made_fit.with_prepared(found.fitted, prepared))


def _force(law, indentation, rate) -> np.ndarray:
    force = law.force(jnp.maximum(indentation, 0.0), jnp.asarray(rate), jnp.ones_like(rate))
    return np.where(indentation > 0, np.asarray(force), 0.0)
