"""Case -> problem, whatever is solved in it."""

import logging
from typing import Any

from fem_reference.problems import muscle, scalar
from fem_reference.scenes.case import Case
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.scenes.scalar import ScalarCase

log = logging.getLogger(__name__)


def setup(case: Case) -> Any:
    """What is known of a case before it is meshed, and all that judging its runs needs: a muscle's ``Setup``, or the whole
    ``FieldProblem``. InputError names what is not usable.
    """
    if isinstance(case, MuscleCase):
        return muscle.setup(case)
    assert isinstance(case, ScalarCase)  # there are no others
    return scalar.build(case)


def problem(case: Case, rest: Any) -> Any:
    """What a solver of the case needs, made of its setup ``rest``: a muscle's ``Problem``, filled with tetrahedra, or the
    ``FieldProblem``.
    """
    if not isinstance(case, MuscleCase):
        return rest
    size = case.muscle.tet_size / 2**case.muscle.refinements
    log.info("%s: filling the muscle with tetrahedra of %g mm", case.name, size)
    built = muscle.build(case, rest)
    facts = built.mesh_facts
    log.info("%s: %d tetrahedra, quality at least %.2f", case.name, facts["tets"], facts["quality_min"])
    return built
