"""Meshes of scalar cases: intervals, triangles in files, surfaces."""

from pathlib import Path

import numpy as np
from scipy.spatial import Delaunay, QhullError

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.foundations.records import join
from fem_reference.geometry.field_mesh import FieldMesh
from fem_reference.io import files
from fem_reference.scenes.scalar import Interval, MeshFiles, ScalarCase


def mesh_of(case: ScalarCase) -> FieldMesh:
    """The mesh of a scalar case; InputError names what is unusable."""
    domain = case.domain
    if domain.mesh is not None:
        return _mesh_files(case, domain.mesh)
    if domain.surface is not None:
        surface = files.read_surface(case.file(domain.surface.file, "domain.surface.file"), domain.surface.scale)
        return FieldMesh(surface.points, surface.triangles, surface.place)
    nodes = _nodes(domain.interval) if domain.interval is not None else np.array(domain.nodes)
    vertices = np.arange(len(nodes))
    return FieldMesh(nodes[:, None], np.column_stack([vertices[:-1], vertices[1:]]), join(case.place, "domain"))


def _nodes(interval: Interval) -> Floats:
    if interval.seed is None:
        return np.linspace(interval.start, interval.end, interval.count)
    inside = np.random.default_rng(interval.seed).uniform(interval.start, interval.end, interval.count - 2)
    return np.array([interval.start, *np.sort(inside), interval.end])


def _mesh_files(case: ScalarCase, given: MeshFiles) -> FieldMesh:
    path = case.file(given.points, "domain.mesh.points")
    points = numbers(path)
    if points.shape[1] not in (2, 3):
        raise InputError(path, f"rows of {points.shape[1]} numbers", "2 or 3 coordinates a vertex")
    if given.triangles == "delaunay":
        if points.shape[1] == 3:
            raise InputError(join(case.place, "domain.mesh.triangles"), '"delaunay" of points in space', "a file")
        try:
            return FieldMesh(points, Delaunay(points).simplices, str(path))
        except QhullError as error:
            raise InputError(
                path, "points that cannot be triangulated", "points in the plane, not on a line"
            ) from error
    path = case.file(given.triangles, "domain.mesh.triangles")
    triangles = whole_numbers(path, numbers(path))
    if triangles.shape[1] != 3:
        raise InputError(path, f"rows of {triangles.shape[1]} numbers", "3 vertices a triangle")
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
    """``values`` of a file as numbers of vertices; InputError where they are none."""
    wrong = (values != np.round(values)) | (np.abs(values) > np.iinfo(np.int32).max)
    if wrong.any():
        raise InputError(str(path), f"the vertex {values[wrong][0]:g}", "vertices, numbered from 1")
    return np.asarray(values.astype(np.int64))
