"""The reference: P2 displacement, P1 pressure (Taylor-Hood) on tetrahedra, quasi-static, solved by Newton's method in FEniCSx.

This module itself does not import FEniCSx. ``session`` runs ``worker`` in a subprocess (under ``mpiexec`` for more than one rank),
passes the problem to it in a file, and hands on each frame that it reports. If the worker dies, the status is *crashed*.
"""

import logging
from dataclasses import replace
from functools import partial
from itertools import chain
from typing import Protocol

import numpy as np

from fem_reference.effects import Effect
from fem_reference.effects.in_situ import among
from fem_reference.effects.touching import MuscleContact
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.foundations.motion import apply
from fem_reference.foundations.records import join
from fem_reference.geometry.embedding import Locator
from fem_reference.geometry.quadratic import quadratic
from fem_reference.problems.body import check_element, check_quadrature, check_stiffness
from fem_reference.problems.loads import external_load
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.muscles import MusclesProblem
from fem_reference.problems.tendons import force_name
from fem_reference.runs.contents import vector_scalars
from fem_reference.runs.results import Results
from fem_reference.runs.store import Frame, Outcome, Sink
from fem_reference.runs.stress_statistics import stress_scalars, volume_ratio
from fem_reference.runs.views import force_between, frame_of
from fem_reference.runs.writer import CutOff
from fem_reference.solvers.common.protocol import BodySolver, FieldSolver, MuscleSolver
from fem_reference.solvers.fenicsx import resources
from fem_reference.solvers.fenicsx.jobs import Job, Kept, kept
from fem_reference.solvers.fenicsx.processes import command_line, mpiexec, require_installed
from fem_reference.solvers.fenicsx.session import opened, session, shared, solve_body, solve_on, solve_scalar
from fem_reference.solvers.fenicsx.settings import BodySettings, FieldSettings, Settings

log = logging.getLogger(__name__)

AnyMuscle = MuscleProblem | MusclesProblem

__all__ = ["BodySettings", "FieldSettings", "Settings", "session", "shared", "solve_body", "solve_field"]


def require(settings: BodySettings | FieldSettings) -> None:
    """Raise MissingSoftware if FEniCSx (or, for several ranks, ``mpiexec``) is missing, and InputError for too many ranks."""
    require_installed()
    if isinstance(settings, Settings):
        command_line(settings.ranks or 1)


def check_effects(settings: Settings, effects: tuple[Effect, ...], place: str) -> None:
    """Raise InputError, naming ``place`` or a key inside it, unless the laws resist both shear and a change of volume, the element
    suits tetrahedra and the effects, and the number of ranks suits the linear solver.
    """
    if any(isinstance(one, MuscleContact) for one in effects):
        _check_touching(settings, place)
    _check_ranks(settings, join(place, "ranks"))
    check_stiffness(effects, place)
    check_element(settings.element, "tetrahedron", 1, effects, join(place, "element"))
    check_quadrature(settings.element, settings.quadrature_degree, join(place, "quadrature_degree"))


def solve(problem: AnyMuscle, settings: Settings, sink: Sink) -> Outcome:
    """Solve every requested frame in worker processes. Each frame contains the surface, the fibres and the tets."""
    require(settings)
    return _solve(problem, settings, sink, None)


def go_on(problem: AnyMuscle, settings: Settings, sink: Sink, cut_off: CutOff) -> Outcome:
    """Continue an interrupted run from its last stored frame, and delete earlier states that are no longer needed."""
    require(settings)
    there = kept(cut_off, problem.body)
    again = settings.reuse and not _has_steps(problem)  # True if earlier states may be reused
    if there.frames:
        log.info("an earlier run was interrupted; continuing from its stored frames, up to frame %d", there.frames[-1])

    def pass_on(frame: Frame) -> None:
        sink(frame)
        if not again:
            for number in problem.frames[: problem.frames.index(frame.number)]:
                there.place(number).unlink(missing_ok=True)

    return _solve(problem, settings, pass_on, there)


def _solve(problem: AnyMuscle, settings: Settings, sink: Sink, kept: Kept | None) -> Outcome:
    body, chosen = problem.body, _planned(problem, settings)
    describe = _describing(problem, settings)
    passed: list[float] = list(kept.frames) if kept else []

    def pass_on(frame: Frame) -> None:  # drops frames before the first requested one: they remove overlaps at rest
        if frame.number in problem.frames:
            described = describe(frame, is_first=not passed)
            sink(described if chosen.store_state else replace(described, state=None))
            passed.append(frame.number)

    with opened(chosen.ranks or 1) as solver:
        outcome = solver.run(Job(body, chosen, _samples(problem), kept), chosen.time_limit, pass_on)
    if outcome.status != "converged" and body.frames[0] < body.first and not passed:
        begin = "while an overlap at rest was removed, before the first frame (which shows the given rest state)"
        outcome = replace(outcome, message=f"{begin}: {outcome.message}")
    key = " (muscle.tet_size)" if outcome.message.endswith("smaller cells") else ""  # the key in a scene
    return replace(outcome, message=outcome.message + key, cost={"seconds_mesh": problem.seconds} | outcome.cost)


