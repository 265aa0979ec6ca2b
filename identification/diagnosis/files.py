"""Files of a diagnosis: `diagnosis.json`, every number finite or null, and `result.nc`, from which its page is drawn again."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from identification.diagnosis.diagnosis import Diagnosis
from identification.result.files import origin, residuals
from identification.result.store import Variables, dataset, from_plain, to_plain, with_samples


@dataclasses.dataclass(frozen=True, kw_only=True)
class StoredDiagnosis:
    """What the page of a diagnosis is drawn from: the diagnosis, and its provenance as in `diagnosis.json`."""

    diagnosis: Diagnosis
    provenance: Mapping[str, Any]


def diagnosis_dataset(stored: StoredDiagnosis) -> xr.Dataset:
    """Every record beside both models, over its time, SI, and the profiles of the misfit; everything else in one attribute."""
    found, variables = stored.diagnosis, Variables()
    document = to_plain(stored, variables)
    sides = {"nominal": found.nominal} | ({"augmented": found.augmented} if found.is_augmented else {})
    if not found.is_augmented:
        del document["diagnosis"]["augmented"]
        variables = {name: one for name, one in variables.items() if not name.startswith("augmented_")}
    for name, side in sides.items():
        variables |= residuals(side.records, f"{name}_record") | residuals(side.held_back, f"{name}_held_back")
    return dataset("diagnosis", document, variables, f"{found.experiment.name}: what the impact model leaves out")


def stored_diagnosis(document: dict[str, Any], variables: Mapping[str, np.ndarray]) -> StoredDiagnosis:
    """Restore a diagnosis from document and variables, for `store.read_stored`."""
    content = document["diagnosis"]
    stored = from_plain(StoredDiagnosis, document | {"diagnosis": {"augmented": content["nominal"]} | content}, variables)
    found, nominal = stored.diagnosis, stored.diagnosis.nominal
    samples = {each.file: (each.time, each.measured) for each in (*nominal.records, *nominal.held_back)}
    augmented = found.augmented if "augmented" in content else nominal
    found = dataclasses.replace(found, experiment=with_samples(found.experiment, samples), augmented=augmented)
    return dataclasses.replace(stored, diagnosis=found)


def diagnosis_provenance(diagnosis: Diagnosis) -> dict[str, Any]:
    """Where a diagnosis comes from: versions, sha256 of every file that was read, wall time by stage in s."""
    return origin(diagnosis.experiment, diagnosis.seconds)
