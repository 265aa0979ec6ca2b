"""One simulated rig without a stop, diagnosed, beside its truth."""

import tempfile
import time
from pathlib import Path

from benchmarks.concealed.trial import diagnosed
from benchmarks.contact_free.rigs import Job, write_rig
from benchmarks.machine import revision


def trial(job: Job) -> dict:
    """Simulate and diagnose one rig; a failure is a result too, with its message."""
    found = {"key": job.key, "kind": job.kind, "effect": job.effect, "revision": revision()}
    with tempfile.TemporaryDirectory() as folder:
        found |= {"concealed": write_rig(Path(folder), job)}
        before = time.perf_counter()
        try:
            document = diagnosed(Path(folder)).document()
        except Exception as error:  # noqa: BLE001 - whatever goes wrong is counted
            return found | {"failure": f"{type(error).__name__}: {error}"}
    named, there = [effect["name"] for effect in document["effects"]], present(job, found["concealed"])
    wrong = [name for name in named if name not in there]
    twins = [*named, *document["ambiguous_with"]]
    return found | {
        "verdict": document["verdict"],
        "named": named,
        "parameters": [effect["parameters"] for effect in document["effects"]],
        "wrong": wrong,
        "right": not wrong and (job.effect in named if job.effect else named != [] or document["verdict"] in ("adequate", "restless")),
        "or_twin": job.effect in twins if job.effect else not wrong,
        "warnings": document["warnings"],
        "seconds": time.perf_counter() - before,
    }


def present(job: Job, concealed: dict) -> set[str]:
    """Names of all that acts: the concealed effect, and what the sensor of the rig adds."""
    errors = concealed.get("errors", {})
    curved, tone = errors.get("square") or errors.get("cube"), errors.get("tone")
    return (
        ({job.effect} if job.effect else set())
        | ({"nonlinear_reading"} if curved else set())
        | ({"reading_tone", "mains_hum"} if tone else set())
    )
