"""A diagnosis for people: a summary in the terminal, plots, and a page that stands alone."""

from identification.report.diagnosis.summary import diagnosis_summary
from identification.report.diagnosis.write import write_diagnosis_report

__all__ = ["diagnosis_summary", "write_diagnosis_report"]
