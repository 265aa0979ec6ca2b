"""`python -m benchmarks.simulator`: write a simulated experiment, or the embedded example anew."""

import argparse
from pathlib import Path

import numpy as np

from benchmarks.simulator import KINDS, draw_plan, draw_rig, standard_sensors, write_experiment
from benchmarks.simulator.example import write_example


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.simulator", description=__doc__)
    parser.add_argument("--example", action="store_true", help="write the records of data/example anew")
    parser.add_argument("--kind", choices=list(KINDS), default="stiff", help="family of the random rig")
    parser.add_argument("--seed", type=int, default=0, help="of the rig, its settings and the noise")
    parser.add_argument("--out", type=Path, help="folder of the experiment; the truth goes beside it, to OUT.truth.json")
    options = parser.parse_args()
    if options.example:
        write_example()
    elif options.out is None:
        parser.error("say where to: --out DIR, or --example")
    else:
        rng = np.random.default_rng(options.seed)
        rig = draw_rig(rng, options.kind)
        plans = draw_plan(rng, options.kind, rig.f_n)
        truth = options.out.with_name(f"{options.out.name}.truth.json")
        write_experiment(options.out, rig, plans, standard_sensors(), rng, truth=truth)


if __name__ == "__main__":
    main()
