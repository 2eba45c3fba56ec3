"""Frictionless contact of the muscles of a scene with each other, with any sliding; attached parts are exempt."""

from typing import Any, ClassVar

from fem_reference.effects import Interaction
from fem_reference.foundations.units import AreaStiffness, PositiveLength


class MuscleContact(Interaction):
    """A pressure of the gap between two muscles, on both alike; see ``fem_reference.problems.touching.Touching`` for the law.

    ``stiffness`` [MPa/mm]: under the pressure p the two overlap by at most p / stiffness. ``smoothing`` [mm]: the distance below
    which a muscle is felt, and the most by which two may overlap at rest. Only in scenes of several muscles.
    """

    example: ClassVar[dict[str, Any]] = {"stiffness": "500 kPa/mm", "smoothing": "0.3 mm"}
    stiffness: AreaStiffness
    smoothing: PositiveLength
