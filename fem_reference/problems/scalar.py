"""Scalar cases as arrays for solvers: mesh, effects and boundary conditions. This module is independent of any solver."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
from scipy.spatial import Delaunay, QhullError

from fem_reference.effects import FieldEffect
from fem_reference.effects.advection import Advection
from fem_reference.effects.diffusion import Diffusion
from fem_reference.effects.reaction import Reaction
from fem_reference.effects.source import Source
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.formula import evaluate
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.foundations.records import join
from fem_reference.geometry.field_mesh import FieldMesh, check, refined, share_above, stabilisation
from fem_reference.io import files
from fem_reference.problems.problem import NOTHING, AtRest, Task
from fem_reference.scenes.scalar import Boundary, MeshFiles, ScalarCase


@dataclass(frozen=True, eq=False)
class Flux:
    """A Neumann condition: the vertices of ``facets`` (f, 1 or 2), and the formula of the ``slope`` along their outward normal."""

    facets: Ints
    slope: str


@dataclass(frozen=True, eq=False)
class FieldProblem:
    """A scalar field to be solved. ``order``: the order of the Lagrange elements. ``fixed`` (N,): the prescribed value at each node
    (the vertices, then for order 2 the midpoints of ``mesh.edges``), NaN if the node is free. ``fluxes``: the Neumann conditions.
    ``upper`` (m,): the fraction of each cell above the mean y. ``tau`` (m,): the parameter of the stabilised form, None for the
    plain form. ``peclet``: the mesh Peclet number. ``exact``: the exact solution, if it is known.
    """

    mesh: FieldMesh
    order: int
    effects: tuple[FieldEffect, ...]
    fixed: Floats
    fluxes: tuple[Flux, ...]
    upper: Floats
    tau: Floats | None
    peclet: float
    exact: str | None = None

    task: ClassVar[Task] = "solve_field"
    frames: ClassVar[tuple[int]] = (0,)  # a steady field has one frame
    rest: ClassVar[AtRest] = NOTHING
    body: ClassVar[None] = None
    muscle: ClassVar[None] = None
    bones: ClassVar[tuple[()]] = ()
    exempt: ClassVar[None] = None
    joints: ClassVar[tuple[()]] = ()
    attached: ClassVar[tuple[()]] = ()

    @property
    def field(self) -> "FieldProblem":
        """This problem, which is a scalar field."""
        return self

    def write_meshes(self, folder: Path) -> None:
        """Write the mesh with its fixed values into ``folder``, for ParaView."""
        points, cells = self.mesh.points, self.mesh.cells
        files.write_field(folder / "mesh.vtu", points, cells, {"fixed": self.fixed[: len(points)]})

    @property
    def form(self) -> str:
        """The weak form: galerkin, or supg if it is stabilised."""
        return "galerkin" if self.tau is None else "supg"

    @property
    def mesh_facts(self) -> dict[str, float]:
        """The size of the mesh and its Peclet number."""
        return {"cells": float(len(self.mesh.cells)), "nodes": float(len(self.fixed)), "mesh_peclet": self.peclet}

    @property
    def diffusion(self) -> float:
        """The diffusion coefficient."""
        return next(effect.coefficient for effect in self.effects if isinstance(effect, Diffusion))

    @property
    def advection(self) -> Advection | None:
        """The advection, None without flow."""
        return next((effect for effect in self.effects if isinstance(effect, Advection)), None)


def build(case: ScalarCase, refinements: int = 0) -> FieldProblem:
    """The problem of a case whose mesh is refined ``refinements`` times. An InputError names the invalid part."""
    mesh = check(mesh_of(case))
    dimension = mesh.points.shape[1]
    _check_effects(case, mesh)
    average, given = float(mesh.points[:, 1].mean()) if dimension > 1 else 0.0, _given(case, mesh)
    for _ in range(refinements):
        given = np.concatenate([given, _between(mesh, given)])
        mesh = refined(mesh)
    flow = next((effect.velocity for effect in case.effects if isinstance(effect, Advection)), (0.0,) * dimension)
    diffusion = next(effect.coefficient for effect in case.effects if isinstance(effect, Diffusion))
    peclet, tau = stabilisation(mesh, diffusion, np.array(flow), case.element.order)
    form, fixed = case.element.form, _fixed(case, mesh, given)
    if np.isnan(fixed).all() and not any(isinstance(effect, Reaction) and effect.rate for effect in case.effects):
        place = join(case.place, "boundary")  # the solution is unique only up to a constant
        raise InputError(place, "no prescribed value and no reaction", "a prescribed value, or a reaction")
    return FieldProblem(
        mesh,
        case.element.order,
        case.effects,
        fixed,
        tuple(Flux(_facets(entry, mesh), entry.slope) for entry in case.boundary if entry.slope is not None),
        share_above(mesh, average) if dimension > 1 else np.zeros(len(mesh.cells)),
        tau if form == "supg" or (form == "auto" and peclet > 1) else None,
        peclet,
        case.exact,
    )


def _check_effects(case: ScalarCase, mesh: FieldMesh) -> None:
    dimension = mesh.points.shape[1]
    if not any(isinstance(effect, Diffusion) for effect in case.effects):
        raise InputError(join(case.place, "effect"), "no diffusion", "an effect with name diffusion")
    for i, effect in enumerate(case.effects):
        place = join(case.place, f"effect[{i}]")
        if isinstance(effect, Advection) and len(effect.velocity) != dimension:
            got = f"{len(effect.velocity)} components"
            raise InputError(f"{place}.velocity", got, f"{dimension}, one for each coordinate")
        if isinstance(effect, Source):
            _try(effect.strength, mesh.points[mesh.cells].mean(axis=1), f"{place}.strength")
            if effect.where == "y above average" and dimension == 1:
                raise InputError(f"{place}.where", f'"{effect.where}" on an interval', '"everywhere"')
    if case.exact is not None:
        _try(case.exact, mesh.points, join(case.place, "exact"))


def _try(formula: str, points: Floats, place: str) -> None:
    """Raise InputError at ``place`` if a formula names an unknown coordinate, or has no finite value at one of ``points``."""
    try:
        values = at(formula, points)
    except InputError as error:
        raise InputError(place, error.got, error.want) from error
    except ArithmeticError as error:
        raise InputError(place, f'"{formula}" ({error})', "a formula with a value everywhere") from error
    if not np.isfinite(values).all():
        where = ", ".join(f"{x:g}" for x in points[np.flatnonzero(~np.isfinite(values))[0]])
        got = f'"{formula}", which has no finite value at ({where})'
        raise InputError(place, got, "a formula with a value everywhere")


def at(formula: str, points: Floats) -> Floats:
    """The values (n,) of a formula at ``points`` (n, d)."""
    with np.errstate(all="ignore"):
        values = evaluate(formula, tuple(points.T), vars(np))
    if np.iscomplexobj(values):
        raise InputError("formula", f'"{formula}", which is complex', "a formula with real values")
    return np.asarray(np.broadcast_to(values, len(points)), dtype=np.float64)


def _given(case: ScalarCase, mesh: FieldMesh) -> Floats:
    """The values (n,) that files of ``bounds`` prescribe at vertices; NaN at a vertex without a value."""
    values = np.full(len(mesh.points), np.nan)
    for i, entry in enumerate(case.boundary):
        if entry.bounds is not None:
            path = case.file(entry.bounds, f"boundary[{i}].bounds")
            table = numbers(path)
            if len(table) != 2:
                raise InputError(path, f"{len(table)} rows", "2 rows: vertices and values")
            vertices = whole_numbers(path, table[0]) - 1
            low, high = vertices.min() + 1, vertices.max() + 1
            if low < 1 or high > len(values):
                raise InputError(path, f"vertices {low} to {high}", f"1 to {len(values)}")
            if len(np.unique(vertices)) < len(vertices):
                raise InputError(path, "a vertex named twice", "one value for each vertex")
            if (np.abs(values[vertices] - table[1]) > 0).any():
                raise InputError(path, "values that differ from another file of bounds", "one value for each vertex")
            values[vertices] = table[1]
    return values


def _between(mesh: FieldMesh, values: Floats) -> Floats:
    """The values (e,) at the midpoints of edges: on the rim the mean of the ``values`` at the ends; NaN inside or if one is NaN."""
    edges = mesh.edges
    middles = np.full(len(edges), np.nan)
    if mesh.cells.shape[1] == 3:
        on_rim = mesh.edge_numbers(mesh.facets)
        middles[on_rim] = values[edges[on_rim]].mean(axis=1)
    return middles


def _fixed(case: ScalarCase, mesh: FieldMesh, given: Floats) -> Floats:
    """The prescribed value (N,) at each node, NaN if it is free. Raises InputError if two conditions disagree on a node."""
    fixed = np.array(given) if case.element.order == 1 else np.concatenate([given, _between(mesh, given)])
    nodes, sloped = mesh.nodes[case.element.order], np.empty(0, np.int64)
    for i, entry in enumerate(case.boundary):
        place = join(case.place, f"boundary[{i}]")
        if entry.on is None:
            continue
        if entry.where is not None:
            _try(entry.where, mesh.points, f"{place}.where")
        facets = _facets(entry, mesh)
        if entry.slope is not None:
            keys = facets @ [len(mesh.points), 1][-facets.shape[1] :]  # different for any two facets
            if np.isin(keys, sloped).any():
                raise InputError(f"{place}.slope", "a facet that already has a slope", "one slope for each facet")
            sloped = np.concatenate([sloped, keys])
        if len(facets) == 0:
            raise InputError(f"{place}.on", f'"{entry.on}", which has no facets', "an end or a rim of the domain")
        key = "slope" if entry.value is None else "value"
        _try(str(getattr(entry, key)), mesh.points[np.unique(facets)], f"{place}.{key}")
        if entry.value is not None:
            which = _nodes_of(facets, mesh, case.element.order)
            values = at(entry.value, nodes[which])
            clash = np.flatnonzero(np.abs(fixed[which] - values) > 1e-12 * (1 + np.abs(values)))
            if len(clash):
                got = f"{values[clash[0]]:g} where another condition has {fixed[which][clash[0]]:g}"
                raise InputError(f"{place}.value", got, "one value for each node")
            fixed[which] = values
    return fixed


def _facets(entry: Boundary, mesh: FieldMesh) -> Ints:
    facets, x, interval = mesh.facets, mesh.points[:, 0], mesh.cells.shape[1] == 2
    if interval == (entry.on == "rim"):
        return facets[:0]
    if interval:
        facets = facets[x[facets[:, 0]] == (x.min() if entry.on == "left" else x.max())]
    if entry.where is not None:
        facets = facets[(at(entry.where, mesh.points) > 0)[facets].all(axis=1)]
    return facets


def _nodes_of(facets: Ints, mesh: FieldMesh, order: int) -> Ints:
    """The nodes on ``facets``: their vertices, and for order 2 the midpoints of facets that are edges."""
    vertices = np.unique(facets)
    if order == 1 or facets.shape[1] == 1:
        return vertices
    return np.concatenate([vertices, len(mesh.points) + mesh.edge_numbers(facets)])


def mesh_of(case: ScalarCase) -> FieldMesh:
    """The mesh of a scalar case. Raises an InputError that names the invalid part."""
    domain = case.domain
    if domain.mesh is not None:
        return _mesh_files(case, domain.mesh)
    if domain.surface is not None:
        surface = files.read_surface(case.file(domain.surface.file, "domain.surface.file"), domain.surface.scale)
        return FieldMesh(surface.points, surface.triangles, surface.place)
    interval, nodes = domain.interval, np.array(domain.nodes)
    if interval is not None and interval.seed is None:
        nodes = np.linspace(interval.start, interval.end, interval.count)
    elif interval is not None:
        inside = np.random.default_rng(interval.seed).uniform(interval.start, interval.end, interval.count - 2)
        nodes = np.array([interval.start, *np.sort(inside), interval.end])
    vertices = np.arange(len(nodes))
    return FieldMesh(nodes[:, None], np.column_stack([vertices[:-1], vertices[1:]]), join(case.place, "domain"))


def _mesh_files(case: ScalarCase, given: MeshFiles) -> FieldMesh:
    path = case.file(given.points, "domain.mesh.points")
    points = numbers(path)
    if points.shape[1] not in (2, 3):
        raise InputError(path, f"rows of {points.shape[1]} numbers", "2 or 3 coordinates per vertex")
    if given.triangles == "delaunay":
        if points.shape[1] == 3:
            raise InputError(join(case.place, "domain.mesh.triangles"), '"delaunay" of points in space', "a file")
        try:
            return FieldMesh(points, Delaunay(points).simplices, str(path))
        except QhullError as error:
            want = "points in the plane, not on a line"
            raise InputError(path, "points that cannot be triangulated", want) from error
    path = case.file(given.triangles, "domain.mesh.triangles")
    triangles = whole_numbers(path, numbers(path))
    if triangles.shape[1] != 3:
        raise InputError(path, f"rows of {triangles.shape[1]} numbers", "3 vertices per triangle")
    return FieldMesh(points, triangles - 1, str(path))


def numbers(path: Path) -> Floats:
    """The comma-separated numbers of a file as a table."""
    rows = files.read_rows(path)
    for i, row in enumerate(rows):
        if len(row) != len(rows[0]):
            raise InputError(path, f"{len(row)} numbers in row {i + 1}", f"{len(rows[0])} as in row 1")
    try:
        table = np.array([[float(cell) for cell in row] for row in rows])
    except ValueError as error:
        raise InputError(path, str(error), "numbers") from error
    if table.ndim != 2 or not np.isfinite(table).all():
        raise InputError(path, "an empty table or a number that is not finite", "rows of finite numbers")
    return table


def whole_numbers(path: Path, values: Floats) -> Ints:
    """The ``values`` of a file as vertex numbers. Raises InputError if they are not integers."""
    wrong = (values != np.round(values)) | (np.abs(values) > np.iinfo(np.int32).max)
    if wrong.any():
        raise InputError(str(path), f"the vertex {values[wrong][0]:g}", "vertices, numbered from 1")
    return np.asarray(values.astype(np.int64))
