"""What a figure of a diagnosis is: a picture in the style of the fit's report, made from a `Diagnosis`.

Nominal is dashed, augmented not, measured a wide grey line, throughout; in colours, nominal is blue and augmented orange.

To add a figure: write a file with a function that takes a `Diagnosis` and a `PageStyle` and yields `Picture` objects, then list it in
`identification/report/diagnosis/figures/__init__.py`.
"""

from collections.abc import Callable, Iterator

from identification.diagnosis.diagnosis import Diagnosis
from identification.report.figures.base import Picture
from identification.report.page_style import PageStyle

Drawer = Callable[[Diagnosis, PageStyle], Iterator[Picture]]
