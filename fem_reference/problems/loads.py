"""The sum of the external loads on a muscle, from its shape alone and without a solver's forms."""

from dataclasses import replace

from fem_reference.effects import Effect, region_of
from fem_reference.foundations.loads import Shape, Wrench, total
from fem_reference.foundations.mesh import Floats
from fem_reference.geometry.quadratic import Displaced
from fem_reference.problems.muscle import MuscleProblem


def external_load(
    problem: MuscleProblem, frame: float, by: Floats | None = None, velocity: Floats | None = None
) -> Wrench | None:
    """The sum of the external loads at a frame, for displacement and velocity of nodes as in ``Displaced``; None where it is not
    known from these alone. Without displacements its moment is NaN.
    """
    shape = Displaced(replace(problem.mesh, facets=problem.body.mesh.facets), by, velocity)
    acting = [(one.amount(frame), _resultant(one, shape)) for one in problem.effects]
    known = [Wrench(amount * one.force, amount * one.moment) for amount, one in acting if one is not None]
    return None if len(known) < len(acting) else total(known)


def _resultant(effect: Effect, shape: Shape) -> Wrench | None:
    """The force and moment of an effect on the whole body; None where it acts from outside on a region of it."""
    return None if effect.outer and region_of(effect) else effect.resultant(shape)
