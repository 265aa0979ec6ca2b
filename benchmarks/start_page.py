"""`python -m benchmarks.start_page --work DIR`: the start page's rig that conceals dry friction, its diagnosis and its picture.

What a model leaves of a sealed record is the error of its prediction from rest; the diagnosis has not seen the record.
"""

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from benchmarks.simulator.case import Order, draw_case, write_case
from identification.diagnosis.diagnose import diagnose_experiment
from identification.estimation.simulate import simulate_record
from identification.experiment import load_experiment
from vibrojax.cli.environment import prepare_jax
from vibrojax.drawing import BLUE, ORANGE, STYLE

_PICTURE = Path("docs/images/before-after.png")
_LOST = 1e-4
"""Error beyond which a prediction is lost, m."""


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.start_page", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--work", type=Path, required=True, help="empty folder for the rig")
    parser.add_argument("--picture", type=Path, default=_PICTURE, help="where the picture goes")
    options = parser.parse_args()
    prepare_jax()
    rng = np.random.default_rng(7)
    write_case(options.work / "rig-C", draw_case(rng, Order(kind="soft", effects=(("coulomb_friction", 1.0),))), rng)
    found = diagnose_experiment(load_experiment(options.work / "rig-C"))
    print("\n".join(found.sentences))
    sealed = {}
    for record in load_experiment(options.work / "rig-C.sealed").records:
        x = record.channels["hammer_displacement"]
        for name, model in (("before", found.nominal_model), ("after", found.model)):
            error = simulate_record(model, record)["hammer_displacement"] - x
            lost = np.flatnonzero(np.abs(error) > _LOST)
            until = f"beyond 0.1 mm from {record.time[lost[0]]:.2f} s on" if len(lost) else "never beyond 0.1 mm"
            print(f"{record.file} {name}: rms {1e6 * np.sqrt(np.mean(error**2)):.3g} µm, {until}")
            sealed[record.file, name] = error
            if record.file == "cart5.csv":
                shown = record
    draw(found, shown, sealed, options.picture)


def draw(found, record, errors, picture: Path) -> None:
    """A sealed record, the errors of its predictions, and what was missing over the displacement."""
    best = found.location.profiles[0]
    with plt.rc_context(STYLE):
        figure, (motion, error, missing) = plt.subplots(3, 1, figsize=(8.0, 6.6), height_ratios=(1.0, 1.2, 2.2), layout="constrained")
        motion.plot(record.time, 1e3 * record.channels["hammer_displacement"], color="#606060", linewidth=1.0)
        motion.set(ylabel="x (mm)", title="a record that no fit has seen: motion, and error of its prediction")
        for name, colour in (("before", BLUE), ("after", ORANGE)):
            one = 1e6 * errors[record.file, name]
            error.plot(record.time, one, color=colour, linewidth=1.2, label=f"{name}: rms {np.sqrt(np.mean(one**2)):.3g} µm")
        error.set(xlabel="time t (s)", ylabel="error (µm)")
        label = "missing from the nominal model, ± 2 σ"
        missing.errorbar(1e3 * best.center, best.mean, 2.0 * best.stderr, color=BLUE, marker="o", label=label)
        friction = found.effects[0].effect.friction_force
        missing.axhline(-float(friction), color=ORANGE, linewidth=1.6, label="dry friction, as diagnosed")
        missing.axhline(0.0, color="#404040", linewidth=0.8)
        missing.set(xlabel="displacement u (mm)", ylabel="missing force while u' > 0 (N)")
        error.legend(ncols=2)
        missing.legend(loc="center left")
        for axes in (motion, error):
            axes.set_xlim(record.time[0], record.time[-1])
        figure.savefig(picture, dpi=100)


if __name__ == "__main__":
    main()
