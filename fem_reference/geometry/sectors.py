"""Smooth sectors around the vertices of a surface, and the attached shares of the corners of triangles."""

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints, Surface, corner_fans, triangle_areas, twins, unit_normals
from fem_reference.geometry.distance import distances

# The edge between two triangles is sharp if the angle between their normals exceeds 45 degrees.
_SHARP = np.cos(np.radians(45))


def sectors(surface: Surface) -> Ints:
    """Index (m, 3) of the sector of each corner of the triangles: the part around a vertex from one sharp edge to the next."""
    triangles = surface.triangles
    normals = unit_normals(surface.points[triangles])
    one, other = twins(triangles).T
    smooth = np.einsum("ij,ij->i", normals[one // 3], normals[other // 3]) > _SHARP
    return corner_fans(one[smooth], other[smooth], triangles.size).reshape(-1, 3)


def attached_shares(surface: Surface, vertices: Ints) -> Floats:
    """Attached share, 1 or 0, of each corner (m, 3) of the triangles of ``surface``, for the attached ``vertices`` (k,).

    If any triangle at a vertex is completely attached, then of the corners at this vertex only those in a sector with such a
    triangle are attached, not those across a sharp edge. So the end of a muscle is attached, but not a strip of the
    belly next to it, whose width would be arbitrary.
    """
    attached = np.zeros(len(surface.points), bool)
    attached[vertices] = True
    triangles = surface.triangles
    whole = attached[triangles].all(axis=1)
    number = sectors(surface)
    sector_whole = np.zeros(int(number.max()) + 1, bool)
    sector_whole[number[whole]] = True
    vertex_whole = np.zeros(len(surface.points), bool)
    vertex_whole[triangles[whole]] = True
    return np.where(attached[triangles] & (sector_whole[number] | ~vertex_whole[triangles]), 1.0, 0.0)


def attached_area(surface: Surface, shares: Floats) -> float:
    """Attached area [mm2] of ``surface``, from the ``shares`` (m, 3) of the corners of its triangles."""
    return float(triangle_areas(surface.points, surface.triangles) @ shares.mean(axis=1))


def shares_at(points: Floats, surface: Surface, shares: Floats) -> Floats:
    """Attached shares (n,) at the points of a ``surface`` nearest to ``points`` (n, 3) [mm], from the corner ``shares`` (m, 3)."""
    nearest = distances(points, surface)
    return np.asarray(np.sum(shares[nearest.triangle] * nearest.barycentric, axis=1))
