"""A model on disk: `model.json`, written by a fit and read by `simulate`."""

import dataclasses
import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import jax

from vibrojax.channels import EVERY_CHANNEL
from vibrojax.contact import LAWS
from vibrojax.effects import EFFECTS, AbstractEffect
from vibrojax.effects.base import unit_in
from vibrojax.effects.filters import BANDS, MOST_ORDER, RecorderFilter
from vibrojax.effects.formula import Formula
from vibrojax.effects.free_form import COORDINATES, MOST_KNOTS, FreeForm, TonalForce
from vibrojax.errors import InputError, shown
from vibrojax.json_file import Table, read_json
from vibrojax.model import MASS, Load, Model
from vibrojax.suspension import SUSPENSIONS

SCHEMA = 1
_EXPECTED = "a model.json that a fit wrote"
_TOP = ("schema", "mass", "load", "suspension", "law", "effects", "recorder", "units", "provenance")
_LOAD = {"incline": "rad", "constant_force": "N"}
"""Known constant forces, by field."""
_FILTER = ("of_channel", "band", "order", "corner_hz")
_RECORD, _CHANNEL = ("in_file", "record"), ("of_channel", "channel")
"""Field of an effect that acts in one record, or on one channel; and its key in the file."""


def write_model(model: Model, path: Path, *, provenance: Mapping[str, Any] | None = None) -> None:
    """Write a model as `model.json`; `read_model` gives back exactly the same numbers.

    Args:
        model: with one number per parameter, all finite.
        path: of the file; replaced if it exists.
        provenance: kept in the file for the reader's information.

    Raises:
        ValueError: a parameter is not finite, or is an array; or an effect on one channel does not say on which.
    """
    path.write_text(json.dumps(model_document(model, provenance=provenance), indent=2, allow_nan=False) + "\n", encoding="utf-8")


