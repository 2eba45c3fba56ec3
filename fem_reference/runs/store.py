"""Runs, the results of a solver for a problem, in memory and on disk.

<store>/<solver>-<key>/run.json        status, cost, provenance, and scalars of each frame
                      /surface.pvd     the user's surface at all frames, for ParaView; its files are surface/frame_0010.vtp, ...
                      /rest/           surface.vtp and fibres.vtp at rest, if the solver moves no surface
                      /fibres.pvd      fibre polylines, if the solver has an interior
                      /tets.pvd        tetrahedra, if the solver has them
                      /field.pvd       the scalar field on its mesh, for a scalar problem (``states``)
                      /state/          the unknowns of the tetrahedra, if requested (``states``)
                      /restart/        the state from which the solver continues an unfinished run (``writer``)
"""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.markup import fact_table
from fem_reference.foundations.mesh import Floats, Polylines, Surface, check_corners
from fem_reference.foundations.records import Record, parse
from fem_reference.geometry.field_mesh import FieldMesh
from fem_reference.io import files, texts
from fem_reference.problems.body import Body
from fem_reference.problems.problem import NO_SURFACE, NOTHING, AtRest
from fem_reference.problems.scalar import FieldProblem
from fem_reference.runs.contents import Contents, Status, frame_file, point, scalar_vectors
from fem_reference.runs.states import FIELD, VALUES, NodalField, NodalState, read_field
from fem_reference.scenes.case import Part


@dataclass(frozen=True, eq=False)
class Frame:
    """The results at the requested frame ``number``. Parts that the solver does not have are None or empty.

    ``surface`` (n, 3), ``fibres`` (m, 3), ``points`` (k, 3) [mm]: positions of the vertices of the surface, of the points of the
    fibres and of the nodes of the mesh. ``forces`` (3,) [N]: the force of each constraint, along its prescribed components, and of
    each obstacle, by name. If several regions prescribe a component at a node, the force of each includes this node. ``moments``
    (3,) [N mm]: the moments of these forces about the origin. ``state``: the unknowns of the cells, if requested. ``field``: the
    field of a scalar problem. ``residuals``: the norms [N, mm3] before and after each Newton iteration of the last load step.
    ``note``: a text that is shown with the progress of the run.

    ``scalars`` of a body: min_det_F_quadrature, min_det_F_vertices, volume_ratio, energy (stored) [N mm], newton_iterations,
    cut_backs. The reference adds the extremes of means over cells, min_cell_volume_ratio and max_cell_volume_ratio and, if a law
    limits the fibre stretch, min_cell_fibre_stretch and max_cell_fibre_stretch; outside_law, the number of cells outside the range
    of a law; if all energy is stored, energy_gap, the increase of energy not due to work (``solvers/fenicsx/path``; for muscles by
    Simpson's rule if the trapezoidal rule is poor); if the tangent is symmetric, the number of negative_modes and of material_modes
    among them (``solvers/fenicsx/stability``); with contact, the maximum contact_depth [mm] and contact_pressure [MPa], and the
    contact_area at rest [mm2]; for a muscle, the stresses of ``stress_statistics``, such as stress_von_mises_p95 [MPa].
    """

    number: float
    surface: Floats | None = None
    fibres: Floats | None = None
    points: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    scalars: dict[str, float] = field(default_factory=dict)
    note: str = ""
    state: NodalState | None = None
    forces: dict[str, Floats] = field(default_factory=dict)
    moments: dict[str, Floats] = field(default_factory=dict)
    field: NodalField | None = None
    residuals: tuple[float, ...] = ()

    @classmethod
    def of_field(cls, problem: FieldProblem, values: Floats, form: str, components: Floats | None = None) -> "Frame":
        """The frame of a scalar field; ``form``, ``values`` (psi) and ``components`` are those of :class:`NodalField`."""
        more = {} if components is None else {"components": components}
        return cls(problem.frames[0], field=NodalField(problem.mesh, {VALUES: values} | more, form))


Sink = Callable[[Frame], None]


