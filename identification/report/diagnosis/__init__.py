"""A diagnosis for people: a summary in the terminal, plots, and a page that stands alone."""

from identification.diagnosis.files import diagnosis_provenance, write_diagnosis_json
from identification.report.diagnosis.page import write_diagnosis_report
from identification.report.diagnosis.tables import diagnosis_summary

__all__ = ["diagnosis_provenance", "diagnosis_summary", "write_diagnosis_json", "write_diagnosis_report"]