def model_document(model: Model, *, provenance: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """What `model.json` holds: mass in kg, suspension by field, law and effects by parameter name, and the unit of each number.

    An effect that acts in one record or on one channel names it (`record`, `channel`), and a free form its `coordinate`, its `knots`
    and whether it differs `by_direction`; a term of the user has its `formula`. A parameter that has a value for each record is
    written as the model holds it, zero unless it was set. `effects` is left out where there are none; so are `load`, known constant forces,
    and `recorder`, known filters.

    Example:
        >>> from vibrojax.suspension import Linear
        >>> from vibrojax.contact import KelvinVoigt
        >>> document = model_document(Model(mass=2.0, suspension=Linear(0.02, 5.0), law=KelvinVoigt(1e6, 1e-3)))
        >>> document["suspension"]
        {'kind': 'linear', 'damping_ratio': 0.02, 'natural_frequency_hz': 5.0}
    """
    suspension, law = model.suspension, model.law
    of_suspension = [*(p.field for p in suspension.parameters), *_lengths(type(suspension))]
    return {
        "schema": SCHEMA,
        "mass": _number(model.mass, "mass"),
        **({"load": {name: _number(getattr(model.load, name), name) for name in _LOAD}} if model.load.acts else {}),
        "suspension": {"kind": suspension.name} | {name: _number(getattr(suspension, name), name) for name in of_suspension},
        "law": {"name": law.name} | {p.name: _number(getattr(law, p.field), p.name) for p in law.parameters},
        **({"effects": [effect_document(effect) for effect in model.effects]} if model.effects else {}),
        **({"recorder": [{name: getattr(one, name) for name in _FILTER} for one in model.recorder]} if model.recorder else {}),
        "units": _units(type(suspension), type(law), model.effects, load=model.load.acts),
        "provenance": dict(provenance or {}),
    }


def read_model(path: Path) -> Model:
    """Read a `model.json`.

    Args:
        path: of the file.

    Returns:
        The model, its parameters as floats.

    Raises:
        InputError: the file cannot be read, is not of this format, names an unknown law, suspension, effect, channel, key or unit, or holds
            a number that is not finite or not possible; the message says which.
    """
    return model_from_document(read_json(path, _EXPECTED), str(path))


def model_from_document(document: Any, where: str) -> Model:
    """Rebuild the model that `model_document` described.

    Args:
        document: parsed.
        where: how messages name it.

    Returns:
        The model, its parameters as floats.

    Raises:
        InputError: as for `read_model`.
    """
    table = Table(values=document, where=where, expected=_EXPECTED)
    if table.needed("schema") != SCHEMA or isinstance(table.needed("schema"), bool):
        table.refuse(f"schema is {shown(table.needed('schema'))}: expected {SCHEMA}; write the model again with this version")
    table.allow(_TOP)
    mass = table.number("mass", zero=False)
    below = table.table("suspension")
    kind: Any = SUSPENSIONS[below.choice("kind", SUSPENSIONS)]
    below.allow(["kind", *(p.field for p in kind.parameters), *_lengths(kind)])
    lengths = {name: below.number(name, zero=False) for name in _lengths(kind)}
    suspension = kind(**{p.field: below.number(p.field, zero=p.logarithmic) for p in kind.parameters}, **lengths)
    below = table.table("law")
    rule: Any = LAWS[below.choice("name", LAWS)]
    below.allow(["name", *(p.name for p in rule.parameters)])
    law = rule(**{p.field: below.number(p.name, zero=p.logarithmic, most=p.most) for p in rule.parameters})
    effects = tuple(_effect(part) for part in table.tables("effects"))
    load = Load()
    if "load" in table.values:
        below = table.table("load")
        below.allow(_LOAD)
        load = Load(**{name: below.number(name, zero=True, negative=True) for name in _LOAD})
    units = _units(kind, rule, effects, load="load" in table.values)
    if "units" in table.values and table.values["units"] != units:
        table.refuse(f"units are {shown(table.values['units'])}: expected {units}; give the numbers in these")
    return Model(
        mass=mass, suspension=suspension, law=law, effects=effects, load=load, recorder=tuple(map(_filter, table.tables("recorder")))
    )


def _filter(table: Table) -> RecorderFilter:
    """A known filter of the recorder from its object in the file."""
    table.allow(_FILTER)
    order = table.needed("order")
    if isinstance(order, bool) or not isinstance(order, int) or not 1 <= order <= MOST_ORDER:
        table.refuse(f"order is {shown(order)}: expected a whole number from 1 to {MOST_ORDER}")
    return RecorderFilter(
        of_channel=table.choice("of_channel", EVERY_CHANNEL),
        band=table.choice("band", BANDS),
        order=order,
        corner_hz=table.number("corner_hz", zero=False),
    )


def effect_document(effect: AbstractEffect) -> dict[str, Any]:
    """What a file holds of one effect: its name, the record or channel that it acts on, and its numbers."""
    if isinstance(effect, FreeForm):
        places = {"channel": effect.of_channel} if effect.of_channel else {}
        places |= {"coordinate": effect.coordinate, "knots": list(effect.knots), "by_direction": effect.by_direction}
    elif isinstance(effect, Formula):
        places = {"formula": effect.formula}
    else:
        places = {key: getattr(effect, field) for field, key in _places(type(effect))}
    if places.get("channel", EVERY_CHANNEL[0]) not in EVERY_CHANNEL:
        raise ValueError(f"{effect.name} acts on channel {places['channel']!r}: expected one of {', '.join(EVERY_CHANNEL)}")
    return (
        {"name": effect.name} | places | {p.name: _number(getattr(effect, p.field), f"{effect.name}.{p.name}") for p in effect.parameters}
    )


def effect_from_document(document: Any, where: str) -> AbstractEffect:
    """Rebuild the effect that `effect_document` described; errors as for `read_model`."""
    return _effect(Table(values=document, where=where, expected=_EXPECTED))


def _effect(table: Table) -> AbstractEffect:
    """One effect from its object in the file."""
    if "formula" in table.values:
        return _formula(table)
    kinds = {**EFFECTS, FreeForm.name: FreeForm, TonalForce.name: TonalForce}
    kind: Any = kinds[table.choice("name", list(kinds))]
    if kind is FreeForm:
        return _free_form(table)
    places = _places(kind)
    table.allow(["name", *(key for _, key in places), *(p.name for p in kind.parameters)])
    named = {field: table.choice(key, EVERY_CHANNEL) if key == "channel" else table.text(key) for field, key in places}
    # Strengths and damping may be zero; a frequency, a length or a stiffness by which an effect divides may not.
    zero = {p.name: p.lower <= 0 or "damping" in p.meaning for p in kind.parameters}
    return kind(**named, **{p.field: table.number(p.name, zero=zero[p.name], negative=p.lower < 0) for p in kind.parameters})


def _formula(table: Table) -> Formula:
    """A term of the user from its object in the file."""
    name, formula = table.text("name"), table.text("formula")
    try:
        blank = Formula(formula, "" if name == formula else name)
    except InputError as error:
        table.refuse(str(error))
    table.allow(["name", "formula", *(p.name for p in blank.parameters)])
    numbers = {p.field: table.number(p.name, zero=p.lower < 0, negative=p.lower < 0) for p in blank.parameters}
    return dataclasses.replace(blank, **numbers)


def _free_form(table: Table) -> FreeForm:
    """A tabulated function from its object in the file."""
    coordinate, knots = table.choice("coordinate", COORDINATES), table.numbers("knots", most=MOST_KNOTS)
    by_direction = table.flag("by_direction")
    of_channel = table.choice("channel", EVERY_CHANNEL) if "channel" in table.values else ""
    try:
        blank = FreeForm(coordinate=coordinate, knots=knots, of_channel=of_channel, by_direction=by_direction)
    except ValueError as error:
        table.refuse(str(error))
    table.allow(["name", "channel", "coordinate", "knots", "by_direction", *blank.coefficients])
    return dataclasses.replace(blank, **{name: table.number(name, zero=True, negative=True) for name in blank.coefficients})


def _places(effect: type[AbstractEffect]) -> list[tuple[str, str]]:
    """Those of `_RECORD` and `_CHANNEL` that the effect has."""
    fields = [one.name for one in dataclasses.fields(effect)]
    return [(field, key) for field, key in (_RECORD, _CHANNEL) if field in fields]


def _lengths(suspension: Any) -> dict[str, str]:
    """Unit of the length of a suspension that has one, known and not estimated."""
    return {one.name: "m" for one in dataclasses.fields(suspension) if one.name == "length"}


def _units(suspension: Any, law: Any, effects: Iterable[AbstractEffect], *, load: bool) -> dict[str, Any]:
    fields = {p.field: p.unit for p in suspension.parameters} | _lengths(suspension)
    of_effects = [{p.name: unit_in(p.unit, effect.channel) for p in effect.parameters} for effect in effects]
    shared = {"mass": MASS.unit, "suspension": fields, "law": {p.name: p.unit for p in law.parameters}}
    return shared | ({"effects": of_effects} if of_effects else {}) | ({"load": _LOAD} if load else {})


def _number(value: Any, name: str) -> float:
    """One finite number out of a leaf of the model."""
    if isinstance(value, jax.Array) and value.shape != ():
        raise ValueError(f"{name} has shape {value.shape}: a file holds one model; pick one lane before writing")
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(f"{name} is {number}: a model with such a parameter cannot be written")
    return number
