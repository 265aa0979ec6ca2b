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
    named = [effect["name"] for effect in document["effects"]]
    return found | {
        "verdict": document["verdict"],
        "named": named,
        "parameters": [effect["parameters"] for effect in document["effects"]],
        "right": named == [job.effect] if job.effect else document["verdict"] in ("adequate", "restless"),
        "first": named[:1] == [job.effect],
        "warnings": document["warnings"],
        "seconds": time.perf_counter() - before,
    }