@dataclass(frozen=True)
class Outcome:
    """The outcome of a solve: a status, a message for the user, and the cost (times of phases, ``seconds_...``, and counts)."""

    status: Status
    message: str
    cost: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Run:
    """The result of a solver for a problem: the muscle or the scalar field of a case, or a body.

    ``numbers`` (f,): frame numbers. ``surface``, ``fibres``: the shapes at rest. ``positions`` (f, n, 3) [mm]: vertices of the
    surface; NaN, and ``has_surface`` is False, for a solver that moves only lines. ``fibre_positions`` (f, m, 3) [mm]: points of
    the fibres, None for a solver without an interior. ``scalars``, ``residuals``: values at each frame. A run of a scalar problem
    has instead a ``mesh`` and, at its nodes, ``fields`` (f, ...), the arrays of :class:`NodalField`. ``states``: all frames of a
    run in memory. ``body``, ``settings``: the problem, for error bars of a body. ``others``: the runs of the other muscles by name.
    """

    name: str
    solver: str
    outcome: Outcome
    numbers: tuple[int, ...]
    surface: Surface = NO_SURFACE
    positions: Floats = field(default_factory=lambda: np.zeros((0, 0, 3)))
    fibres: Polylines | None = None
    fibre_positions: Floats | None = None
    scalars: dict[str, Floats] = field(default_factory=dict)
    origin: dict[str, Any] = field(default_factory=dict)
    folder: Path | None = None
    has_surface: bool = True
    mesh: FieldMesh | None = None
    fields: dict[str, Floats] = field(default_factory=dict)
    states: tuple[Frame, ...] = ()
    body: Body | None = None
    settings: Record | None = None
    residuals: tuple[tuple[float, ...], ...] = ()
    others: Mapping[str, "Run"] = field(default_factory=dict)

    @property
    def last(self) -> Frame:
        """The last frame of a run in memory. Raises ArithmeticError, with the reason, if some frames were not reached."""
        if self.outcome.status != "converged":
            raise ArithmeticError(f"{self.outcome.status}: {self.outcome.message}")
        return self.states[-1]

    @property
    def carries(self) -> frozenset[Part]:
        """The parts of the run that can be measured."""
        if self.mesh is not None:
            return frozenset({"field"})
        if self.has_surface:
            return frozenset({"surface", "lines"})
        return frozenset() if self.fibres is None else frozenset({"lines"})

    @property
    def points(self) -> Floats:
        """The vertices (n, d) of the mesh of a scalar field, otherwise the vertices (n, 3) [mm] of the surface at rest."""
        return self.surface.points if self.mesh is None else self.mesh.points

    @property
    def values(self) -> Floats:
        """The scalar field (f, N) at all nodes. Raises KeyError for a run without a scalar field."""
        return self.fields[VALUES]

    @property
    def vertex_values(self) -> Floats:
        """The scalar field (f, n) at the vertices."""
        return self.values[:, : len(self.points)]

    def force(self, bone: str) -> Floats:
        """The force (f, 3) [N] of the muscle on a ``bone`` through attachments and contact. Raises InputError if it is unknown."""
        return scalar_vectors(self.scalars, "force_on_", bone)

    def moment(self, bone: str, centre: ArrayLike = (0.0, 0.0, 0.0)) -> Floats:
        """The moment (f, 3) [N mm] on a ``bone`` about the point ``centre`` (3,) [mm], by attachments and contact."""
        return scalar_vectors(self.scalars, "moment_on_", bone) - np.cross(point(centre), self.force(bone))

    def _repr_html_(self) -> str:
        known = ("seconds", "newton_iterations", "unknowns")
        cost = {name: value for name, value in self.outcome.cost.items() if name in known}
        facts = {
            "solver": self.solver,
            "status": f"{self.outcome.status}: {self.outcome.message}",
            "frames": f"{len(self.numbers)}, from {self.numbers[0]} to {self.numbers[-1]}",
            "vertices": len(self.points),
            "cost": ", ".join(f"{name} {value:.4g}" for name, value in cost.items()) or "not known",
        }
        return fact_table(f"run {self.name}", facts | {"stored in": self.folder or "nowhere"})


def collected(frames: Iterable[Frame], outcome: Outcome, rest: AtRest = NOTHING) -> Run:
    """The run in memory that consists of ``frames``, with arrays of the parts that all frames have. ``rest``: shapes at rest."""
    states = tuple(frames)

    def stacked(name: str) -> Floats | None:
        found = [getattr(state, name) for state in states]
        return np.stack(found) if found and all(one is not None for one in found) else None

    positions = stacked("surface")
    of_case = all(state.surface is not None or state.field is not None for state in states)
    names = set.intersection(*(set(state.scalars) for state in states)) if states else set()
    nodal = [state.field for state in states if state.field is not None]
    return Run(
        "",
        "",
        outcome,
        tuple(int(state.number) for state in states) if of_case else (),
        rest.surface,
        np.zeros((len(states), 0, 3)) if positions is None else positions,
        rest.fibres,
        stacked("fibres"),
        {name: np.array([state.scalars[name] for state in states]) for name in names},
        has_surface=positions is not None,
        mesh=nodal[0].mesh if nodal else None,
        fields={name: np.stack([one.arrays[name] for one in nodal]) for name in nodal[0].arrays} if nodal else {},
        states=states,
    )


