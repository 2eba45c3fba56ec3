"""Case -> set-up and problem, of a muscle or a scalar field."""

import logging
from collections.abc import Callable
from typing import Protocol, overload

from fem_reference.foundations.errors import InputError
from fem_reference.geometry.exemption import Exemption
from fem_reference.problems import contents, muscle, scalar
from fem_reference.problems.body import Body
from fem_reference.problems.estimates import Decision, decisions, estimates
from fem_reference.problems.guess import described_motion
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.problem import Meshed, Problem
from fem_reference.problems.scalar import FieldProblem
from fem_reference.problems.setup import Bone, Setup
from fem_reference.problems.watch import Watch
from fem_reference.scenes.case import Case
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.scenes.scalar import ScalarCase

log = logging.getLogger(__name__)


class CaseSetup(Problem, Protocol):
    """A case before meshing, with all that judging its runs needs: the ``Setup`` of a muscle, or the whole ``FieldProblem``."""

    @property
    def exact(self) -> str | None:
        """The formula of the solution, where known."""

    @property
    def bones(self) -> tuple[Bone, ...]:
        """The bones; a scalar field has none."""

    @property
    def exempt(self) -> Exemption | None:
        """The part of the surface that is exempt from contact with bones, where there is a surface."""

    @property
    def body(self) -> Body | None:
        """The finite element body of a muscle, once it is filled."""

    @property
    def field(self) -> FieldProblem | None:
        """The scalar field, None for a muscle."""


class CaseProblem(CaseSetup, Meshed, Protocol):
    """The problem of a case as a solver receives it: the ``MuscleProblem`` of a muscle, or the ``FieldProblem``."""

    @property
    def muscle(self) -> MuscleProblem | None:
        """The muscle, None for a scalar field."""


def explained(case: Case, rest: Callable[[], CaseSetup] | None = None) -> tuple[Decision, ...]:
    """Decisions on whether a case needs each of its effects, and why, from the set-up that ``rest`` gives, by default a new one;
    empty for a scalar field, which needs all.
    """
    if not isinstance(case, MuscleCase):
        return ()
    known = muscle.setup(case) if rest is None else rest()
    assert isinstance(known, Setup)  # of a muscle
    return decisions(case, known)


def facts(case: Case, setup: CaseSetup) -> dict[str, object]:
    """Facts on the contents of a case, as words and numbers by name."""
    if isinstance(case, MuscleCase) and isinstance(setup, Setup):
        return contents.of_muscle(setup, case)
    assert isinstance(setup, FieldProblem)  # there are no other types
    return contents.of_field(setup, case)


def known(case: Case, setup: CaseSetup) -> dict[str, object]:
    """The effect of the bones' motion on a muscle, and why it needs its effects, in words; empty for a scalar field."""
    if not isinstance(case, MuscleCase) or not isinstance(setup, Setup):
        return {}
    found = case.decisions or explained(case)
    effects = {one.effect.title: str(one).partition(": ")[2] for one in found}
    motion = described_motion(setup)
    return ({"motion": motion} if motion else {}) | {"effects": effects}


def chosen[C: Case](case: C, rest: Callable[[], CaseSetup] | None = None) -> C:
    """The case with the effects that it needs, where it leaves them to be determined (as ``explained``), and the ``decisions``
    with their reasons.
    """
    if not isinstance(case, MuscleCase) or case.choice == "listed":
        return case
    found = explained(case, rest)
    for one in found:
        log.info("%s: %s", case.name, one)
    kept = tuple(one.effect for one in found if one.needed)
    return case.model_copy(update={"choice": "listed", "effect": kept, "decisions": found})


def watch(case: Case, rest: CaseSetup, built: Callable[[], CaseProblem]) -> Watch | None:
    """The watch for effects that the case omitted, in solved frames; None where it omitted none. ``rest`` is its set-up,
    ``built`` gives its problem.
    """
    if not isinstance(case, MuscleCase) or all(one.needed for one in case.decisions):
        return None
    assert isinstance(rest, Setup)  # of a muscle
    return Watch(case, rest, estimates(case, rest), built)


def with_effects[C: Case](case: C, found: tuple[Decision, ...]) -> C:
    """The case with the effects that were ``found`` to matter."""
    for one in found:
        log.info("%s: %s", case.name, one)
    new = {id(one.effect): one for one in found}
    made = tuple(new.get(id(one.effect), one) for one in case.decisions)
    kept = tuple(one.effect for one in made if one.needed)
    return case.model_copy(update={"effect": kept, "decisions": made})


def scalar_case(case: Case, place: str | None = None) -> ScalarCase:
    """The ``case`` itself where it has a scalar field; else InputError at ``place``, by default the file of the case."""
    if not isinstance(case, ScalarCase):
        raise InputError(place or case.place, f'"{case.name}", the case of a muscle', "a scalar case")
    return case


@overload
def setup(case: MuscleCase) -> Setup: ...
@overload
def setup(case: ScalarCase) -> FieldProblem: ...
@overload
def setup(case: Case) -> CaseSetup: ...
def setup(case: Case) -> CaseSetup:
    """The set-up of a case. InputError names what is unusable."""
    if isinstance(case, MuscleCase):
        return muscle.setup(case)
    assert isinstance(case, ScalarCase)  # there are no other types
    return scalar.build(case)


def problem(case: Case, rest: CaseSetup) -> CaseProblem:
    """The problem of a case, made of its set-up ``rest``: a muscle is filled with tetrahedra."""
    if not isinstance(case, MuscleCase):
        assert isinstance(rest, FieldProblem)
        return rest
    assert isinstance(rest, Setup)
    size = case.muscle.tet_size / 2**case.muscle.refinements
    log.info("%s: filling the muscle with tetrahedra of %g mm", case.name, size)
    built = muscle.build(case, rest)
    facts = built.mesh_facts
    log.info("%s: %d tetrahedra, quality at least %.2f", case.name, facts["tets"], facts["quality_min"])
    return built
