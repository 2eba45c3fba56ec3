"""A Hill-type muscle: a contractile and a parallel element at a pennation angle, in series with a tendon (report 5.1, Figure 5.1).

Forces are divided by the maximum isometric force F0 and fibre lengths by the optimal length l0. Velocities are positive in
shortening (eq. 5.1). The curves are those of Thelen (2003, doi 10.1115/1.1531112), with the constants of OpenSim's
``Thelen2003Muscle``; the structure is that of Zajac (1989), and the hyperbola (eq. 5.1) is that of Hill. The constants of the
hyperbola follow from a / F0 and the maximum shortening velocity vmax: ``b = a / F0 vmax``. Unlike in Thelen's model, vmax does not
depend on the activation.
"""

import math
from itertools import pairwise
from typing import Annotated

import numpy as np
import scipy
from pydantic import Field

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.records import Record
from fem_reference.foundations.units import Angle, Force, PositiveLength

# Constants of Thelen 2003 for young adults: the width of the active curve, the shape of the passive curve, its strain at F0, the
# strain of the tendon at F0, and the maximum force [F0] in lengthening.
_WIDTH, _PASSIVE, _PASSIVE_STRAIN, _TENDON_STRAIN, _LENGTHENING = 0.45, 5.0, 0.6, 0.04, 1.4
# The toe of the tendon's curve ends at the fraction _TOE of F0 and has the shape _TOE_SHAPE; beyond the toe the curve is a tangent.
_TOE, _TOE_SHAPE = 0.33, 3.0
_TOE_SLOPE = _TOE * _TOE_SHAPE * math.exp(_TOE_SHAPE) / math.expm1(_TOE_SHAPE)  # slope at its end times strain there
_TOE_STRAIN = _TENDON_STRAIN * _TOE_SLOPE / (_TOE_SLOPE + 1 - _TOE)
# Fibre lengths [l0] in equilibrium are sought between _SHORTEST and _LONGEST in steps of about _STEP.
_SHORTEST, _LONGEST, _STEP = 0.1, 3.0, 0.0075
_SLACK = 1e-9  # a tendon whose strain is below this, which may be rounding, is slack
_LEAST = 1e-3  # the lower bound of the activation when a velocity is computed from a force


class Hill(Record):
    """A muscle and its tendon.

    ``max_force`` [N]: the maximum isometric force F0. ``optimal_length`` [mm]: the optimal fibre length l0. ``slack_length`` [mm]:
    the slack length of the tendon. ``pennation`` [rad]: the angle between tendon and fibres of optimal length. ``max_velocity``
    [l0 / s]: the velocity of shortening without load. ``curvature``: a / F0 of eq. 5.1.
    """

    max_force: Force
    optimal_length: PositiveLength
    slack_length: PositiveLength
    pennation: Annotated[Angle, Field(ge=0, lt=1.2)] = 0.0
    max_velocity: Annotated[float, Field(gt=0)] = 10.0
    curvature: Annotated[float, Field(gt=0, le=1)] = 0.25

    @property
    def thickness(self) -> float:
        """The distance [l0] between the two layers that the fibres connect, which is constant."""
        return math.sin(self.pennation)

    def cosine(self, fibre: float) -> float:
        """The cosine of the pennation angle at a ``fibre`` length [l0]."""
        return math.sqrt(max(1 - (self.thickness / fibre) ** 2, 0.0))

    def tendon_force(self, path: float, fibre: float) -> float:
        """The tendon force [F0] for the length of the ``path`` [mm] from origin to insertion and a ``fibre`` length [l0]."""
        along = self.optimal_length * fibre * self.cosine(fibre)
        return tendon((path - along) / self.slack_length - 1)

    def imbalance(self, path: float, fibre: float, activation: float) -> float:
        """The component of the fibre force along the tendon at zero velocity, minus the tendon force [F0]."""
        return (activation * active(fibre) + passive(fibre)) * self.cosine(fibre) - self.tendon_force(path, fibre)

    def static(self, path: float, activation: float) -> tuple[float, float]:
        """The force [N] and the fibre length [l0] in static equilibrium, that is, at zero velocity.

        If there are several equilibria, this is the one with the shortest fibre. A slack tendon has no force. Raises InputError if
        fibres would be shorter than 0.1 l0 or longer than 3 l0.
        """
        low = max(_SHORTEST, 1.0001 * self.thickness)
        if self.tendon_force(path, low) == 0:
            return 0.0, low
        high = min(self._fibre(path, -_SLACK), _LONGEST)
        low = min(max(low, self._fibre(path, _strain(1 + passive(high)))), high)  # below, the tendon is stronger
        lengths = np.linspace(low, high, 2 + int((high - low) / _STEP))
        pulls = np.array([self.imbalance(path, one, activation) for one in lengths.tolist()]) >= 0
        found = int(np.argmax(pulls))
        if found == 0:
            want = f"a path on which fibres have {_SHORTEST:g} to {_LONGEST:g} times their optimal length"
            raise InputError("hill", f"a path of {path:.4g} mm", want)
        bracket = lengths[found - 1], lengths[found]
        fibre = float(scipy.optimize.brentq(lambda one: self.imbalance(path, one, activation), *bracket, xtol=1e-13))
        return self.max_force * self.tendon_force(path, fibre), fibre

    def _fibre(self, path: float, strain: float) -> float:
        """The fibre length [l0] at which the tendon has a given ``strain``."""
        along = (path - self.slack_length * (1 + strain)) / self.optimal_length
        return math.hypot(max(along, 0.0), self.thickness)

    def velocity(self, path: float, fibre: float, activation: float) -> float:
        """The velocity of shortening [l0 / s] at which the fibres are in equilibrium with the tendon."""
        cosine = max(self.cosine(fibre), 1e-6)
        force = (self.tendon_force(path, fibre) / cosine - passive(fibre)) / (max(activation, _LEAST) * active(fibre))
        return self.max_velocity * inverse_hyperbola(force, self.curvature)

    def follow(
        self, times: Floats, paths: Floats, activations: Floats, tolerance: float = 1e-9
    ) -> tuple[Floats, Floats]:
        """The forces (n,) [N] and fibre lengths (n,) [l0] at ``times`` (n,) [s], starting from static equilibrium.

        ``paths`` (n,) [mm] and ``activations`` (n,): values at these times, between which they are interpolated linearly.
        """
        _, first = self.static(float(paths[0]), float(activations[0]))

        def rate(time: float, fibre: Floats) -> list[float]:
            path, activation = (float(np.interp(time, times, values)) for values in (paths, activations))
            return [-self.velocity(path, float(fibre[0]), activation)]

        lengths = [first]
        for start, end in pairwise(times):  # one by one, as slopes of paths and activations jump between intervals
            found = scipy.integrate.solve_ivp(
                rate, (start, end), [lengths[-1]], method="LSODA", rtol=tolerance, atol=tolerance
            )
            lengths.append(float(found.y[0, -1]))
        shares = [self.tendon_force(float(path), one) for path, one in zip(paths, lengths, strict=True)]
        return self.max_force * np.array(shares), np.array(lengths)


