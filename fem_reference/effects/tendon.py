"""Straight tendons, such as the iliotibial tract, that connect the muscle to a bone beyond it."""

from typing import Any, ClassVar

from fem_reference.effects import Interaction
from fem_reference.foundations.units import PositiveLength, Stiffness


class Tendon(Interaction):
    """A tension ``k (l - l0)`` along straight lines that are longer than their rest length l0; slack lines do not push. The lines
    start on the surface, within the distance ``reach`` of the ends of the fibres that continue into the ``tendon`` of an
    attachment. They end at the point of this tendon on the bone.

    ``on``: the attachment; ``stiffness`` [N/mm]: the stiffness of all lines together, ``E A / l0`` for a tendon of modulus E and
    cross-section A. The stiffness k of a line is its share of ``stiffness``, in proportion to the surface area at its start.
    ``reach`` [mm]: as above. A tendon has no tension at rest and therefore cannot be combined with ``in_situ``. Source: Zajac 1989
    (Crit. Rev. Biomed. Eng. 17:359), a tendon as a spring in series, here linear.
    """

    example: ClassVar[dict[str, Any]] = {"on": "insertion", "stiffness": "20 N/mm", "reach": "15 mm"}
    on: str
    stiffness: Stiffness
    reach: PositiveLength
