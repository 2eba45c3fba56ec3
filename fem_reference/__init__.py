"""A finite element reference and validation suite for muscle deformation.

Importing it does nothing. Units inside are mm, N, MPa, s and rad everywhere; only scene files carry other units, as text.
"""

__version__ = "0.1.0"
