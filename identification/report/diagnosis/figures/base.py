"""What a figure of a diagnosis is: a picture in the style of the fit's report, made from a `Diagnosis`.

Nominal is blue and dashed, augmented orange, measured a wide grey line, throughout.

To add a figure: write a file with a function that takes a `Diagnosis` and yields `Picture` objects, then list it in
`identification/report/diagnosis/figures/__init__.py`.
"""

from collections.abc import Callable, Iterator

from identification.diagnosis.diagnosis import Diagnosis
from identification.report.figures.base import ACCENT, MODEL, Picture

Drawer = Callable[[Diagnosis], Iterator[Picture]]
BEFORE, AFTER = ACCENT, MODEL
BEFORE_BAND, HELD = "#b9d4e6", "#f3eee0"
DASHED = (0, (5, 2))
