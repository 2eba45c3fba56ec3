"""Case -> problem, whatever is solved in it."""

import logging
from collections.abc import Callable
from typing import Any

from fem_reference.problems import muscle, scalar
from fem_reference.problems.estimates import Decision, decisions, estimates
from fem_reference.problems.watch import Watch
from fem_reference.scenes.case import Case
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.scenes.scalar import ScalarCase

log = logging.getLogger(__name__)


def explained(case: Case, rest: Callable[[], Any] | None = None) -> tuple[Decision, ...]:
    """Of each effect of a case whether that needs it, and why, by its setup that ``rest`` gives, by default a new one; nothing of
    a scalar field, which needs all.
    """
    if not isinstance(case, MuscleCase):
        return ()
    return decisions(case, muscle.setup(case) if rest is None else rest())


def chosen[C: Case](case: C, rest: Callable[[], Any] | None = None) -> C:
    """The case with the effects that it needs, where it leaves that to be found out (as ``explained``); with ``decisions`` that
    say why.
    """
    if not isinstance(case, MuscleCase) or case.choice == "listed":
        return case
    found = explained(case, rest)
    for one in found:
        log.info("%s: %s", case.name, one)
    kept = tuple(one.effect for one in found if one.needed)
    return case.model_copy(update={"choice": "listed", "effect": kept, "decisions": found})


def watch(case: Case, rest: Any, built: Callable[[], Any]) -> Watch | None:
    """The watch for effects that the case left out, in frames that were solved; None where it left out none. ``rest`` is
    its setup, ``built`` gives its problem.
    """
    if not isinstance(case, MuscleCase) or all(one.needed for one in case.decisions):
        return None
    return Watch(case, rest, estimates(case, rest), built)


def with_effects[C: Case](case: C, found: tuple[Decision, ...]) -> C:
    """The case with the effects that were ``found`` to matter."""
    for one in found:
        log.info("%s: %s", case.name, one)
    new = {id(one.effect): one for one in found}
    made = tuple(new.get(id(one.effect), one) for one in case.decisions)
    kept = tuple(one.effect for one in made if one.needed)
    return case.model_copy(update={"effect": kept, "decisions": made})


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
