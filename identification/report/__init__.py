"""A fit for people: tables in the terminal, plots, and a page that stands alone."""

from identification.report.page import write_report
from identification.report.tables import fit_summary
from identification.report.verdict import judge

__all__ = ["fit_summary", "judge", "write_report"]
