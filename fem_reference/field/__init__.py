"""Scalar fields on intervals, plates and surfaces: the report's Octave examples (section 4.6) and scenes like them.

Numbers have no unit here: coordinates, values and coefficients are in any one consistent set, as in the report.
"""
