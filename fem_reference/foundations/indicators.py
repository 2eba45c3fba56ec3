"""Whether a scene needs an effect: what is known before anything is solved, and the number that decides.

Hierarchical modelling decides what a model must have by an indicator of the modelling error (Oden and Prudhomme 2002,
doi 10.1006/jcph.2002.7183). Here that is an estimate of the displacement [mm] that the effect causes and one of the stress [MPa]
that it makes, of which forces, pressures and stretches follow, made of rest geometry, motion and parameters, beside the accuracy
that is asked for. An isometric contraction moves nothing and is all the stress that there is.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Indicator:
    """Indicator of an effect: the ``estimate`` [mm] of how far the surface moves by it, root mean square at the worst frame; the
    ``stress`` [MPa] that it makes, at most, there; the ``number`` that people know it by, and what that is, the ``rule``.
    """

    rule: str
    number: float
    estimate: float
    stress: float


@dataclass(frozen=True)
class Near:
    """How near the free surface may come to a bone: the smallest ``gap`` [mm] that is free whatever the guess of where the surface
    goes errs by; the ``depth`` [mm] to which it may get into the bone, root mean square over the surface, at the worst frame; and
    the first ``frame`` with the smallest gap.
    """

    gap: float
    depth: float
    frame: float


@dataclass(frozen=True)
class Estimates:
    """What is known of a scene before it is solved. Lengths in mm, times in s, moduli in MPa, densities in tonne/mm^3.

    ``length`` and ``thickness`` of the muscle, its ``shear`` modulus at rest, and the ``tension`` [MPa] of its
    fibres at their length at rest, the mean over the frames; ``fixed``: to how many bones; ``sag``: how far its
    axis gets from the straight line between two of them; ``lean``: by how much fibres lean against that line, from 0 to 1;
    ``travel``: how far its surface goes at most, by the motion of the bones;
    ``stretch`` of fibres, by that of the line from one attachment to the other, the smallest and the greatest; ``interval``
    from a frame number to the next, None where the scene does not say it; ``speed``, its part
    ``sideways`` of that line, ``jump`` (of velocity from one instant to the next) and ``acceleration``: the greatest, by frame
    numbers; ``frames``: all numbers, and knots of ramps; ``tolerance`` [mm] and ``stress_tolerance`` [MPa]:
    what an effect may change without being needed; ``near``: by bone, how near the surface comes.
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
        """How far [mm], root mean square, a ``force`` per volume [N/mm3] bends and shears a beam with clamped ends of this length,
        thickness and shear modulus, three of which are Young's (Timoshenko): 0.6 of its middle, halved, as what bends
        also stretches. What nothing fixes goes as far as it is long.
        """
        if not self.fixed:
            return self.length
        squared = self.length**2
        middle = force / self.shear * (squared / 8 * 1.2 + squared**2 / (32 * 3 * self.thickness**2))
        return float(0.3 * middle) / (1 + self.taut(self.tension))

    def taut(self, pull: float) -> float:
        """By how many times its own stiffness such a beam is stiffer where its fibres ``pull`` [MPa]."""
        return pull / self.shear * (self.length / self.thickness) ** 2 / 12

    def draw(self, force: float) -> float:
        """How far [mm], root mean square, a ``force`` per volume [N/mm3] along a bar with clamped ends shifts it: two thirds of its
        middle.
        """
        return self.length**2 * force / (8 * 3 * self.shear) * 2 / 3 if self.fixed else self.length

    def lag(self, distance: float) -> float:
        """How far [mm] a body is behind that forces hold back by a ``distance``: no more than it travels."""
        return distance / (1 + distance / self.travel) if self.travel else 0.0

    def greatest(self, effect: Any) -> float:
        """The greatest amount of an ``effect`` over the frames."""
        return max(abs(float(effect.amount(frame))) for frame in self.frames)

    def straighten(self, pull: float) -> float:
        """How far the surface moves, root mean square, where fibres ``pull`` [MPa] at a beam with clamped ends: 0.6 of its sag is
        the most that they can take out, and its stiffness in bending resists; those that lean shear it. One that has not two ends
        is free to shorten.
        """
        if self.fixed < 2:
            return self.shorten(pull, 0.3)
        return 0.6 * self.sag * self.taut(pull) / (1 + self.taut(pull)) + self.shorten(pull, 0.3) * self.lean

    def shorten(self, pull: float, share: float) -> float:
        """How far the surface moves, root mean square, where fibres ``pull`` [MPa] against the matrix: by a ``share`` of the length
        where they are far stronger.
        """
        return share * self.length * pull / (pull + 3 * self.shear)

    def in_time(self, rate: float) -> float:
        """A ``rate`` by frame numbers per second."""
        return rate / self.interval if self.interval else 0.0
