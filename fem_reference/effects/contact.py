"""Contact of bones with the muscle, with finite sliding; attached parts and the parts near them are exempt."""

import math
from collections.abc import Iterable
from typing import Any, ClassVar

from pydantic import Field

from fem_reference.effects import Effect, Interaction
from fem_reference.foundations.indicators import Estimates, Indicator
from fem_reference.foundations.units import AreaStiffness, PositiveLength


class Contact(Interaction):
    """A pressure that depends on the gap g to each bone (the signed distance, negative inside): 0 beyond the ``smoothing`` d,
    ``k (d - g)^2 / (4 d)`` from d to -d, and ``-k g`` below -d, where k is the ``stiffness``
    (``fem_reference.problems.contact.ContactLaw``).

    ``stiffness`` [MPa/mm]: under the pressure p the surface penetrates the bone by at most p / stiffness. ``smoothing`` [mm]: the
    distance at which contact begins. ``bones``: the names of the bones, by default all. ``support`` [mm], only with ``in_situ``:
    the distance within which a bone may press on the muscle at rest, through tissue that is not meshed, such as a capsule or a
    bursa; by default a bone presses on the muscle only where they touch. ``friction``: the coefficient of Coulomb's law, greater
    than 0; without it contact is frictionless.
    """

    example: ClassVar[dict[str, Any]] = {"stiffness": "500 kPa/mm", "smoothing": "0.3 mm", "bones": ["femur"]}
    stiffness: AreaStiffness
    smoothing: PositiveLength = 0.1
    bones: tuple[str, ...] | None = Field(default=None, min_length=1)
    support: PositiveLength | None = None
    friction: float | None = Field(default=None, gt=0)

    def indicator(self, scene: Estimates) -> Indicator:
        """The possible penetration of the surface into bones, and the resulting pressure."""
        near = {name: one for name, one in scene.near.items() if self.is_by(name)}
        gap = min((one.gap for one in near.values()), default=math.inf)
        depth, felt = math.hypot(*(one.depth for one in near.values())), self.smoothing + (self.support or 0.0)
        reached = [f"{name}, nearest at frame {one.frame:g}" for name, one in near.items() if one.gap < felt]
        rule = f"guaranteed clearance to bones [mm] ({'; '.join(reached) or 'no bone is reached'})"
        return Indicator(rule, gap, depth, self.stiffness * max(depth, felt - gap, 0.0))

    def is_by(self, bone: str) -> bool:
        """True if contact with the bone of this name is included."""
        return self.bones is None or bone in self.bones


def among(acting: Iterable[Effect]) -> Contact | None:
    """The first effect of contact with bones in ``acting``; None if there is none."""
    return next((effect for effect in acting if isinstance(effect, Contact)), None)
