"""Contact of the muscles of a scene with each other, or of a single muscle with itself; attached parts are exempt."""

from collections.abc import Iterable
from typing import Any, ClassVar

from pydantic import Field

from fem_reference.effects import Effect, Interaction
from fem_reference.foundations.units import AreaStiffness, PositiveLength


class MuscleContact(Interaction):
    """The pressure law of ``contact``, applied equally to both sides of the gap between two muscles or between parts of a single
    muscle, with finite sliding (``fem_reference.problems.touching.Touching``). With several muscles, each touches the other muscles
    but not itself.

    ``stiffness`` [MPa/mm]: under the pressure p the two sides overlap by at most p / stiffness. ``smoothing`` [mm]: the distance at
    which contact begins, and the maximum overlap of two muscles, or of a muscle with itself, that is allowed at rest. ``friction``:
    the coefficient of Coulomb's law, greater than 0; without it contact is frictionless. ``own_normals``: True if the gap between
    two muscles is measured along the normal of each point instead of to the nearest point; not possible with friction.
    """

    example: ClassVar[dict[str, Any]] = {"stiffness": "500 kPa/mm", "smoothing": "0.3 mm"}
    stiffness: AreaStiffness
    smoothing: PositiveLength
    friction: float | None = Field(default=None, gt=0)
    own_normals: bool = False


def among(acting: Iterable[Effect]) -> MuscleContact | None:
    """The first effect of contact of muscles in ``acting``; None if there is none."""
    return next((effect for effect in acting if isinstance(effect, MuscleContact)), None)
