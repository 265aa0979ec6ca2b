"""The mark that each listed effect leaves in a record, drawn over the coordinate in which it shows best.

    python -m benchmarks.fingerprints --out docs/images/effects

One rig is integrated with an effect and once more without any. White noise of the usual sensors is added to what the recorder shows, and
the nominal model, at its true parameters and along the same motion, is taken away: what is left belongs to the effect.
"""

import argparse
import io
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

from benchmarks.fingerprints.marks import FINGERPRINTS, effect_of
from benchmarks.fingerprints.run import complete, simulate
from vibrojax.cli.environment import prepare_jax

_MANY = 100
"""Points, above which they are drawn small."""


def draw(name: str) -> Image.Image:
    """The picture of one effect: the record that has it, over the one that has none."""
    mark = FINGERPRINTS[name]
    figure = Figure(figsize=(4.6, 2.7), layout="constrained", dpi=140)
    axes = figure.subplots()
    style = {"linestyle": "-" if mark.lines else "none", "linewidth": 0.8, "marker": None if mark.lines else "."}
    with_it = simulate((effect_of(name),), mark.law, mark.duration, mark.sampling)
    for run, color, label in (
        (complete(mark.duration, mark.sampling), "0.7", "nothing concealed"),
        (with_it, "tab:red", "with the effect"),
    ):
        x, y = mark.points(run)
        axes.plot(x, y, color=color, label=label, markersize=2.5 if len(x) > _MANY else 7.0, **style)
    axes.set_xlabel(mark.along)
    axes.set_ylabel(mark.over)
    axes.grid(alpha=0.3)
    figure.legend(loc="outside upper right", ncols=2, fontsize="small", markerscale=2, frameon=False)
    picture = io.BytesIO()
    figure.savefig(picture)
    return Image.open(picture).convert("RGB").quantize(48)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fingerprints", description=str(__doc__).splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the pictures, one PNG an effect")
    parser.add_argument("--only", action="append", choices=list(FINGERPRINTS), metavar="NAME", help="this effect; once or more")
    options = parser.parse_args()
    prepare_jax()
    options.out.mkdir(parents=True, exist_ok=True)
    for name in options.only or FINGERPRINTS:
        draw(name).save(options.out / f"{name}.png", optimize=True)
        print(name)


if __name__ == "__main__":
    main()
