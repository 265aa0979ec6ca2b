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
    return found | judged(job, found["concealed"], document) | {"seconds": time.perf_counter() - before}


def judged(job: Job, concealed: dict, document: dict) -> dict:
    """What a diagnosis says beside what acts: right where it names the concealed effect, or none, and nothing that does not act."""
    errors = concealed.get("errors", {})
    curved, tone = errors.get("square") or errors.get("cube"), errors.get("tone")
    there = {job.effect} | ({"nonlinear_reading"} if curved else set()) | ({"reading_tone"} if tone else set())
    named = [effect["name"] for effect in document["effects"]]
    wrong = [name for name in named if name not in there]
    complete = not job.effect and (named != [] or document["verdict"] in ("adequate", "restless"))
    return {
        "verdict": document["verdict"],
        "named": named,
        "parameters": [effect["parameters"] for effect in document["effects"]],
        "wrong": wrong,
        "right": not wrong and (job.effect in named or complete),
        "or_twin": job.effect in (*named, *document["ambiguous_with"]) or (not wrong and complete),
        "warnings": document["warnings"],
    }
