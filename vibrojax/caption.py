"""The caption file of a figure: a paragraph, what was found, and the rig behind it, as Markdown."""

from collections.abc import Mapping
from typing import Any

_FIELDS = {"damping_ratio": "zeta", "natural_frequency_hz": "omega", "length": "l"}


def written(title: str, shown: str, found: str, rows: Mapping[str, str]) -> str:
    """A caption as Markdown: a paragraph, the finding, a list."""
    listed = "\n".join(f"- {name}: {text}" for name, text in rows.items())
    return f"**{title[:1].upper()}{title[1:]}.** {shown}\n\nFound: {found}.\n\n{listed}\n"


def rig_words(document: Mapping[str, Any]) -> str:
    """The model in one line, from `model.json` as `model_document` makes it.

    Example:
        >>> rig = {"mass": 1.0, "suspension": {"kind": "free"}, "law": {"name": "newton", "e": 0.5}, "units": {"law": {"e": "1"}}}
        >>> rig_words(rig)
        'm = 1 kg; suspension free; contact newton (e = 0.5)'
    """
    units = document.get("units", {})
    parts = [f"m = {document['mass']:.4g} kg"]
    for part, key, word in (("suspension", "kind", "suspension"), ("law", "name", "contact")):
        numbers = [
            f"{_FIELDS.get(name, name)} = {value:.4g} {units.get(part, {}).get(name, '1')}".removesuffix(" 1")
            for name, value in document[part].items()
            if name != key and isinstance(value, int | float)
        ]
        parts.append(f"{word} {document[part][key]}" + (f" ({', '.join(numbers)})" if numbers else ""))
    if effects := [effect["name"] for effect in document.get("effects", ()) if "name" in effect]:
        parts.append(f"effects {', '.join(effects)}")
    return "; ".join(parts)