class _Describe(Protocol):
    def __call__(self, frame: Frame, /, *, is_first: bool) -> Frame: ...


def _describing(problem: AnyMuscle, settings: Settings) -> _Describe:
    """The function that adds a note and scalars to a frame. With several muscles each scalar is named ``<muscle>.<scalar>``."""
    if isinstance(problem, MuscleProblem):
        return partial(_described, problem, loads=_are_known(problem, settings))
    spans, names = problem.spans, tuple(problem.problems)
    each = {name: _describing(one, settings) for name, one in problem.problems.items()}

    def describe(frame: Frame, /, *, is_first: bool) -> Frame:
        own, note = dict[str, float](), ""
        for span in spans:
            others = tuple(name for name in names if name != span.name)
            part = frame_of(frame, span, others)
            one = each[span.name](part, is_first=is_first)
            assert part.state is not None  # a muscle's frame has a state
            own[f"{span.name}.volume_ratio"] = volume_ratio(problem.problems[span.name].mesh, part.state)
            new = {key: value for key, value in one.scalars.items() if key not in frame.scalars}
            for other in others:
                new |= _on_other(frame, span.name, other)
            own |= {f"{span.name}.{key}": value for key, value in new.items()}
            note = one.note
        return replace(frame, note=note, scalars=frame.scalars | own)

    return describe


def _on_other(frame: Frame, name: str, other: str) -> dict[str, float]:
    """The components of the force and moment that muscle ``name`` exerts on muscle ``other``; empty if they cannot touch."""
    found, key = dict[str, float](), force_between(name, other)
    for kind, vectors in (("force", frame.forces), ("moment", frame.moments)):
        if key in vectors:
            found |= vector_scalars(f"{kind}_on_{other}", vectors[key])
    return found


def _are_known(problem: MuscleProblem, settings: Settings) -> bool:
    """True if external loads act and can be computed from the deformed shape alone, exactly as the solver integrates them. The
    loads are quadratic in the shape, so the solver's quadrature must have degree 4 or above.
    """
    exact = settings.quadrature_degree is None or settings.quadrature_degree >= 4
    still = np.zeros((len(problem.mesh.tets), 10, 3))
    outer = any(one.outer for one in problem.effects)
    return exact and outer and external_load(problem, problem.frames[0], still, still) is not None


def _loads(problem: MuscleProblem, frame: Frame) -> dict[str, float]:
    """The components of the external force on the muscle, ``load_force_x`` to ``_z`` [N], and of its moment about the origin,
    ``load_moment_x`` to ``_z`` [N mm]. Both are computed from the deformed shape alone, without the solver's forms.
    """
    state = frame.state
    assert state is not None  # a muscle's frame has a state
    by, since = quadratic(state.displacement), state.displacement - state.before if len(state.before) else None
    load = external_load(problem, frame.number, by, None if since is None else state.rate * quadratic(since))
    assert load is not None  # ``_are_known`` ensures it
    return vector_scalars("load_force", load.force) | vector_scalars("load_moment", load.moment)


def _described(problem: MuscleProblem, frame: Frame, *, loads: bool, is_first: bool) -> Frame:
    """Add a note and scalars to the frame: the magnitude of each force and of the net force [N], the magnitude of the net moment
    [N mm], forces and moments on bones, errors of attachments, stresses and, if ``loads`` is true, the external load.
    """
    scalars = frame.scalars
    smallest = min(scalars["min_det_F_quadrature"], scalars["min_det_F_vertices"])
    note = f"{scalars['newton_iterations']:.0f} Newton iterations, det F at least {smallest:.2g}"
    if scalars.get("negative_modes", 0) > 0:
        note += f", unstable equilibrium (negative modes: {scalars['negative_modes']:.0f})"
    if scalars.get("outside_law", 0) > 0:
        note += f", a law outside its range in {scalars['outside_law']:.0f} cells"
    if is_first and (overlap := scalars.get("overlap_at_rest", 0.0)) > 0:
        stays = among(problem.effects) is not None
        note += f", an overlap of {overlap:.2g} mm with bones at rest {'remains' if stays else 'was removed'}"
    pulls = _loads(problem, frame) if loads else {}
    pulls |= {f"force_{name}": float(np.linalg.norm(force)) for name, force in frame.forces.items()}
    for kind, vectors in (("force", frame.forces), ("moment", frame.moments)):
        pulls[f"net_{kind}"] = float(np.linalg.norm(np.sum(list(vectors.values()), axis=0)))
        pulls |= _on_bones(problem, kind, vectors)
    assert frame.state is not None  # a muscle's frame has a state
    results = Results(problem.mesh, problem.effects, {frame.number: frame.state}, problem.directions, problem.regions)
    own = pulls | _attachment_errors(problem, frame) | stress_scalars(results, frame.number)
    return replace(frame, note=note, scalars=scalars | own)