class HillSettings(Record):
    """Settings of lines that are equally strong Hill-type muscles with tendons, in equilibrium at each frame (report 5.1).

    ``max_force``: the sum of the maximum isometric forces of all lines. ``fibre_share``: the optimal fibre length of a line divided
    by the length of the line at the first frame, where the tendon is just slack. ``pennation``: the angle between fibres and tendon
    at the optimal fibre length. ``activation``: the activation, from 0 to 1.
    """

    max_force: Force
    fibre_share: Annotated[float, Field(gt=0, lt=1)]
    pennation: Annotated[Angle, Field(ge=0, lt=1.2)] = 0.0
    activation: Annotated[float, Field(ge=0, le=1)] = 1.0

    def muscles(self, lengths: Floats) -> tuple[Hill, ...]:
        """The muscle of each line, for lines with ``lengths`` (k,) [mm] at the first frame."""
        share, angle = self.fibre_share, self.pennation
        return tuple(
            Hill.model_construct(
                max_force=self.max_force / len(lengths),
                optimal_length=share * length,
                slack_length=(1 - share * math.cos(angle)) * length,
                pennation=angle,
            )
            for length in lengths.tolist()
        )


def active(fibre: float) -> float:
    """The force [F0] of the contractile element at full activation and a ``fibre`` length [l0]; 1 at the optimal length."""
    return math.exp(-((fibre - 1) ** 2) / _WIDTH)


def passive(fibre: float) -> float:
    """The force [F0] of the parallel element at a ``fibre`` length [l0]; 0 up to the optimal length."""
    return max(math.expm1(_PASSIVE * (fibre - 1) / _PASSIVE_STRAIN) / math.expm1(_PASSIVE), 0.0)


def tendon(strain: float) -> float:
    """The force [F0] of the tendon at a ``strain``: 0 if it is slack, then an exponential toe, then the tangent at its end."""
    if strain <= 0:
        return 0.0
    if strain <= _TOE_STRAIN:
        return _TOE * math.expm1(_TOE_SHAPE * strain / _TOE_STRAIN) / math.expm1(_TOE_SHAPE)
    return _TOE + (1 - _TOE) * (strain - _TOE_STRAIN) / (_TENDON_STRAIN - _TOE_STRAIN)


def _strain(force: float) -> float:
    """The strain of the tendon at a ``force`` [F0] beyond its toe."""
    return _TOE_STRAIN + (force - _TOE) / (1 - _TOE) * (_TENDON_STRAIN - _TOE_STRAIN)


def inverse_hyperbola(force: float, curvature: float) -> float:
    """The velocity of shortening divided by its maximum, at a ``force`` divided by the isometric force: eq. 5.1 solved for v.

    In lengthening the force rises to 1.4 times the isometric force along a hyperbola that is twice as steep at velocity 0 (Thelen
    2003). Beyond their ends, the curves of shortening and lengthening continue as tangents.
    """
    slope, rise = 2 * (1 + 1 / curvature), _LENGTHENING - 1
    if force < 0:  # shortening faster than without load
        return 1 - force * (1 + 1 / curvature)
    if force <= 1:
        return (1 - force) / (1 + force / curvature)
    most = 1 + 0.95 * rise
    inner = min(force, most)
    found = -rise * (inner - 1) / (slope * (rise - (inner - 1)))
    steep = rise**2 / (slope * (rise - (most - 1)) ** 2)
    return found - steep * max(force - most, 0.0)
