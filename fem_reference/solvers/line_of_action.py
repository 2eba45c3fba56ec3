"""Lines of action: each fibre is a line between bones that is straight, passes through via-points or wraps around obstacles.

Report sections 5.1 to 5.3. The ends of a line are those of the fibre, each fixed to the bone whose attachment is nearest at rest.
Between fixed points the line is as short as possible. It has a length and, with ``hill``, a force, but no surface, so only length
and force are judged. A line passes an obstacle on the shorter side, and switches sides when both are equally long.
"""

from itertools import pairwise
from typing import Annotated

import numpy as np
from pydantic import Field

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.records import Record, join, rule
from fem_reference.geometry.winding import Winding
from fem_reference.geometry.wrapping import Paths
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.setup import Bone
from fem_reference.runs.contents import vector_scalars
from fem_reference.runs.store import Frame, Outcome, Sink
from fem_reference.solvers.common.frame_loop import each
from fem_reference.solvers.common.hill import HillSettings
from fem_reference.solvers.common.lines import Lines, Passed, Via, lines_of
from fem_reference.solvers.common.protocol import MuscleSolver, Trade
from fem_reference.solvers.common.state_checks import Trouble
from fem_reference.solvers.common.wraps import ObstacleOn, Wraps, wraps_of


class LineSettings(Record):
    """Points through which lines pass, obstacles around which they wrap, and the forces of lines. By default lines are straight.

    ``via``: the via-points, in order along the fibre. ``via_count``: instead of ``via``, the number of via-points that are spread
    evenly over each fibre, each on the bone of the nearer end. ``obstacle``: surfaces around which a line wraps if the straight
    path between two fixed points would cross them. ``hill``: the muscle model that determines the forces of the lines.
    """

    via: tuple[Via, ...] = ()
    via_count: Annotated[int, Field(ge=0), Trade((0, 2, 4, 8))] = 0
    obstacle: tuple[ObstacleOn, ...] = ()
    hill: HillSettings | None = None

    _check_one = rule(lambda one: not (one.via and one.via_count), 'at most one of "via", "via_count"')
    _check_order = rule(
        lambda one: all(early.at < late.at for early, late in pairwise(one.via)),
        "via-points in the order in which a fibre passes them",
    )


class Shortest:
    """The ``lines`` of a muscle, which are at each frame as short as the obstacles in ``wraps`` allow."""

    advice = "a smaller radius may help"

    def __init__(self, problem: MuscleProblem, settings: LineSettings) -> None:
        self.problem, self.vias = problem, len(settings.via) + settings.via_count
        self.lines, self.wraps = _made(problem, settings, "line_of_action")
        self.cost = {"seconds_compile": 0.0}
        self.wrong: Trouble | None = None
        self.found = Frame(problem.frames[0], None)
        self.hill = settings.hill
        self.muscles = () if self.hill is None else self.hill.muscles(self.lengths(problem.frames[0]))

    def lengths(self, number: int) -> Floats:
        """The lengths (k,) [mm] of the lines at frame ``number``."""
        return _lengths(self.lines.at(number), self.wraps.around(self.lines.at(number).points, number))

    def move(self, number: int) -> None:
        """Compute the paths of the lines at frame ``number``."""
        passed = self.lines.at(number)
        wrong = self.wraps.inside(passed.points, number)[1]
        if not wrong:
            paths = self.wraps.around(passed.points, number)
            wrong = "no shortest path found for a line" if paths.failed.any() else ""
        if wrong:
            self.wrong = Trouble("diverged", wrong)
        else:
            points = paths.at(passed.part, passed.share)  # the number of points of each fibre stays the same
            lost = float((_lengths(passed, paths) - self.problem.fibres.lengths(points)).max())  # chords are shorter
            try:
                scalars = {"lost_by_chords_max": lost} | self._forces(passed, paths)
            except InputError as error:  # a line is too short or too long for the muscle model
                self.wrong = Trouble("diverged", str(error))
                return
            self.found = Frame(number, None, fibres=points, scalars=scalars)

    def _forces(self, passed: Passed, paths: Paths | Winding) -> dict[str, float]:
        """Scalars of a frame: the total force [N] of the lines, the mean fibre length divided by the optimal length, and the forces
        and moments on bones; empty without ``hill``.
        """
        if self.hill is None:
            return {}
        pairs = zip(self.muscles, _lengths(passed, paths).tolist(), strict=True)
        found = np.array([muscle.static(length, self.hill.activation) for muscle, length in pairs])
        sums = {"muscle_force": float(found[:, 0].sum()), "fibre_length_mean": float(found[:, 1].mean())}
        return sums | _on_bones(self.problem.bones, self.wraps, passed, paths, found[:, 0])

    def trouble(self) -> Trouble | None:
        """The trouble: a fixed point is inside an obstacle, no path was found, or a line has no force; None if there is none."""
        return self.wrong

    def frame(self, _: int) -> Frame:
        """The lines at the last frame for which ``move`` found them."""
        return self.found

    def ending(self) -> Outcome:
        """The outcome, always *converged*; its message states the number of via-points and the obstacles."""
        kind = f"straight, through {self.vias} via-points" if self.vias else "straight"
        around = f" or around {self.wraps}" if self.wraps.given else ""
        return Outcome("converged", f"{len(self.lines.fixed)} lines, {kind}{around}; no surface")


