"""Tables of the documentation: the stored part of each measurement, and its rows on a page."""

from measurements import cases, evidence, fibres, hard, solvers
from measurements.tables import KEPT, Measurement, kept, origin

__all__ = ["KEPT", "MEASUREMENTS", "TABLES", "Measurement", "kept", "origin"]

_SUBJECTS = (evidence, cases, fibres, hard, solvers)
MEASUREMENTS = {name: one for subject in _SUBJECTS for name, one in subject.MEASUREMENTS.items()}
TABLES = {name: one for subject in _SUBJECTS for name, one in subject.TABLES.items()}
