"""Thesis figure 3.3: a rigid mass against a rigid wall at several approach speeds, and its parameters identified back.

    python -m benchmarks.figure_3_3 --out figure-3-3

Draws force profiles and phase planes, prints restitution, peak force, indentation and contact time for each speed beside the SciPy
oracle, then hides the parameter set: noisy drop records made by the oracle (which shares no code with the program) are fitted by the
program and the answer is printed beside the thesis's numbers, in standard errors and per cent.
"""

import tomllib
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from benchmarks import oracle
from vibrojax.data_files import data_path
from vibrojax.drawing import new_figure, save, style

SPEEDS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0)
"""Approach speeds, m/s."""
_RATE = 50_000.0
_BEFORE, _AFTER = 2e-3, 8e-3
"""s of free flight before the touch, and of record after it."""
_SEED = 33


def thesis_set() -> dict[str, float]:
    """Parameters of the figure by name, SI."""
    table = tomllib.loads(data_path("thesis", "figure_3_3.toml").read_text(encoding="utf-8"))
    return {row["name"]: row["value"] for row in table["value"]}


def impact(values: dict[str, float], speed: float) -> tuple[np.ndarray, oracle.Motion, np.ndarray]:
    """Times, s, oracle motion and force, N, of one impact on a wall at u = 0."""
    force = oracle.hunt_crossley(values["k_i"], values["n"], values["lambda_i"])
    rig = oracle.Rig(mass=values["m"], gap=0.0, force=force)
    ts = np.arange(0.0, _BEFORE + _AFTER, 1 / _RATE)
    motion = oracle.motion(rig, ts, (-speed * _BEFORE, speed))
    return ts, motion, np.array([force(u, v, speed) if u > 0 else 0.0 for u, v in zip(motion.u, motion.v, strict=True)])


def write_experiment(folder: Path, values: dict[str, float], seed: int) -> None:
    """Drop records at every speed, with white noise: 0.5 um on displacement, 0.2 % of its peak on force."""
    rng = np.random.default_rng(seed)
    records = []
    for number, speed in enumerate(SPEEDS):
        ts, motion, force = impact(values, speed)
        columns = [ts, motion.u + 5e-7 * rng.standard_normal(len(ts)), force + 0.002 * force.max() * rng.standard_normal(len(ts))]
        table, header = np.stack(columns, axis=1), "time,hammer_displacement,impact_force"
        np.savetxt(folder / f"drop{number}.csv", table, fmt="%.9g", delimiter=",", header=header, comments="")
        records.append(f'[[record]]\nfile = "drop{number}.csv"\nkind = "drop-test"\ngap = 0.0\n')
    sensors = '[sensors.hammer_displacement]\nunit = "m"\nnoise = 5e-7\n[sensors.impact_force]\nunit = "N"\n'
    head = f'schema = 1\n[experiment]\nname = "figure 3.3"\n[hammer]\nmass = {values["m"]}\n[suspension]\nkind = "free"\n'
    (folder / "experiment.toml").write_text(head + sensors + "".join(records), encoding="utf-8")


def model_impact(values: dict[str, float], speed: float):
    """Times, displacement, velocity and force of the program's own model."""
    import jax.numpy as jnp

    from vibrojax.channels import channels
    from vibrojax.contact import HuntCrossley
    from vibrojax.excitation import Unforced, at_rest
    from vibrojax.integrate import Landing
    from vibrojax.model import Model
    from vibrojax.suspension import Free

    law = HuntCrossley(values["k_i"], values["n"], values["lambda_i"])
    system = Model(mass=values["m"], suspension=Free(), law=law).system(gap=0.0, base=at_rest(), applied=Unforced())
    ts = jnp.arange(0.0, _BEFORE + _AFTER, 1 / _RATE)
    trajectory = Landing(contact_steps=100.0)(system, ts, jnp.asarray([-speed * _BEFORE, speed]))
    return tuple(np.asarray(part) for part in (ts, trajectory.u, trajectory.v, channels(system, trajectory)["impact_force"]))


def draw(values: dict[str, float], file: Path) -> list[tuple[float, ...]]:
    """Force profiles and phase planes; returns (speed, e, peak force, indentation, contact time, worst departure from the oracle)."""
    rows = []
    with style():
        figure = new_figure(4.2, 11.0, layout="constrained")
        left, right = figure.subplots(1, 2)
        for speed in SPEEDS:
            ts, u, v, force = model_impact(values, speed)
            _, exact, exact_force = impact(values, speed)
            touching = np.flatnonzero(force > 0)
            left.plot(1e3 * (ts - _BEFORE), force / 1e3, label=f"{speed:g} m/s")
            right.plot(1e6 * u, v)
            departure = max(np.abs(u - exact.u).max() / u.max(), np.abs(force - exact_force).max() / force.max())
            rows.append((speed, -v[-1] / speed, force.max(), 1e6 * u.max(), 1e3 * len(touching) / _RATE, departure))
        left.set(xlabel="time after touch, ms", ylabel="impact force $F_i$, kN", xlim=(-0.5, 6), title="Force profiles")
        left.legend(title="approach speed")
        right.set(xlabel="indentation δ, µm", ylabel="velocity δ', m/s", xlim=(-300, 1400), title="Phase plane")
        right.axvline(0, color="0.6", lw=0.8)
        figure.suptitle("Rigid mass against a wall, Hunt–Crossley law, parameters of thesis figure 3.3")
        save(figure, file)
    return rows


def main(out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the picture, the records and the fit.")]) -> None:
    """Reproduce thesis figure 3.3 and identify its parameters back from noisy records."""
    from vibrojax.cli.environment import prepare_jax

    prepare_jax()
    from identification.commands.run import run_fit

    values, console = thesis_set(), Console()
    records = out / "records"
    records.mkdir(parents=True, exist_ok=True)
    table = Table(title="Impacts at the thesis's parameters")
    for heading in ("v0, m/s", "e", "F_max, N", "δ_max, µm", "contact, ms", "worst departure from DOP853"):
        table.add_column(heading, justify="right")
    for row in draw(values, out / "figure_3_3.png"):
        table.add_row(*(f"{value:.4g}" for value in row[:-1]), f"{row[-1]:.1e}")
    console.print(table)
    write_experiment(records, values, _SEED)
    reference = data_path("thesis", "figure_3_3.toml")
    run_fit(records, out, reference=reference, seed=_SEED, show=console.print)


if __name__ == "__main__":
    typer.run(main)
