"""A diagnosis in a file: other programs read its series and profiles, this one draws its page again from it."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import xarray as xr

from identification.diagnosis.diagnosis import Asserted, Diagnosis, Location, LoopKink, Number, Profile, Side
from identification.result.between_records import Disagreement
from identification.result.json_file import plain
from identification.result.netcdf_file import DIAGNOSIS, Series, dataset, floats, variable, write_netcdf
from identification.result.plain_dataclass import from_plain, to_plain
from identification.result.stored_records import restore_experiment, restore_records, store_experiment, store_records
from vibrojax.model import Model
from vibrojax.model_file import model_document, model_from_document

_BEFORE, _AFTER = "nominal_record", "augmented_record"
_PLAIN = (
    "verdict",
    "sentences",
    "free_form",
    "ambiguous_with",
    "considered",
    "unrest",
    "next_experiment",
    "warnings",
    "seconds",
    "ring_downs",
)
_OF_KINK = (
    ("record", "1", "which of the records with contacts, from 0"),
    ("contact", "1", "number of the contact, no two alike"),
    ("indentation", "m", "indentation in contact, as recorded"),
    ("force", "N", "force in contact, as recorded"),
    ("without_kink", "N", "force of the contact law without a kink"),
    ("with_kink", "N", "force of the contact law with a kink"),
)
_OF_SIDE = ("parameters", "chi2_reduced", "held_out_nrmse", "disagreements")


@dataclasses.dataclass(frozen=True, kw_only=True)
class StoredDiagnosis:
    """What the page of a diagnosis is drawn from: the diagnosis, and its provenance as in `diagnosis.json`."""

    diagnosis: Diagnosis
    provenance: Mapping[str, Any]


def write_diagnosis(stored: StoredDiagnosis, path: Path) -> None:
    """Write a diagnosis.

    Args:
        stored: the diagnosis and its provenance.
        path: of the file; replaced if it exists.
    """
    write_netcdf(diagnosis_dataset(stored), path)


def diagnosis_dataset(stored: StoredDiagnosis) -> xr.Dataset:
    """Every record beside both models, over its time, SI, and the profiles of the misfit; all else as JSON in one attribute."""
    found = stored.diagnosis
    variables, nominal = _side(found.nominal, _BEFORE)
    of_location, location = _location(found.location)
    variables, augmented = variables | of_location, None
    if found.augmented is not found.nominal:
        of_augmented, augmented = _side(found.augmented, _AFTER)
        variables |= of_augmented
    document = {
        "experiment": store_experiment(found.experiment),
        **{name: to_plain(getattr(found, name)) for name in _PLAIN},
        "effects": [to_plain(one, without=("effect",)) | {"name": one.effect.name} for one in found.effects],
        "location": location,
        "nominal": nominal,
        "augmented": augmented,
        "provenance": plain(stored.provenance),
    }
    title = f"{found.experiment.name}: what the impact model leaves out"
    return dataset(kind=DIAGNOSIS, title=title, variables=variables, document=document)


def stored_diagnosis(document: dict[str, Any], series: Series) -> StoredDiagnosis:
    """Put everything together again."""
    nominal = _restored_side(document["nominal"], series, _BEFORE)
    augmented = nominal if document["augmented"] is None else _restored_side(document["augmented"], series, _AFTER)
    hints = {field.name: field.type for field in dataclasses.fields(Diagnosis)}
    diagnosis = Diagnosis(
        experiment=restore_experiment(document["experiment"], (*nominal.records, *nominal.held_back)),
        effects=tuple(_restored_effect(each, augmented.model) for each in document["effects"]),
        location=_restored_location(document["location"], series),
        nominal=nominal,
        augmented=augmented,
        **{name: from_plain(hints[name], document[name]) for name in _PLAIN},
    )
    return StoredDiagnosis(diagnosis=diagnosis, provenance=document["provenance"])


def _side(side: Side, prefix: str) -> tuple[dict[str, xr.Variable], dict[str, Any]]:
    """One of the two models beside the records."""
    records = store_records((*side.records, *side.held_back), prefix)
    document = {name: to_plain(getattr(side, name)) for name in _OF_SIDE}
    document |= {"model": model_document(side.model), "records": records.documents, "fitted": len(side.records)}
    return records.variables, document


def _restored_side(document: dict[str, Any], series: Series, prefix: str) -> Side:
    records = restore_records(document["records"], series, prefix)
    return Side(
        model=model_from_document(document["model"], "a model in the result"),
        parameters=from_plain(tuple[Number, ...], document["parameters"]),
        chi2_reduced=from_plain(float, document["chi2_reduced"]),
        held_out_nrmse=from_plain(float, document["held_out_nrmse"]),
        records=records[: document["fitted"]],
        disagreements=from_plain(tuple[Disagreement, ...], document["disagreements"]),
        held_back=records[document["fitted"] :],
    )


def _restored_effect(document: dict[str, Any], model: Model) -> Asserted:
    """An effect of the augmented model, which has none twice."""
    effect = next(effect for effect in model.effects if effect.name == document["name"])
    return from_plain(Asserted, {name: value for name, value in document.items() if name != "name"}, effect=effect)


def _location(location: Location | None) -> tuple[dict[str, xr.Variable], dict[str, Any] | None]:
    """Profiles as `profile1_...`, maps as `map1`, ..."""
    if location is None:
        return {}, None
    variables: dict[str, xr.Variable] = {}
    for number, one in enumerate(location.profiles, start=1):
        size = "N" if one.quantity == "force" else "1"
        for name, values, unit in (("center", one.center, one.unit), ("mean", one.mean, size), ("stderr", one.stderr, size)):
            words = f"{name} of what is missing ({one.quantity}) against {one.coordinate}"
            variables[f"profile{number}_{name}"] = variable(f"profile{number}_bin", values, unit, words)
    for number, (file, values) in enumerate(location.maps.items(), start=1):
        words = "mean squared residual over the noise variance, by part of the record and of the excitation period"
        variables[f"map{number}"] = variable(("part_of_record", "part_of_period"), values, "1", words, record=file)
    kink = None
    if location.kink is not None:
        names = [name for name, _, _ in _OF_KINK]
        variables |= {f"kink_{name}": variable("kink_sample", getattr(location.kink, name), unit, words) for name, unit, words in _OF_KINK}
        kink = to_plain(location.kink, without=names)
    document = to_plain(location, without=("profiles", "maps", "kink"))
    profiles = [to_plain(one, without=("center", "mean", "stderr")) for one in location.profiles]
    return variables, document | {"profiles": profiles, "maps": list(location.maps), "kink": kink}


def _restored_location(document: dict[str, Any] | None, series: Series) -> Location | None:
    if document is None:
        return None
    profiles = tuple(
        from_plain(Profile, one, **{name: floats(series[f"profile{number}_{name}"]) for name in ("center", "mean", "stderr")})
        for number, one in enumerate(document["profiles"], start=1)
    )
    maps = {file: floats(series[f"map{number}"]) for number, file in enumerate(document["maps"], start=1)}
    rest = {name: value for name, value in document.items() if name not in ("profiles", "maps", "kink")}
    return from_plain(Location, rest, profiles=profiles, maps=maps, kink=_restored_kink(document.get("kink"), series))


def _restored_kink(document: dict[str, Any] | None, series: Series) -> LoopKink | None:
    if document is None:
        return None
    arrays = {name: floats(series[f"kink_{name}"]) for name, _, _ in _OF_KINK}
    return from_plain(LoopKink, document, **arrays | {name: arrays[name].astype(int) for name in ("record", "contact")})
