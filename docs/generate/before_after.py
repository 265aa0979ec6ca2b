"""The picture of the README: what a diagnosis found missing, and a record that it never saw, predicted before and after.

python -m benchmarks.simulator --kind soft --effect coulomb_friction --seed 7 --out rig-C
vibrojax diagnose rig-C --out rig-C-diagnosis
vibrojax simulate --model rig-C-diagnosis/nominal.json --experiment rig-C.sealed/experiment.toml --out rig-C-before
vibrojax simulate --model rig-C-diagnosis/model.json --experiment rig-C.sealed/experiment.toml --out rig-C-after
python docs/generate/before_after.py rig-C docs/images/before-after.png
"""

import io
import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

BEFORE, AFTER = "#0072b2", "#d55e00"
RECORD, CHANNEL = "cart5.csv", "hammer_displacement"


def read(folder: Path) -> np.ndarray:
    """One record as a table."""
    return np.genfromtxt(folder / RECORD, delimiter=",", names=True)


def predicted(rig: Path) -> Image.Image:
    """Motion and error of both models on the sealed record."""
    truth = read(rig.with_name(f"{rig.name}.sealed"))
    models = {"before": (read(rig.with_name(f"{rig.name}-before")), BEFORE), "after": (read(rig.with_name(f"{rig.name}-after")), AFTER)}
    figure = Figure(figsize=(8.0, 3.4), layout="constrained", dpi=100)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1, 1.3))
    above.plot(truth["time"], 1e3 * truth[CHANNEL], color="0.45", linewidth=1.0)
    above.set_ylabel("x (mm)")
    for name, (table, color) in models.items():
        error = 1e6 * (table[CHANNEL] - truth[CHANNEL])
        rms = np.sqrt(np.mean(error**2))
        print(f"{name}: rms error {rms:.3g} um, {100 * np.std(error) / np.std(1e6 * truth[CHANNEL]):.2g} % of the motion")
        below.plot(truth["time"], error, color=color, linewidth=1.2, label=f"{name}: rms {rms:.3g} µm")
    below.set_ylabel("error (µm)")
    below.set_xlabel("time t (s)")
    below.legend(loc="upper left", ncols=2, frameon=False)
    below.margins(y=0.45)
    above.set_title("a record that no fit has seen: motion, and error of its prediction", loc="left", fontsize="medium")
    for axes in (above, below):
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(alpha=0.3)
        axes.margins(x=0)
    picture = io.BytesIO()
    figure.savefig(picture)
    return Image.open(picture).convert("RGB")


def main() -> None:
    """One above the other."""
    rig, out = Path(sys.argv[1]).resolve(), Path(sys.argv[2])
    parts = [predicted(rig), Image.open(rig.with_name(f"{rig.name}-diagnosis") / "missing.png").convert("RGB")]
    whole = Image.new("RGB", (max(p.width for p in parts), sum(p.height for p in parts)), "white")
    top = 0
    for part in parts:
        whole.paste(part, (0, top))
        top += part.height
    whole.quantize(64).save(out, optimize=True)


if __name__ == "__main__":
    main()