def solve(problem: MuscleProblem, settings: LineSettings, sink: Sink) -> Outcome:
    """Compute the lines at the requested frames, up to the first trouble.

    Raises InputError if a fixed point is inside an obstacle at the first frame.
    """
    return each(Shortest(problem, settings), problem.frames, problem.frames, sink)


def check(settings: LineSettings, problem: MuscleProblem, place: str) -> None:
    """Raise InputError, with a key inside ``place``, if lines with these via-points and obstacles are impossible."""
    _made(problem, settings, place)


def _made(problem: MuscleProblem, settings: LineSettings, place: str) -> tuple[Lines, Wraps]:
    """The lines and the obstacles. Raises InputError, with a key inside ``place``, if they are impossible at the first frame."""
    lines, first = lines_of(problem, settings.via, settings.via_count, place), problem.frames[0]
    wraps = wraps_of(problem, settings.obstacle, place)
    name, inside = wraps.inside(lines.at(first).points, first)
    if inside:
        raise InputError(join(place, name), inside, "an obstacle with all fixed points outside")
    return lines, wraps


def _lengths(passed: Passed, paths: Paths | Winding) -> Floats:
    """The lengths (k,) [mm] of lines: sums of the lengths of their parts."""
    return np.asarray(paths.lengths.reshape(len(passed.points), -1).sum(axis=1))


def _on_bones(
    bones: tuple[Bone, ...], wraps: Wraps, passed: Passed, paths: Paths | Winding, tensions: Floats
) -> dict[str, float]:
    """The components of the force [N] and of the moment about the origin [N mm] on each bone, by the name of the scalar.

    ``tensions`` (k,) [N]: the forces of the lines. Each part of a line pulls at both of its ends, along the path. An obstacle
    receives the pull of the line on both sides of the contact, because a line without weight is in equilibrium there.
    """
    fixed, on_bone = passed.points, passed.on
    pulls = np.repeat(tensions, fixed.shape[1] - 1)[:, None]
    first, last = (pulls * ends for ends in paths.directions())
    starts, ends = fixed[:, :-1].reshape(-1, 3), fixed[:, 1:].reshape(-1, 3)
    by = [(on_bone[:, :-1].ravel(), starts, first), (on_bone[:, 1:].ravel(), ends, -last)]
    if wraps.given:
        of_obstacle = np.array([bones.index(bone) for bone in wraps.bones])
        for touch in paths.touching():
            around = of_obstacle[touch.obstacles]
            by += [(around, touch.met, -pulls * touch.into), (around, touch.left, pulls * touch.out)]
    on, places, forces = (np.concatenate(parts) for parts in zip(*by, strict=True))
    found = dict[str, float]()
    for i, bone in enumerate(bones):
        found |= vector_scalars(f"force_on_{bone.name}", forces[on == i].sum(axis=0))
        found |= vector_scalars(f"moment_on_{bone.name}", np.cross(places, forces)[on == i].sum(axis=0))
    return found


SOLVES = (MuscleSolver(settings=LineSettings, solve=solve, moves="lines", check_problem=check, example={}),)
