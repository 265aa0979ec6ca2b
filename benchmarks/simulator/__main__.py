"""`python -m benchmarks.simulator`: write a simulated experiment, with or without concealed effects, or the embedded example anew."""

import argparse
from pathlib import Path

import numpy as np

from benchmarks.simulator.case import WITHOUT, Order, draw_case, write_case
from benchmarks.simulator.effects import EFFECTS
from benchmarks.simulator.example import write_example
from benchmarks.simulator.rig import KINDS
from benchmarks.simulator.unrest import UNREST


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.simulator", description=__doc__)
    parser.add_argument("--example", action="store_true", help="write the records of data/example anew")
    parser.add_argument("--kind", choices=list(KINDS), default="stiff", help="family of the random rig")
    parser.add_argument(
        "--effect",
        action="append",
        default=[],
        type=concealed,
        metavar="NAME[=STRENGTH]",
        help=f"conceal this, at strength 1 if none is given; once or more: {', '.join(EFFECTS)}",
    )
    parser.add_argument("--noise", type=float, default=1.0, metavar="FACTOR", help="on every sensor's noise")
    parser.add_argument("--channels", choices=list(WITHOUT), default="all", help="which channels are recorded")
    parser.add_argument("--driven", type=int, choices=(1, 2, 3), default=3, help="records with a moving cart")
    parser.add_argument("--unrest", nargs="+", choices=UNREST, default=[], help="what keeps the rig from repeating itself; one or more")
    parser.add_argument("--seed", type=int, default=0, help="of the rig, its settings and the noise")
    parser.add_argument("--out", type=Path, help="folder of the experiment; truth and sealed records go beside it, to OUT.sealed")
    options = parser.parse_args()
    if options.example:
        write_example()
    elif options.out is None:
        parser.error("say where to: --out DIR, or --example")
    else:
        rng = np.random.default_rng(options.seed)
        order = Order(
            kind=options.kind,
            effects=tuple(options.effect),
            noise=options.noise,
            channels=options.channels,
            driven=options.driven,
            unrest=tuple(options.unrest),
        )
        write_case(options.out, draw_case(rng, order), rng)


def concealed(text: str) -> tuple[str, float]:
    """Read NAME=STRENGTH."""
    name, _, strength = text.partition("=")
    if name not in EFFECTS:
        raise argparse.ArgumentTypeError(f"unknown effect {name!r}: expected one of {', '.join(EFFECTS)}")
    return name, float(strength or 1.0)


if __name__ == "__main__":
    main()
