"""Indicators of the effects that a case needs, estimated before anything is solved.

Hierarchical modelling selects the parts of a model by indicators of the modelling error (Oden and Prudhomme 2002, doi
10.1006/jcph.2002.7183). Here the indicators of an effect are the displacement [mm] and the stress [MPa] that it causes. Both are
estimated from the rest geometry, the motion and the parameters, and compared with tolerances. Both are needed, because an isometric
contraction, for example, causes stress but no displacement.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Indicator:
    """Estimated size of an effect. ``estimate`` [mm]: the root mean square of the surface displacement due to the effect, in the
    frame in which it is largest. ``stress`` [MPa]: the maximum stress due to the effect. ``number``: the quantity from which
    ``estimate`` and ``stress`` are computed; ``rule`` describes this quantity in words.
    """

    rule: str
    number: float
    estimate: float
    stress: float


@dataclass(frozen=True)
class Near:
    """Distance between the free surface and a bone. ``gap`` [mm]: the minimum clearance over all frames, guaranteed for any error
    in the estimated motion. ``depth`` [mm]: the root mean square of the possible penetration of the surface, in the frame in which
    it is largest. ``frame``: the number of the first frame in which the gap is smallest.
    """

    gap: float
    depth: float
    frame: float


@dataclass(frozen=True)
class Estimates:
    """Estimates of a case before it is solved. Lengths in mm, times in s, moduli in MPa, densities in tonne/mm^3.

    ``length``, ``thickness``: the dimensions of the muscle. ``shear``: its shear modulus at rest. ``tension`` [MPa]: the tension of
    the fibres at rest length, averaged over the frames. ``fixed``: the number of bones to which the muscle is attached. ``sag``:
    the distance of the muscle's axis from the straight line between two of these bones. ``lean``: the inclination of the fibres to
    this line, from 0 to 1. ``travel``: the maximum displacement of the surface due to the bones. ``stretch``: the minimum and the
    maximum stretch of the line between the attachments, used as the stretch of the fibres. ``interval``: the time between
    consecutive frame numbers, None if it is not stated. ``speed``, ``sideways``, ``jump``, ``acceleration``: the maximum speed,
    speed perpendicular to the axis, sudden change in velocity, and acceleration, with the frame number as time. ``frames``: all
    frame numbers, and the knots of ramps. ``tolerance`` [mm], ``stress_tolerance`` [MPa]: an effect that changes results by less is
    not needed. ``near``: the distance to each bone.
    """

    length: float
    thickness: float
    shear: float
    tension: float
    fixed: int
    sag: float
    lean: float
    travel: float
    stretch: tuple[float, float]
    interval: float | None
    speed: float
    sideways: float
    jump: float
    acceleration: float
    frames: tuple[float, ...]
    tolerance: float
    stress_tolerance: float
    near: Mapping[str, Near] = field(default_factory=dict)

    def bend(self, force: float) -> float:
        """Rms displacement [mm] of the muscle, bent as a Timoshenko beam with clamped ends by a ``force`` per volume [N/mm3]. The
        beam has the length, thickness and shear modulus of the muscle; its Young's modulus is three times its shear modulus. The
        rms is 0.6 of the displacement at midspan, and a factor of 1/2 accounts for stretching. The result for an unattached
        body is its length.
        """
        if not self.fixed:
            return self.length
        squared = self.length**2
        middle = force / self.shear * (squared / 8 * 1.2 + squared**2 / (32 * 3 * self.thickness**2))
        return float(0.3 * middle) / (1 + self.taut(self.tension))

    def taut(self, pull: float) -> float:
        """Stiffness that the beam of :meth:`bend` gains from the ``pull`` [MPa] of its fibres, divided by its bending stiffness."""
        return pull / self.shear * (self.length / self.thickness) ** 2 / 12

    def draw(self, force: float) -> float:
        """Rms displacement [mm] of a clamped bar along its axis under a ``force`` per volume [N/mm3]: 2/3 of the maximum."""
        return self.length**2 * force / (8 * 3 * self.shear) * 2 / 3 if self.fixed else self.length

    def lag(self, distance: float) -> float:
        """Lag [mm] of a body: the estimated ``distance`` [mm], reduced so that it stays below the travel."""
        return distance / (1 + distance / self.travel) if self.travel else 0.0

    def greatest(self, effect: Any) -> float:
        """The maximum amount of an ``effect`` over the frames."""
        return max(abs(float(effect.amount(frame))) for frame in self.frames)

    def straighten(self, pull: float) -> float:
        """Rms displacement [mm] of the surface when the ``pull`` [MPa] of the fibres straightens the muscle, as a beam with clamped
        ends, against its bending stiffness: at most 0.6 of the sag. Inclined fibres also shear the beam; a beam with a free end
        shortens.
        """
        if self.fixed < 2:
            return self.shorten(pull, 0.3)
        return 0.6 * self.sag * self.taut(pull) / (1 + self.taut(pull)) + self.shorten(pull, 0.3) * self.lean

    def shorten(self, pull: float, share: float) -> float:
        """Rms displacement [mm] of the surface of a muscle whose fibres shorten it with a ``pull`` [MPa]. ``share``: the upper
        bound on the displacement, as a fraction of the length.
        """
        return share * self.length * pull / (pull + 3 * self.shear)

    def in_time(self, rate: float) -> float:
        """Convert a ``rate`` per frame number to a rate per second; 0 if the time between frame numbers is unknown."""
        return rate / self.interval if self.interval else 0.0
