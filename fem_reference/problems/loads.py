"""The sum of the external loads on a muscle, computed from its shape, without the forms of a solver."""

from dataclasses import replace

from fem_reference.effects import region_of
from fem_reference.foundations.loads import Wrench, total
from fem_reference.foundations.mesh import Floats
from fem_reference.geometry.quadratic import Displaced
from fem_reference.problems.muscle import MuscleProblem


def external_load(
    problem: MuscleProblem, frame: float, by: Floats | None = None, velocity: Floats | None = None
) -> Wrench | None:
    """The sum of the external loads on a muscle at a ``frame``. ``by``, ``velocity``: the displacements and velocities of nodes, as
    in ``Displaced``. The result is None if these do not determine the sum; its moment is NaN without displacements.
    """
    shape = Displaced(replace(problem.mesh, facets=problem.body.mesh.facets), by, velocity)
    known = list[Wrench]()
    for effect in problem.effects:
        whole = None if effect.outer and region_of(effect) else effect.resultant(shape)
        if whole is None:
            return None
        known.append(Wrench(*(effect.amount(frame) * part for part in whole)))
    return total(known)
