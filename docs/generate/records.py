"""What each record, sensor and sample of the embedded example is worth: standard errors of its fit with some of them left out.

    python docs/generate/records.py

prints the table of docs/data.md.
"""

import dataclasses
import shutil
import tempfile
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.console import Console

from identification.estimation.estimate import fit_experiment
from identification.experiment import load_experiment
from vibrojax.cli.environment import prepare_jax
from vibrojax.data_files import data_path

TRUTH = {"k_i": 3.0e6, "n": 1.5, "lambda_i": 0.35, "zeta": 0.012, "f_n": 5.2}
RECORDS = ("drop", "cart1", "cart2", "cart3")
SENSORS = ("hammer_displacement", "cart_displacement", "impact_force", "hammer_acceleration")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Variant:
    """The example with something left out."""

    title: str
    records: tuple[str, ...] = RECORDS
    sensors: tuple[str, ...] = SENSORS
    every: int = 1
    """Which sample is kept: every first, second, ..."""
    share: float = 1.0
    """Of each record, from its beginning."""
    change: Callable[[str, np.ndarray], np.ndarray] = lambda channel, values: values


def variants() -> list[Variant]:
    """The rows of the table."""
    without = [Variant(title=f"without {name}", records=tuple(r for r in RECORDS if r != name)) for name in RECORDS]
    alone = [Variant(title=f"{name} alone", records=(name,)) for name in ("drop", "cart1")]
    coarse = [Variant(title=f"{4000 // step} Hz", every=step) for step in (2, 4, 8, 16)]
    less = [Variant(title="first third of each record", share=1 / 3)]
    fewer = [
        Variant(title="no load cell", sensors=tuple(s for s in SENSORS if s != "impact_force")),
        Variant(title="no accelerometer", sensors=tuple(s for s in SENSORS if s != "hammer_acceleration")),
        Variant(title="displacements only", sensors=SENSORS[:2]),
    ]
    clipped = [
        Variant(title="load cell cut at 60 N", change=lambda channel, y: np.minimum(y, 60.0) if channel == "impact_force" else y),
    ]
    return [Variant(title="all four records, 4000 Hz"), *without, *alone, *coarse, *less, *fewer, *clipped]


def write(variant: Variant, folder: Path) -> None:
    """The experiment of a variant."""
    source = data_path("example")
    settings = tomllib.loads((source / "experiment.toml").read_text(encoding="utf-8"))
    lines = ["schema = 1", "[experiment]", 'name = "variant"', "[hammer]", f"mass = {settings['hammer']['mass']}"]
    lines += ["[suspension]", 'kind = "linear"']
    for name in variant.sensors:
        lines += [f"[sensors.{name}]", *(f"{key} = {value!r}" for key, value in settings["sensors"][name].items())]
    for record in settings["record"]:
        stem = record["file"].removesuffix(".csv.gz")
        if stem not in variant.records:
            continue
        lines += ["[[record]]", f'file = "{stem}.csv"', *(f"{key} = {value!r}" for key, value in record.items() if key != "file")]
        table = np.genfromtxt(source / record["file"], delimiter=",", names=True)
        table = table[: int(variant.share * len(table))][:: variant.every]
        names = ("time", *variant.sensors)
        columns = np.stack([variant.change(name, table[name]) for name in names], axis=1)
        np.savetxt(folder / f"{stem}.csv", columns, fmt="%.10g", delimiter=",", header=",".join(names), comments="")
    (folder / "experiment.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")


def row(variant: Variant) -> str:
    """One line of the table."""
    folder = Path(tempfile.mkdtemp())
    try:
        write(variant, folder)
        result = fit_experiment(load_experiment(folder))
    finally:
        shutil.rmtree(folder)
    cells = []
    for parameter in result.parameters:
        name, off = parameter.spec.name, parameter.value - TRUTH[parameter.spec.name]
        if parameter.stderr is None:
            cells.append(parameter.status)
        else:
            cells.append(f"{100 * parameter.stderr / TRUTH[name]:.2g} % ({off / parameter.stderr:+.1f})")
    return f"| {variant.title} | {' | '.join(cells)} | {result.chi2_reduced:.3f} |"


def main() -> None:
    """Print the table."""
    prepare_jax()
    console = Console(soft_wrap=True, highlight=False, markup=False)
    console.print(f"| what was fitted | {' | '.join(TRUTH)} | chi-square |\n|{'---|' * (len(TRUTH) + 2)}")
    for variant in variants():
        try:
            console.print(row(variant))
        except Exception as error:  # a variant that cannot be fitted is a row too
            console.print(f"| {variant.title} | {type(error).__name__}: {error} |")


if __name__ == "__main__":
    main()