def _on_bones(problem: MuscleProblem, kind: str, vectors: dict[str, Floats]) -> dict[str, float]:
    """The components of the force or the moment (``kind``) that the muscle exerts on each bone: minus the sum of the ``vectors``
    (3,) that act on the muscle at its attachments to the bone and through contact with it.
    """
    found = dict[str, float]()
    for bone in problem.bones:
        names = [one.attachment for one in problem.attached if one.bone.name == bone.name]
        by = [vectors[name] for name in chain(names, map(force_name, names)) if name in vectors]
        by += [vectors[bone.name]] if problem.contact is not None and bone.name in vectors else []
        if by:
            found |= vector_scalars(f"{kind}_on_{bone.name}", -np.sum(by, axis=0))
    return found


def _attachment_errors(problem: MuscleProblem, frame: Frame) -> dict[str, float]:
    """The rms and the maximum of the distance between attached surface vertices and their targets on the bones,
    ``attachment_error_rms`` and ``attachment_error_max`` [mm]; empty if nothing is attached. The distance is not zero: springs
    yield, and exact attachments are prescribed on facets of tets, which follow the surface vertices only approximately.
    """
    surface = frame.surface
    if not problem.attached or surface is None:
        return {}
    off = []
    for one in problem.attached:
        wanted = apply(one.bone.pose(frame.number), problem.surface.points[one.vertices])
        off.append(np.linalg.norm(surface[one.vertices] - wanted, axis=1))
    errors = np.concatenate(off)
    return {"attachment_error_rms": float(np.sqrt(np.mean(errors**2))), "attachment_error_max": float(errors.max())}


def _samples(problem: AnyMuscle) -> dict[str, tuple[Ints, Floats]]:
    """The points at which displacements are sampled, by name: the tet (n,) and the rest position (n, 3) [mm] of each point."""
    if isinstance(problem, MusclesProblem):  # sample each point in its own muscle, even if another muscle is very close
        each = [_samples(one) for one in problem.problems.values()]
        starts = [span.cells.start for span in problem.spans]
        return {
            name: (
                np.concatenate([one[name][0] + start for one, start in zip(each, starts, strict=True)]),
                np.concatenate([one[name][1] for one in each]),
            )
            for name in ("surface", "fibres")
        }
    locator = Locator(problem.mesh)
    wanted = {"surface": problem.surface.points, "fibres": problem.fibres.points}
    return {name: (locator.embed(points).tets, np.asarray(points)) for name, points in wanted.items()}


def _planned(problem: AnyMuscle, settings: Settings) -> Settings:
    """The settings, with missing values chosen for the size of the problem and the machine."""
    mesh, changes = problem.body.mesh, dict[str, int | bool]()
    # A problem made in Python has not been checked yet.
    check_element(settings.element, mesh.kind, mesh.degree, problem.body.effects, "element")
    check_quadrature(settings.element, settings.quadrature_degree, "quadrature_degree")
    if isinstance(problem, MusclesProblem) or problem.body.touching:  # both need a single rank
        _check_touching(settings, "reference")
        settings = settings.model_copy(update={"ranks": 1})
    chosen = resources.planned(settings, mesh, resources.available())
    _check_ranks(chosen, "ranks")
    if chosen.ranks is None:
        count = resources.unknowns(mesh, chosen.element)
        changes["ranks"] = resources.ranks(chosen, count) if mpiexec() else 1
    if chosen.store_state is None:
        size = len(problem.frames) * resources.state(mesh, chosen.element, steps=_has_steps(problem))
        changes["store_state"] = size <= resources.MOST_STATES
    return chosen.model_copy(update=changes)


def _has_steps(problem: AnyMuscle) -> bool:
    """True if an effect depends on velocities and therefore on the load steps."""
    return any("interval" in effect.needs for effect in problem.body.effects)


def _check_touching(settings: Settings, place: str) -> None:
    """Raise InputError, naming a key inside ``place``, if the settings do not support touching muscles."""
    if (settings.ranks or 1) > 1:
        want = "1, as several muscles and muscles that touch themselves are solved on one rank"
        raise InputError(join(place, "ranks"), settings.ranks, want)
    if settings.linear_solver == "multigrid":
        want = "another solver, as multigrid does not support touching muscles"
        raise InputError(join(place, "linear_solver"), '"multigrid"', want)


def _check_ranks(settings: Settings, place: str) -> None:
    """Raise InputError at ``place`` if multigrid is requested on more than one rank."""
    if settings.linear_solver == "multigrid" and (settings.ranks or 1) > 1:
        raise InputError(place, settings.ranks, "1, as multigrid works on one rank only")


SOLVES = (
    MuscleSolver(
        settings=Settings,
        solve=solve,
        go_on=go_on,
        moves="tetrahedra",
        example={"ranks": 1},
        require=require,
        check_effects=check_effects,
        slow=True,
    ),
    FieldSolver(settings=FieldSettings, solve=solve_scalar, example={}, require=require, slow=True),
    BodySolver(settings=BodySettings, solve=solve_on, example={}, require=require, slow=True),
)
solve_field = SOLVES[1].run  # stores nothing
