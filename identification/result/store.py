"""Data classes in one NetCDF file, `result.nc`, and back, with every number unchanged.

An array that a data class declares with `series` becomes a variable with dimensions, unit and description, which other programs read;
everything else becomes one JSON attribute of the file. Nothing is pickled, and a file that is not as it was written is refused.
"""

import collections.abc
import dataclasses
import hashlib
import io
import json
import math
import types
import typing
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from identification.experiment import Experiment, Record
from vibrojax.effects import AbstractEffect
from vibrojax.errors import InputError
from vibrojax.model import Model
from vibrojax.model_file import effect_document, effect_from_document, model_document, model_from_document

FILE_NAME = "result.nc"
_SCHEMA = 8
_CHECKSUM = "sha256"
"""Attribute: of the file's bytes, with zeros in its own place."""
_NONE_YET = "0" * 64
_DTYPES = {"float64": np.float64, "int64": np.int64, "bool": np.bool_}
_STORED = {"float64": np.float64, "int64": np.int32, "bool": np.int8}
"""NetCDF 3 has neither booleans nor long integers."""

Variables = dict[str, xr.Variable]


def series(*dimensions: str, unit: str | Callable[[Any, str], str] = "1", words: str, name: str = "") -> Any:
    """Declare a field of a data class that holds an array, or arrays by name, as variables of a file.

    `dimensions` are those of each array, `unit` that of its values, or a function of the data class and of the name of the array; in the
    description `words`, `{self}` stands for the data class and `{key}` for the name of the array; `name` is used in place of the field's.
    """
    return dataclasses.field(metadata={"dimensions": dimensions, "unit": unit, "words": words, "name": name})


def to_plain(value: Any, variables: Variables, path: str = "") -> Any:
    """Convert a value to plain JSON data and variables: a number that is not finite becomes a string, an array the name of its variable.

    A value is a data class, or the content of its fields: data classes, mappings, tuples, sets, paths, strings, numbers, None, models. Its
    declared arrays are added to `variables`, whose names begin with `path`; the samples of an experiment's records are left out.

    Raises:
        TypeError: a field holds something else, such as an array that is not declared.

    Example:
        >>> to_plain({"a": (1.5, math.inf)}, {})
        {'a': [1.5, 'inf']}
    """
    if isinstance(value, Model):
        return model_document(value)
    if isinstance(value, AbstractEffect):
        return effect_document(value)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = [field for field in dataclasses.fields(value) if not (isinstance(value, Record) and field.name in ("time", "channels"))]
        return {field.name: _field(value, field, variables, path) for field in fields}
    if isinstance(value, Mapping):
        return {str(key): to_plain(item, variables, _joined(path, str(key))) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [to_plain(item, variables, f"{path.removesuffix('s')}{number}") for number, item in enumerate(value, start=1)]
    if isinstance(value, frozenset | set):
        return sorted(value)
    if isinstance(value, np.generic):
        return to_plain(value.item(), variables)
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else str(float(value))
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"{type(value).__name__} has no plain form")


def from_plain(kind: Any, plain: Any, variables: Mapping[str, np.ndarray]) -> Any:
    """Rebuild a value of a declared type, a data class or the annotation of a field, from its plain form and the file's variables.

    Records of an experiment have no samples then, see `with_samples`.

    Raises:
        TypeError, KeyError, ValueError, InputError: the plain value is not of that type.

    Example:
        >>> from_plain(tuple[float, ...], [1, "inf"], {})
        (1.0, inf)
    """
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if kind is Any:
        return plain
    if origin in (typing.Union, types.UnionType):
        return None if plain is None else from_plain(next(each for each in arguments if each is not type(None)), plain, variables)
    if kind is Model:
        return model_from_document(plain, "the model in the result")
    if kind is AbstractEffect:
        return effect_from_document(plain, "an effect in the result")
    if kind is np.ndarray:
        return variables[plain["variable"]].astype(_DTYPES[plain["dtype"]])
    if isinstance(kind, type) and dataclasses.is_dataclass(kind):
        hints = typing.get_type_hints(kind)
        samples = {"time": np.zeros(0)} if kind is Record else {}
        return kind(**{name: from_plain(hints[name], item, variables) for name, item in plain.items()}, **samples)
    if origin in (dict, collections.abc.Mapping):
        return {str(key): from_plain(arguments[1], item, variables) for key, item in plain.items()}
    if origin is tuple:
        kinds = [arguments[0]] * len(plain) if arguments[-1] is Ellipsis else arguments
        return tuple(from_plain(each, item, variables) for each, item in zip(kinds, plain, strict=True))
    if origin is frozenset:
        return frozenset(plain)
    if kind is float:
        return float(plain) if not isinstance(plain, str) or plain in ("nan", "inf", "-inf") else _refused(kind, plain)
    if kind is Path:
        return Path(plain)
    return plain if isinstance(kind, type) and isinstance(plain, kind) else _refused(kind, plain)


