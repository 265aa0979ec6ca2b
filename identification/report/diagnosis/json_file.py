"""`diagnosis.json`: every number finite or null, and where the diagnosis comes from."""

import importlib.metadata
import json
import platform
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from identification.diagnosis.diagnosis import Diagnosis
from identification.result.json_file import VERSIONS_OF, plain


def diagnosis_provenance(diagnosis: Diagnosis) -> dict[str, Any]:
    """Where a diagnosis comes from: versions, sha256 of every file that was read, wall time by stage in s."""
    experiment, known = diagnosis.experiment, {d.metadata["Name"] for d in importlib.metadata.distributions()}
    hashes = {"experiment.toml": experiment.sha256} | {record.file: record.sha256 for record in experiment.records}
    versions = {"python": platform.python_version()} | {name: importlib.metadata.version(name) for name in VERSIONS_OF if name in known}
    return {"versions": versions, "sha256": hashes, "seconds": plain(diagnosis.seconds)}


def write_diagnosis_json(diagnosis: Diagnosis, path: Path, provenance: Mapping[str, Any]) -> None:
    """Write `diagnosis.json`; numbers that are not finite become null, for which JSON has no other word."""
    document = plain(diagnosis.document(dict(provenance)))
    path.write_text(json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8")
