"""`report.html` of a diagnosis: one page that stands alone, with every image and the script that zooms inside."""

import math
from collections.abc import Mapping
from typing import Any

from identification.diagnosis.diagnosis import MISSING, Asserted, Diagnosis
from identification.report.diagnosis import rows, words
from identification.report.diagnosis.equation import equation_html
from identification.report.figures.ring_downs import left_out
from identification.report.frame import framed
from identification.report.image import Image
from identification.report.page_style import PageStyle
from identification.report.rows import load_words
from identification.wording.names import spoken
from identification.wording.numbers import joined, millimetres, significant


def page(diagnosis: Diagnosis, images: list[Image], style: PageStyle, *, provenance: Mapping[str, Any]) -> str:
    """The whole page.

    Args:
        diagnosis: of one experiment.
        images: in the order in which they appear within their section.
        style: of the images.
        provenance: as in `diagnosis.json`.

    Returns:
        HTML without any address outside itself.
    """
    candidates = rows.candidate_rows(diagnosis)
    return framed(
        "identification.report.diagnosis",
        images,
        style,
        next_steps=words.next_steps(diagnosis),
        provenance=provenance,
        seconds=diagnosis.seconds,
        filters={"equation": equation_html},
        diagnosis=diagnosis,
        load=load_words(diagnosis.nominal_model),
        missing=diagnosis.verdict == MISSING,
        headline=words.headline(diagnosis),
        looked_for=words.candidates(diagnosis),
        place=_place(diagnosis),
        effects=[_effect(one) for one in diagnosis.effects],
        ambiguous=joined([words.effect_words(name) for name in diagnosis.ambiguous_with]),
        undrawn=_undrawn(diagnosis, images),
        unread=left_out(diagnosis.ring_downs),
        notices=list(rows.notices(diagnosis)),
        learned=rows.learned_rows(diagnosis),
        errors=rows.error_rows(diagnosis),
        changes=rows.change_rows(diagnosis),
        scatter=rows.scatter_rows(diagnosis),
        candidates=candidates,
        refitted=any(one.drop is not None for one in diagnosis.considered),
        predicted=any(one.held_out is not None for one in diagnosis.considered),
        more=max(len(diagnosis.considered) - len(candidates), 0),
        warnings=rows.warnings(diagnosis),
        samples=sum(record.samples for record in diagnosis.nominal.records),
    )


def _effect(one: Asserted) -> dict[str, Any]:
    """What the page says about one asserted effect."""
    return {
        "name": one.effect.name,
        "summary": one.effect.summary,
        "equation": one.effect.equation,
        "source": one.effect.source,
        "where": words.where(one),
        "probability": words.probability_text(one.probability),
        "numbers": rows.number_rows(one.reported, one.effect.parameters),
    }


def _undrawn(diagnosis: Diagnosis, images: list[Image]) -> str:
    """Records without a picture of their own."""
    drawn = {image.record for image in images}
    return joined([record.file for record in diagnosis.nominal.records if record.file not in drawn])


def _place(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """The location as pairs of a heading and what is found under it."""
    where = diagnosis.location
    if where is None:
        return []
    look = next((words.axis(p.coordinate, p.unit) for p in where.profiles if p.coordinate == where.coordinate), None)
    pairs = [("channel", _shares({spoken(name): share for name, share in where.channels.items()}) or spoken(where.channel))]
    pairs += [("records", _shares(where.records))] if where.records else []
    pairs.append(("phase of the motion", where.phase))
    follows = where.coordinate
    if where.interval is not None and look is not None:
        follows += f", mostly {_between(*(look.factor * end for end in where.interval))} {look.unit}".rstrip()
    pairs.append(("follows", follows))
    if where.time is not None:
        pairs.append(("begins at", f"{significant(where.time, 4)} s"))
    if where.record is not None:
        pairs.append(("only in", where.record))
    if where.kink is not None:
        pairs.append(("harder beyond", f"{millimetres(where.kink.depth)} of indentation, in {joined(list(where.kink.deeper))}"))
    return pairs


def _between(low: float, high: float) -> str:
    """An interval, which may be open at either end."""
    if not math.isfinite(low):
        return f"below {significant(high, 3)}"
    return f"between {significant(low, 3)} and {significant(high, 3)}" if math.isfinite(high) else f"above {significant(low, 3)}"


def _shares(shares: Mapping[str, float]) -> str:
    """Names with their shares, the largest first; what has none is left out."""
    largest = sorted(((name, share) for name, share in shares.items() if share >= 0.005), key=lambda item: -item[1])
    return ", ".join(f"{name} {100 * share:.0f} %" for name, share in largest)
