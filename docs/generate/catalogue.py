"""The catalogue of effects as Markdown: each prints itself, and its picture stands beside it."""

import inspect
import re

from benchmarks.fingerprints import FINGERPRINTS
from vibrojax.effects import EFFECTS, AbstractEffect
from vibrojax.parameters import Parameter


def catalogue() -> str:
    """A section for every listed effect."""
    return "\n".join(_section(name, effect) for name, effect in EFFECTS.items())


def _section(name: str, effect: type[AbstractEffect]) -> str:
    shows, picture = _picture(name)
    about = _about(effect)
    rows = "\n".join(_row(p) for p in effect.parameters)
    return f"""## `{name}`

{effect.summary[0].upper()}{effect.summary[1:]}.{shows}

```text
{effect.equation}
```

{picture}| parameter | symbol | unit | what it is |
|---|---|---|---|
{rows}

{about}

*Source:* {_source(effect)} Code: `{effect.__module__}`.
"""


def _picture(name: str) -> tuple[str, str]:
    """The sentence on an effect's picture, and the picture; both empty for an effect without one."""
    if name not in FINGERPRINTS:
        return "", ""
    mark = FINGERPRINTS[name]
    return f" {mark.shows}", f"![{mark.over} over {mark.along}](images/effects/{name}.png){{ .fingerprint loading=lazy }}\n\n"


def _row(p: Parameter) -> str:
    more = "; each record has its own" if p.per_record else "; found by trial, not by slope" if p.searched else ""
    symbol = re.sub(r"_(\w+)", r"<sub>\1</sub>", p.symbol)
    return f"| `{p.name}` | {symbol} | {p.unit} | {p.meaning}{more} |"


def _paragraphs(effect: type[AbstractEffect]) -> list[str]:
    return [" ".join(part.split()) for part in (inspect.getdoc(effect) or "").split("\n\n")]


def _about(effect: type[AbstractEffect]) -> str:
    """The remarks between the first sentence of the docstring and its source; the equation has its own place."""
    rest = (f"{part} ".removeprefix(f"{effect.equation}. ").strip() for part in _paragraphs(effect)[1:] if not part.startswith("Source: "))
    return "\n\n".join(part for part in rest if part)


def _source(effect: type[AbstractEffect]) -> str:
    found = next(part.removeprefix("Source: ") for part in _paragraphs(effect) if part.startswith("Source: "))
    return found[0].upper() + found[1:]
