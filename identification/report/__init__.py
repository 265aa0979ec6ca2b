"""A fit and a diagnosis for people: tables in the terminal, plots, and pages that stand alone."""

from identification.report.diagnosis_tables import diagnosis_summary
from identification.report.page import write_diagnosis_report, write_report
from identification.report.tables import fit_summary
from identification.report.verdict import judge

__all__ = ["diagnosis_summary", "fit_summary", "judge", "write_diagnosis_report", "write_report"]
