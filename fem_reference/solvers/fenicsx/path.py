"""States of a body: signs of a jump between successive states, and the reuse of earlier states."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI

from fem_reference.foundations.limits import ENERGY_GAP
from fem_reference.foundations.mesh import Floats, place_of
from fem_reference.solvers.common.state_checks import Trouble
from fem_reference.solvers.fenicsx.determinants import Determinants, Extreme
from fem_reference.solvers.fenicsx.system import System

# On the straight line from one state to the next, det F is a cubic polynomial. It has to stay above this fraction of the smaller of
# its end values. A rotation by 143 degrees within a step reduces det F to a tenth; a rotation by 180 degrees, or a mirrored state
# on the line, reduces it to 0 or below.
KEPT = 0.1
_SHARES = (0.0, 1 / 3, 2 / 3, 1.0)
_CUBIC = np.linalg.inv(np.vander(_SHARES, 4))  # converts values at these fractions to the coefficients of a cubic

# Loads and boundary conditions count as the same up to this difference, due to rounding (in mm, and in entries of a pose).
_SAME = 1e-9
# The latest states are kept, up to this memory [bytes] on each rank.
_MOST = 512e6


class Path:
    """Watches the successive states of a ``system`` for jumps. Its methods are collective."""

    def __init__(self, system: System, determinants: Determinants) -> None:
        self.system, self.determinants = system, determinants
        self.energy, self.greatest, self.gap = 0.0, 0.0, 0.0
        self.unknowns, self.forces = np.array(system.unknowns.x.array), self.system.reactions(inside=True)

    def jumped(self, before: Floats) -> Extreme | None:
        """The smallest det F, divided by the smaller of its end values, on the straight line from the unknowns ``before`` to the
        current ones; None if it exceeds ``KEPT``, as it does in a body that deforms steadily in small steps.
        """
        unknowns = self.system.unknowns.x
        after, values = np.array(unknowns.array), []
        for share in _SHARES:
            unknowns.array[:] = before + share * (after - before)
            values.append(self.determinants.values_now())
        unknowns.array[:] = after
        ends = np.minimum(values[0], values[-1])
        found = self.determinants.smallest_of(least(np.array(values)) / np.where(ends > 0, ends, np.nan))
        return None if found.value > KEPT else found

    def trouble(self, before: Floats, /) -> Trouble | None:
        """The trouble *diverged* if the step from the unknowns ``before`` leads to another path."""
        jump = self.jumped(before)
        if jump is None:
            return None
        place = f"in cell {jump.cell} at {place_of(jump.at)}"
        way = "on the straight line from the last state det F falls to"
        return Trouble("diverged", f"to a state on another path: {way} {jump.value:.2g} of its end value, {place}")

    def settle(self, energy: float, halfway: Callable[[], bool] | None = None, *, connected: bool = True) -> None:
        """Accept the current state as the next one, with the stored ``energy`` [N mm]. If it is ``connected`` with the previous
        state, compare the growth of the energy with the work of the internal forces, by the trapezoidal rule.

        The rule is exact if forces are linear in the displacement. Its error is of second order in the step; for a law that
        stiffens, or a rotation, it is some tenths of the energy in the first step from rest. So if the difference exceeds
        ``ENERGY_GAP``, the function ``halfway`` is called: it solves for a state halfway, leaves it in the unknowns, which are
        restored afterwards, and returns True if it succeeds. Simpson's rule is then used, whose error is of fourth order. In a
        jump, either rule shows a decrease of the energy without work. ``gap``: the largest difference since it was last read,
        divided by the maximum energy.
        """
        states = [
            (self.unknowns, self.forces),
            (np.array(self.system.unknowns.x.array), self.system.reactions(inside=True)),
        ]
        self.greatest = max(self.greatest, energy)
        if connected and self.greatest > 0:
            gap = self._gap(energy, states)
            if halfway and abs(gap) > ENERGY_GAP and halfway():
                states.insert(1, (np.array(self.system.unknowns.x.array), self.system.reactions(inside=True)))
                gap = self._gap(energy, states)
            self.system.unknowns.x.array[:] = states[-1][0]
            self.gap = gap if abs(gap) > abs(self.gap) else self.gap
        self.energy, (self.unknowns, self.forces) = energy, states[-1]

    def _gap(self, energy: float, states: list[tuple[Floats, Floats]]) -> float:
        """The growth of the energy, up to the last of ``states``, that no work explains, divided by the maximum energy so far.
        ``states``: the unknowns and forces of two states, or of three states at equal intervals of time.
        """
        own = self.system.owned
        work = sum(float(np.dot(forces[:own], moves[:own])) for forces, moves in _products(states))
        work = float(self.system.unknowns.function_space.mesh.comm.allreduce(work, MPI.SUM))
        return (energy - self.energy - work) / self.greatest

    def take_gap(self) -> float:
        """Return the gap and reset it to 0."""
        gap, self.gap = self.gap, 0.0
        return gap


def _products(states: list[tuple[Floats, Floats]]) -> list[tuple[Floats, Floats]]:
    """Pairs of weighted forces and the displacements over which they do work: for two ``states`` by the trapezoidal rule on a
    straight line, for three by Simpson's rule on a parabola over time.
    """
    if len(states) == 2:
        (start, first), (end, last) = states
        return [((first + last) / 2, end - start)]
    (start, first), (between, middle), (end, last) = states
    bend = 4 * between - start - end  # the rates at the ends, times the total time, are bend - 2 start and 2 end - bend
    return [(first / 6, bend - 2 * start), (4 * middle / 6, end - start), (last / 6, 2 * end - bend)]


def least(values: Floats) -> Floats:
    """The minimum (p,) between 0 and 1 of the cubics with ``values`` (4, p) at 0, 1/3, 2/3 and 1.

    >>> abs(least(np.array([[1.0], [1 / 9], [1 / 9], [1.0]]))).round(12).tolist()
    [0.0]
    """
    a, b, c, _ = coefficients = _CUBIC @ values
    found = np.minimum(values[0], values[-1])
    with np.errstate(invalid="ignore", divide="ignore"):
        root = np.sqrt(b**2 - 3 * a * c)
        # The turning points, each in two forms, of which one is accurate if the cubic term almost vanishes.
        turns = [-c / (b + root), -c / (b - root), (-b + root) / (3 * a), (-b - root) / (3 * a)]
    for turn in turns:
        inside = np.isfinite(turn) & (turn > 0) & (turn < 1)
        share = np.where(inside, turn, 0.0)
        found = np.minimum(found, ((coefficients[0] * share + b) * share + c) * share + coefficients[3])
    return np.asarray(found)


@dataclass(frozen=True, eq=False)
class KnownState:
    """The ``unknowns`` (n,) of an equilibrium, the values ``acting`` (m,) that determine it, and its ``negative_modes``."""

    acting: Floats
    unknowns: Floats
    negative_modes: float | None


class Known:
    """The states of a run so far; all ranks of ``comm`` store the same states."""

    def __init__(self, comm: MPI.Comm) -> None:
        self.comm = comm
        self.states: list[KnownState] = []

    def add(self, state: KnownState) -> None:
        """Store a state, which is in equilibrium, and drop the oldest states beyond the limit on memory."""
        self.states.append(state)
        size = self.comm.allreduce(state.unknowns.nbytes + state.acting.nbytes, MPI.MAX)
        del self.states[: max(0, len(self.states) - max(1, int(_MOST / size)))]

    def find(self, acting: Floats) -> KnownState | None:
        """The state with the values ``acting`` (m,); None if there is none."""
        same = np.array([np.abs(one.acting - acting).max(initial=0.0) <= _SAME for one in self.states], bool)
        self.comm.Allreduce(MPI.IN_PLACE, same, MPI.LAND)
        return self.states[int(np.argmax(same))] if same.any() else None