def with_samples(experiment: Experiment, records: Mapping[str, tuple[np.ndarray, dict[str, np.ndarray]]]) -> Experiment:
    """An experiment of a file with the samples of its records: time and channels, by the record's file."""
    found = [(each, *records[each.file]) for each in experiment.records]  # a record that is not there is a KeyError
    return dataclasses.replace(experiment, records=tuple(dataclasses.replace(each, time=t, channels=values) for each, t, values in found))


def dataset(kind: str, document: dict[str, Any], variables: Variables, title: str) -> xr.Dataset:
    """Variables and one JSON document, both from `to_plain`, as a dataset; its attribute has the name of the kind, "fit" or "diagnosis"."""
    return xr.Dataset(variables, attrs={"title": title, kind: json.dumps({"schema": _SCHEMA} | document, allow_nan=False)})


def write_dataset(found: xr.Dataset, path: Path) -> None:
    """Write a file; an existing one is replaced."""
    stating = xr.Dataset(found.variables, attrs={_CHECKSUM: _NONE_YET} | found.attrs)  # before any other text with so many zeros
    content = bytes(stating.to_netcdf(engine="scipy"))
    path.write_bytes(content.replace(_NONE_YET.encode(), hashlib.sha256(content).hexdigest().encode(), 1))


def read_stored(path: Path, kinds: Mapping[str, Callable[[dict[str, Any], dict[str, np.ndarray]], Any]]) -> Any:
    """Read a file that `write_dataset` wrote, with the function of its kind that restores the object from document and variables.

    Raises:
        InputError: the file does not exist, is damaged, has another version, or holds none of these kinds.
    """
    again = f"run {' or '.join({'fit': 'vibrojax fit', 'diagnosis': 'vibrojax diagnose'}[kind] for kind in kinds)} again"
    if not path.is_file():
        raise InputError(f"{path} does not exist: expected the {FILE_NAME} of a {' or a '.join(kinds)}; {again}")
    try:
        content = path.read_bytes()
        with xr.open_dataset(io.BytesIO(content), engine="scipy", decode_cf=False) as data:
            kind = next((kind for kind in kinds if kind in data.attrs), None)
            if kind is None:
                raise InputError(f"{path} is no result of a {' or a '.join(kinds)}: {again}")
            document, stated = json.loads(data.attrs[kind]), str(data.attrs.get(_CHECKSUM, ""))
            if (schema := document.pop("schema")) != _SCHEMA:
                raise InputError(f"{path} is of schema {schema}: expected {_SCHEMA}; {again}")
            if hashlib.sha256(content.replace(stated.encode(), _NONE_YET.encode(), 1)).hexdigest() != stated:
                raise InputError(f"{path} is damaged: its content is not that of its checksum; {again}")
            values = {str(name): np.array(one.values) for name, one in data.variables.items()}
        try:
            return kinds[kind](document, values)
        except InputError as error:  # says what of the content is wrong
            raise InputError(f"{path}: {error}") from error
    except InputError:
        raise
    except Exception as error:  # whatever a damaged file raises
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise InputError(f"{path} cannot be read as a result ({reason}): {again}") from error


def _field(owner: Any, field: dataclasses.Field[Any], variables: Variables, path: str) -> Any:
    """One field of a data class: its array or arrays as variables where it declares them, else its plain form."""
    value, declared = getattr(owner, field.name), field.metadata
    unnamed = field.name in ("result", "diagnosis", "location")  # the names of variables leave these out
    name = _joined(path, "" if unnamed else declared.get("name") or field.name)
    if "dimensions" not in declared:
        return to_plain(value, variables, name)
    if not isinstance(value, Mapping):
        return _variable(owner, field, value, variables, name, path)
    counted = {key: f"{name}_{key}" if key.isidentifier() else f"{name.removesuffix('s')}{n}" for n, key in enumerate(value, start=1)}
    return {key: _variable(owner, field, each, variables, counted[key], path, key) for key, each in value.items()}


def _variable(
    owner: Any, field: dataclasses.Field[Any], values: np.ndarray, variables: Variables, name: str, path: str, key: str = ""
) -> dict[str, str]:
    """Add one array to the variables; returns what takes its place in the document."""
    declared, dtype = field.metadata, {"f": "float64", "i": "int64", "b": "bool"}[values.dtype.kind]
    unit = declared["unit"] if isinstance(declared["unit"], str) else declared["unit"](owner, key)
    record = key if key and not key.isidentifier() else getattr(owner, "file", "")
    attributes = {"units": unit, "long_name": declared["words"].format(self=owner, key=key)} | ({"record": record} if record else {})
    dimensions = [_joined(path, each) for each in declared["dimensions"]]
    variables[name] = xr.Variable(dimensions, values.astype(_STORED[dtype]), attributes, {"_FillValue": None})
    return {"variable": name, "dtype": dtype}


def _joined(path: str, name: str) -> str:
    return f"{path}_{name}" if path and name else path or name


def _refused(kind: Any, plain: Any) -> Any:
    """Error for a plain value of another type; no implicit conversion."""
    raise TypeError(f"{plain!r} is no {getattr(kind, '__name__', kind)}")
