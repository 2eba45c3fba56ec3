"""Indicators of the effects that a case needs, estimated before anything is solved.

Hierarchical modelling chooses the parts of a model by an indicator of the modelling error (Oden and Prudhomme 2002,
doi 10.1006/jcph.2002.7183). Here the indicators are the displacement [mm] and the stress [MPa] due to an effect, estimated from
rest geometry, motion and parameters, and compared with tolerances. An isometric contraction causes stress and no displacement.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Indicator:
    """Indicator of an effect. ``estimate`` [mm]: the displacement of the surface due to the effect, root mean square at the worst
    frame. ``stress`` [MPa]: the maximum stress due to it. ``number``: the value from which both follow, computed by the ``rule``.
    """

    rule: str
    number: float
    estimate: float
    stress: float


@dataclass(frozen=True)
class Near:
    """Nearness of the free surface to a bone. ``gap`` [mm]: the guaranteed clearance, for any error of the estimated motion.
    ``depth`` [mm]: the possible penetration of the surface, rms at the worst frame. ``frame``: the first with the least gap.
    """

    gap: float
    depth: float
    frame: float


@dataclass(frozen=True)
class Estimates:
    """Estimates of a case before it is solved. Lengths in mm, times in s, moduli in MPa, densities in tonne/mm^3.

    ``length``, ``thickness``: size of the muscle. ``shear``: its shear modulus at rest. ``tension`` [MPa]: tension of its fibres at
    rest length, the mean over the frames. ``fixed``: the number of bones to which it is attached. ``sag``: the distance of its axis
    from the straight line between two of these bones. ``lean``: the inclination of fibres to this line, from 0 to 1. ``travel``:
    the maximum displacement of the surface due to the bones. ``stretch``: the minimum and the maximum stretch of the line between
    the attachments, used as stretch of the fibres. ``interval``: the time between frame numbers, None if not stated. ``speed``,
    ``sideways``, ``jump``, ``acceleration``: the maximum speed, sideways speed of the line, sudden change in velocity, and
    acceleration, per frame number. ``frames``: all frame numbers, and knots of ramps. ``tolerance`` [mm], ``stress_tolerance``
    [MPa]: an effect that changes results by less is not needed. ``near``: the nearness to each bone.
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
        """Displacement [mm], root mean square, of a Timoshenko beam with clamped ends under a ``force`` per volume [N/mm3]. Its
        length, thickness and shear modulus are those of the muscle; its Young's modulus is three times its shear modulus. The rms
        is 0.6 of the displacement in the middle; a factor of 1/2 is for stretching. For an unattached body it is the length.
        """
        if not self.fixed:
            return self.length
        squared = self.length**2
        middle = force / self.shear * (squared / 8 * 1.2 + squared**2 / (32 * 3 * self.thickness**2))
        return float(0.3 * middle) / (1 + self.taut(self.tension))

    def taut(self, pull: float) -> float:
        """Stiffness that the beam of :meth:`bend` gains from the ``pull`` [MPa] of its fibres, relative to bending stiffness."""
        return pull / self.shear * (self.length / self.thickness) ** 2 / 12

    def draw(self, force: float) -> float:
        """Shift [mm], root mean square, of a clamped bar along its axis by a ``force`` per volume [N/mm3]: 2/3 of the maximum."""
        return self.length**2 * force / (8 * 3 * self.shear) * 2 / 3 if self.fixed else self.length

    def lag(self, distance: float) -> float:
        """Lag [mm] of a body, below its travel; ``distance`` [mm] is the estimate without this bound."""
        return distance / (1 + distance / self.travel) if self.travel else 0.0

    def greatest(self, effect: Any) -> float:
        """The maximum amount of an ``effect`` over the frames."""
        return max(abs(float(effect.amount(frame))) for frame in self.frames)

    def straighten(self, pull: float) -> float:
        """Displacement [mm] of the surface, root mean square, as the ``pull`` [MPa] of fibres straightens a beam with clamped ends
        against its bending stiffness, at most 0.6 of its sag; inclined fibres also shear it. A beam with a free end shortens.
        """
        if self.fixed < 2:
            return self.shorten(pull, 0.3)
        return 0.6 * self.sag * self.taut(pull) / (1 + self.taut(pull)) + self.shorten(pull, 0.3) * self.lean

    def shorten(self, pull: float, share: float) -> float:
        """Displacement [mm] of the surface, root mean square, by fibres that ``pull`` [MPa]: at most ``share`` times the length."""
        return share * self.length * pull / (pull + 3 * self.shear)

    def in_time(self, rate: float) -> float:
        """A ``rate`` per frame number, converted to a rate per second; 0 if the frame interval is unknown."""
        return rate / self.interval if self.interval else 0.0
