"""Force and acceleration of the first impact of a drop test against time, as thesis figures 3.8 to 3.10 show them."""

from collections.abc import Iterator

from identification.report.figures.base import Picture
from identification.report.page_style import PageStyle
from identification.result.result import FitResult, RecordFit, impacts, strength
from identification.wording.names import label
from identification.wording.numbers import significant
from vibrojax.drawing import few_ticks, new_figure

_SHOWN = ("impact_force", "hammer_acceleration")


def first_impact(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """One picture for the first drop test, or where there is none for the first record with contact."""
    touching = [record for record in result.records if impacts(record)]
    drops = [record for record in touching if record.kind == "drop-test"]
    for record in (drops or touching)[:1]:
        yield _picture(result, record, style)


def _picture(result: FitResult, record: RecordFit, style: PageStyle) -> Picture:
    impact = impacts(record)[0]
    part = impact.around(len(record.time), before=0.6, after=0.8)
    since = 1e3 * (record.time[part] - record.time[impact.first])
    figure = new_figure(3.9)
    axes = figure.subplots(2, 1, sharex=True, gridspec_kw={"left": 0.125, "right": 0.985, "bottom": 0.11, "top": 0.96, "hspace": 0.12})
    for one, channel in zip(axes, _SHOWN, strict=True):
        look = label(channel, result.experiment)
        if channel in record.measured:
            one.plot(since, look.factor * record.measured[channel][part], "o", color=style.accent.colour, markersize=3.5, label="measured")
        one.plot(
            since,
            look.factor * record.predicted[channel][part],
            color=style.model.colour,
            linewidth=1.3,
            label="model" if channel in record.measured else "model (not recorded)",
        )
        one.set_ylabel(f"{look.words} {look.axis}" if len(look.words) < 14 else look.axis)
        one.legend(loc="best")
        few_ticks(one, x=8, y=5)
    axes[0].tick_params(labelbottom=False)
    axes[1].set_xlabel("time since touch (ms)")
    peak = significant(strength(record, impact))
    return Picture(
        name="first-impact",
        section="contact",
        record=record.file,
        caption=f"First impact of {record.file}: force and acceleration against time, measured ({style.accent.word} dots) and model"
        f" ({style.model.word}).",
        alt=f"Force and acceleration of the first impact of {record.file} against time; the model's force peaks at {peak} newtons.",
        figure=figure,
    )
