"""A fit for people: tables in the terminal, plots, and a page that stands alone."""

from identification.report.table import fit_summary
from identification.report.verdict import judge
from identification.report.write import write_report

__all__ = ["fit_summary", "judge", "write_report"]
