"""`vibrojax presets`: the thesis's rigs, where their numbers come from, and which stated facts they reproduce."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Column, Table

from vibrojax.cli.environment import prepare_jax
from vibrojax.cli.output import output_file
from vibrojax.cli.progress import stages

EXAMPLE = "Example:  vibrojax presets show wires"
Name = Annotated[str, typer.Argument(metavar="NAME", help="wires, beam_170, beam_150, beam_135 or drilling_hammer.")]

app = typer.Typer(no_args_is_help=True, help="The thesis's rigs: numbers, where they come from, and what they reproduce.", epilog=EXAMPLE)


@app.command("list", epilog="Example:  vibrojax presets list")
def list_() -> None:
    """Print every preset: its rig, gaps, A0 and natural frequency, and how many of its numbers are stated, estimated or assumed."""
    prepare_jax()
    from vibrojax.presets import NAMES, Origin, read_preset

    table = Table(Column("preset", no_wrap=True), "rig", "gaps (mm)", "A0 (mm)", "f_n (Hz)", "stated, estimated, assumed")
    for name in NAMES:
        preset = read_preset(name)
        counts = [sum(number.origin is origin for number in preset.numbers.values()) for origin in Origin]
        gaps = ", ".join(f"{1e3 * gap:g}" for gap in preset.gaps)
        amplitude, frequency = 1e3 * preset["base_amplitude"], preset["natural_frequency_hz"]
        table.add_row(name, preset.title, gaps, f"{amplitude:g}", f"{frequency:g}", ", ".join(map(str, counts)))
    Console(highlight=False).print(table)


@app.command("show", epilog=EXAMPLE)
def show(name: Name) -> None:
    """Print every number of a preset and where it comes from."""
    prepare_jax()
    from vibrojax.presets import read_preset

    preset = read_preset(name)
    table = Table(Column("number", no_wrap=True), Column("value", no_wrap=True), "where it comes from", "why", title=preset.title)
    for key, number in preset.numbers.items():
        unit = "" if number.unit == "1" else f" {number.unit}"
        table.add_row(key, f"{number.value:g}{unit}", number.origin.value, number.why)
    console = Console(highlight=False)
    console.print(table)
    console.print(f"gaps: {', '.join(f'{1e3 * gap:g} mm' for gap in preset.gaps)}; law {preset.law}; suspension {preset.suspension}")
    swept = (f"{key.removesuffix('_hz')} {low:g} to {high:g}" for key, (low, high) in preset.ranges.items())
    place = ", ".join(f"{key.removesuffix('_hz')} {value:g}" for key, value in preset.point.items())
    console.print(f"studies sweep {', '.join(swept)}; one operating point: {place} (SI, frequencies in Hz)", soft_wrap=True)


@app.command("write", epilog="Example:  vibrojax presets write wires --out wires.json")
def write(name: Name, out: Annotated[Path, typer.Option(metavar="FILE", dir_okay=False, help="The model.json to write.")]) -> None:
    """Write the model of a preset as a model.json, for the other commands; gap and amplitude of the cart are printed."""
    prepare_jax()
    from vibrojax.model_file import write_model
    from vibrojax.presets import read_preset

    preset = read_preset(name)
    origins = {key: f"{number.origin.value}: {number.why}" for key, number in preset.numbers.items()}
    with output_file(out) as file:
        write_model(preset.model(), file, provenance={"preset": name, "numbers": origins})
    gaps = " or ".join(f"{gap:g}" for gap in preset.gaps)
    typer.echo(f"{out} written; the rig: --base-amplitude {preset['base_amplitude']:g} --gap {gaps}")


@app.command("check", epilog="Example:  vibrojax presets check wires")
def check(
    name: Annotated[str | None, typer.Argument(metavar="NAME", help="Only this preset. Left out: all.")] = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="Say nothing while working.")] = False,
) -> None:
    """Print each fact that the thesis's front matter states against what the presets give.

    A fact marked "used" entered the search for the preset's numbers and tests nothing. Exit status 0 whatever is found.
    """
    with stages(quiet=quiet) as say:
        say("loading JAX")
        prepare_jax()
        from vibrojax.presets import read_preset
        from vibrojax.presets.facts import FACTS, Held

        facts = [fact for fact in FACTS if name is None or fact.preset == read_preset(name).name]
        answers = []
        for fact in facts:
            say(f"{fact.preset}: {fact.statement}")
            answers.append(fact.ask())
    table = Table("preset", "stated", "where", "the preset gives", "reproduced", "used")
    for fact, answer in zip(facts, answers, strict=True):
        verdict = "yes" if answer.reproduced else "NO"
        table.add_row(fact.preset, fact.statement, fact.source, answer.found, verdict, "used" if fact.used else "")
    motion = [answer.reproduced for fact, answer in zip(facts, answers, strict=True) if not isinstance(fact, Held)]
    tests = [answer.reproduced for fact, answer in zip(facts, answers, strict=True) if not fact.used]
    console = Console(highlight=False)
    console.print(table)
    console.print(f"{sum(motion)} of {len(motion)} facts about motion are reproduced", soft_wrap=True)
    console.print(f"{sum(tests)} of {len(tests)} facts that were not used are reproduced", soft_wrap=True)