def load(folder: Path) -> Run:
    """The stored run in ``folder``. Raises InputError if there is no run, if it was cut off, or if one of its files is damaged."""
    place = folder / "run.json"
    state = texts.read_json(place, "the run.json of a stored run")
    if isinstance(state, dict) and state.get("status") == "running":
        raise InputError(f"{place}: status", '"running"', "a finished run")
    stored = parse(Contents, state, f"{place}: run")
    outcome = Outcome(stored.status, stored.message, stored.cost)
    scalars = {name: np.asarray(values, float) for name, values in stored.scalars.items()}
    run = Run(stored.name, stored.solver, outcome, stored.numbers, scalars=scalars, residuals=stored.residuals)
    run = replace(run, folder=folder, origin=state["origin"])
    if FIELD in stored.parts:
        mesh, arrays = read_field(folder, stored.numbers)
        return replace(run, has_surface=False, mesh=mesh, fields=arrays)
    return replace(run, **_moved(folder, stored.numbers, stored.parts))


def _moved(folder: Path, numbers: tuple[int, ...], parts: Collection[str]) -> dict[str, Any]:
    """The surface and the fibres of a run in ``folder``, at rest and at its frames, as keyword arguments of :class:`Run`."""
    names, has_surface = [frame_file(number, ".vtp") for number in numbers], "surface" in parts
    if has_surface:
        surfaces = [files.read_surface(folder / "surface" / file, 1.0) for file in names]
        surface = surfaces[0]
        _check_same(folder / "surface", names, [moved.points for moved in surfaces], surface.points)
        positions = np.stack([moved.points for moved in surfaces])
    else:
        surface = files.read_surface(folder / "rest" / "surface.vtp", 1.0)
        positions = np.full((len(numbers), *surface.points.shape), np.nan)
    check_corners(surface)
    found: dict[str, Any] = {"surface": surface, "positions": positions, "has_surface": has_surface}
    if "fibres" in parts:
        lines = [files.read_polylines(folder / "fibres" / file, 1.0, moved=True) for file in names]
        fibres = lines[0] if has_surface else files.read_polylines(folder / "rest" / "fibres.vtp", 1.0)
        _check_same(folder / "fibres", names, [line.points for line in lines], fibres.points)
        found |= {"fibres": fibres, "fibre_positions": np.stack([line.points for line in lines])}
    return found


def _check_same(folder: Path, names: list[str], frames: list[Floats], rest: Floats) -> None:
    """Raise InputError if the number of points in a frame differs from that at rest."""
    for name, points in zip(names, frames, strict=True):
        if len(points) != len(rest):
            raise InputError(folder / name, f"{len(points)} points", f"{len(rest)}, as in the rest state of the run")


def status(folder: Path) -> str:
    """The status in the ``run.json`` of a run in ``folder``: ``"running"`` if it was cut off, ``"damaged"`` if unreadable."""
    try:
        return str(texts.read_json(folder / "run.json", "a run")["status"])
    except (InputError, KeyError, TypeError):
        return "damaged"


def finished(folder: Path, ended: Collection[str] = ("converged",)) -> Run | None:
    """The stored run in ``folder`` if its status is in ``ended``; None if there is no such run."""
    try:
        run = load(folder)
    except InputError:
        return None
    return run if run.outcome.status in ended else None


def at_numbers(run: Run, values: Floats, numbers: tuple[int, ...], *, trusted: bool = True) -> Floats:
    """The ``values`` (f, ...) of a run at the frames ``numbers``: NaN at a missing frame, and everywhere unless ``trusted``."""
    rows, lost = dict(zip(run.numbers, values, strict=True)), np.full(values.shape[1:], np.nan)
    return np.stack([rows.get(number, lost) if trusted else lost for number in numbers])


def complete(run: Run, numbers: tuple[int, ...], *, trusted: bool = True) -> Run:
    """The run at exactly the frames ``numbers``. Values at frames that were not reached are NaN, so these frames never pass. All
    values are NaN if the run is not ``trusted``.
    """
    if run.numbers == numbers and trusted:
        return run
    pick = partial(at_numbers, run, numbers=numbers, trusted=trusted)
    return replace(
        run,
        numbers=numbers,
        positions=pick(run.positions),
        fibre_positions=None if run.fibre_positions is None else pick(run.fibre_positions),
        scalars={name: pick(values) for name, values in run.scalars.items()},
        fields={name: pick(values) for name, values in run.fields.items()},
    )


def seconds_per_frame(run: Run) -> float | None:
    """The mean time [s] to solve a frame after the first; None if the run was computed elsewhere and no time is given. The time is
    ``seconds_solve``, which excludes compilation and output, or, without this entry, the wall-clock time of the run.
    """
    cost = run.outcome.cost
    seconds = cost.get("seconds_solve", cost.get("seconds"))
    solved = reached(run) - 1
    if run.solver == "recorded":
        each = cost.get("seconds_per_frame")  # for each frame number
        return None if each is None else each * (run.numbers[-1] - run.numbers[0]) / max(len(run.numbers) - 1, 1)
    return None if seconds is None or solved < 1 else seconds / solved


def reached(run: Run) -> int:
    """The number of frames in which all positions are known, of the surface or, without a surface, of the fibres."""
    positions = run.positions if run.has_surface or run.fibre_positions is None else run.fibre_positions
    return int(np.isfinite(positions).all(axis=(1, 2)).sum())
