"""Filling of a closed surface with well-shaped tetrahedra. If the surface is finer than the tetrahedra, its vertices are not kept.

``python -m fem_reference.geometry.tetrahedra JOB.npz RESULT.npz`` runs one mesher in a process of its own, as a mesher may crash,
hang or keep global state.
"""

import logging
import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fem_reference.foundations import subprocesses
from fem_reference.foundations.errors import NO_ROOM, InputError
from fem_reference.foundations.mesh import (
    TET_FACES,
    Floats,
    Ints,
    Surface,
    TetMesh,
    connected_parts,
    diagonal,
    enclosed_volume,
    tet_volumes,
    triangle_areas,
    upright,
)
from fem_reference.foundations.rows import distinct
from fem_reference.geometry.coarsening import coarsen
from fem_reference.geometry.distance import distances
from fem_reference.geometry.intersections import self_intersections
from fem_reference.geometry.rims import with_rims

log = logging.getLogger(__name__)

SECONDS_ALLOWED = 240.0
_ROUNDED = 6  # decimals of coordinates [mm] for the mesher: far finer than any mesh, far coarser than the round-off of a motion
# The accepted relative difference in volume; a smaller value would fail, as the volume of a self-intersecting surface is ambiguous.
_VOLUME_WITHIN = 0.05
_MOST_TETS = 3e6  # a mesh of this size takes several GB and minutes to make, and is far too large for a solver
_MAKERS = {"gmsh": "gmsh", "tetwild": "fTetWild"}
_SHARES = (1.0, 0.9, 1.1, 0.8, 1.25)  # factors on the requested number of triangles, tried in this order


def tetrahedralise(surface: Surface, size: float, shares: Mapping[str, Floats] | None = None) -> TetMesh:
    """Fill a closed, outward ``surface`` with tetrahedra of edge length ``size`` [mm]. ``shares``: by name of an attachment, the
    attached shares (m, 3) of the corners of the m triangles. A mesh from gmsh has ``facets`` for each attachment; ``maker`` names
    the mesher. Raises InputError if no mesher succeeds, and at once if ``size`` is far too small or too large.

    A surface finer than ``size`` is first coarsened, with edges along the rims of attachments. gmsh fills a surface without
    self-intersections and keeps its triangles. The mesh is made in a frame defined by the vertices of the surface, so that it moves
    with the surface. If gmsh fails, fTetWild makes its own mesh near the surface, a different one each time (see its issue 72).
    """
    origin, axes = _own_frame(surface.points)
    local = np.round((surface.points - origin) @ axes, _ROUNDED) + 0.0  # "+ 0.0" removes negative zeros
    check_size(surface.moved_to(local), size)
    crossing = len(self_intersections(surface))
    if crossing:
        log.warning("%s: %d triangles of the given surface intersect others", surface.place, crossing)
    mesh = _mesh(surface.moved_to(local), size, shares or {})
    return TetMesh(mesh.points @ axes.T + origin, mesh.tets, mesh.facets, mesh.maker)


def check_size(surface: Surface, size: float) -> None:
    """Raise InputError if more than ``_MOST_TETS`` regular tets would fill a surface, or if its smallest extent is below ``size``.

    The extent is that along a coordinate axis; :func:`tetrahedralise` passes the surface in a frame that rotates with it.
    """
    volume, extent = enclosed_volume(surface.points, surface.triangles), np.ptp(surface.points, axis=0).min()
    if not volume <= _MOST_TETS * size**3 / (6 * np.sqrt(2)):
        got = f"more than {_MOST_TETS / 1e6:g} million tetrahedra of {size:g} mm in {volume:.3g} mm3"
        raise InputError(surface.place, got, "a larger tet_size")
    if not size <= extent:
        got = f"tetrahedra of {size:g} mm in a body {extent:.3g} mm thick"
        raise InputError(surface.place, got, "a smaller tet_size")


def _own_frame(points: Floats) -> tuple[Floats, Floats]:
    """Origin (3,) and axes in columns (3, 3): from point 0 to the farthest point, then to the point farthest from that line."""
    from_origin = points - points[0]
    first = from_origin[_farthest(from_origin)]
    first = first / np.linalg.norm(first)
    from_line = from_origin - np.outer(from_origin @ first, first)
    second = from_line[_farthest(from_line)]
    second = second / np.linalg.norm(second)
    return points[0], np.stack([first, second, np.cross(first, second)], axis=1)


def _farthest(vectors: Floats) -> int:
    lengths = np.linalg.norm(vectors, axis=1)
    return int(np.flatnonzero(lengths >= lengths.max() * (1 - 1e-6))[0])


def _mesh(surface: Surface, size: float, shares: Mapping[str, Floats]) -> TetMesh:
    coarse, labels = _coarsened(surface, size, shares)
    crossing = len(self_intersections(coarse))
    if crossing:
        reason = f"{crossing} triangles pass through the surface"
    else:
        try:
            log.info("%s: gmsh fills a surface of %d triangles", surface.place, len(coarse.triangles))
            mesh = checked(run("gmsh", coarse, size), coarse)
            return replace(mesh, facets=_labelled(mesh, coarse, labels, list(shares)))
        except InputError as error:
            reason = str(error)
    log.warning("%s: meshed by fTetWild, differently each time, because gmsh failed: %s", surface.place, reason)
    return checked(run("tetwild", surface, size), surface)


def _labelled(mesh: TetMesh, coarse: Surface, labels: Ints, names: list[str]) -> dict[str, Ints]:
    """Triangles of ``coarse`` with each label, by name; empty without rims, or if ``mesh`` does not begin with the same points."""
    count = len(coarse.points)
    if not labels.any() or not np.array_equal(mesh.points[:count], coarse.points):
        return {}
    return {name: coarse.triangles[labels == label] for label, name in enumerate(names, start=1)}


def _coarsened(surface: Surface, size: float, shares: Mapping[str, Floats]) -> tuple[Surface, Ints]:
    """Return the surface with edges along the rims of attachments, and the labels of its triangles, 0 if free. It is
    coarsened to the number of equilateral triangles of side ``size`` that would cover it, unless it already has fewer triangles.

    If the coarse surface intersects itself, a few other numbers of triangles are tried, and finally a surface without rims.
    """
    count = triangle_areas(surface.points, surface.triangles).sum() / (size**2 * np.sqrt(3) / 4)
    fine = count >= len(surface.triangles)
    for rims in (shares, {}) if shares else ({},):
        for share in (1.0,) if fine else _SHARES:
            coarse = surface if fine else coarsen(surface, int(share * count))
            labels = np.zeros(len(coarse.triangles), np.int64)
            if rims:
                coarse, labels = with_rims(coarse, surface, rims, size)
            if len(self_intersections(coarse)) == 0:
                if shares and not rims:
                    crossing = "meshed without the rims of attachments, which would pass through the surface"
                    log.warning("%s: %s", surface.place, crossing)
                return _near(coarse, surface, size), labels
    return _near(coarse, surface, size), labels


def _near(coarse: Surface, surface: Surface, size: float) -> Surface:
    """Return the ``coarse`` surface; InputError if a part of ``surface`` is missing from it."""
    lost = distances(surface.points, coarse).distance.max()
    log.info("%s: coarsened to %d triangles, at most %.2g mm off", surface.place, len(coarse.triangles), lost)
    if not lost <= size / 2:
        got = f"a part that is lost ({lost:.1f} mm off) with triangles of {size:g} mm"
        raise InputError(surface.place, got, "smaller tetrahedra")
    return coarse


def run(mesher: str, surface: Surface, size: float) -> TetMesh:
    """Fill ``surface`` with tetrahedra by ``mesher`` in a subprocess; InputError if it crashes or takes too long."""
    with subprocesses.scratch_folder() as folder:
        job, result = folder / "job.npz", folder / "result.npz"
        np.savez(job, mesher=mesher, points=surface.points, triangles=surface.triangles, size=size)
        try:
            done = subprocess.run(
                subprocesses.command("-m", __spec__.name, str(job), str(result)),
                cwd=folder,
                env=subprocesses.environment(),
                stdin=subprocess.DEVNULL,
                capture_output=True,
                timeout=SECONDS_ALLOWED,
                text=True,
                errors="replace",
            )
        except subprocess.TimeoutExpired:
            got = f"a surface that {mesher} could not fill in {SECONDS_ALLOWED:g} s"
            raise InputError(surface.place, got, "larger tetrahedra or a cleaner surface") from None
        if no_room := next((words for words in map(os.strerror, NO_ROOM) if words in done.stderr), None):
            raise OSError(f"{folder}: cannot be written: {no_room}; tetrahedra of {surface.place} need room there")
        if done.returncode != 0 or not result.exists():
            raise InputError(surface.place, f"a surface that {mesher} rejects ({last_words(done)})", "a clean surface")
        with np.load(result, allow_pickle=False) as arrays:
            return TetMesh(arrays["points"], arrays["tets"], maker=_MAKERS[mesher])


def last_words(done: subprocess.CompletedProcess[str]) -> str:
    """Reason for the failure of a process: the signal that ended it, or the last line of its error output."""
    if done.returncode < 0:
        return f"it crashed with signal {-done.returncode}"
    return (done.stderr.strip().splitlines() or ["no message"])[-1]


def checked(mesh: TetMesh, surface: Surface) -> TetMesh:
    """Return the largest connected part of ``mesh``, with tets of positive volume and without unused points.

    Raises InputError if nothing remains, a tet is flat, or the volume of the tets is far from that of ``surface``. The boundary of
    the tets is closed, as no triangle belongs to more than two tets.
    """
    if len(mesh.tets) == 0:
        raise InputError(surface.place, "no tetrahedra from the mesher", "a surface that bounds a body")
    used, tets = np.unique(_largest_part(mesh.tets, surface.place), return_inverse=True)
    points, tets = mesh.points[used], tets.reshape(-1, 4)
    volumes = tet_volumes(points, tets)
    if not np.abs(volumes).min() > 0:
        raise InputError(surface.place, "a tetrahedron of zero volume from the mesher", "a cleaner surface")
    got, wanted = np.abs(volumes).sum(), enclosed_volume(surface.points, surface.triangles)
    if not abs(got - wanted) <= _VOLUME_WITHIN * wanted:
        volumes_got = f"tetrahedra of {got:.0f} mm3 in a surface that encloses {wanted:.0f} mm3"
        raise InputError(surface.place, volumes_got, "one clean body")
    return TetMesh(points, upright(points, tets), maker=mesh.maker)


def _largest_part(tets: Ints, place: str) -> Ints:
    faces = np.sort(tets[:, TET_FACES].reshape(-1, 3), axis=1)
    _, _, face, sides = distinct(faces)
    if sides.max() > 2:
        raise InputError(place, f"a triangle between {sides.max()} tetrahedra from the mesher", "a cleaner surface")
    tet = np.repeat(np.arange(len(tets)), 4)
    part = connected_parts(tet, len(tets) + face, len(tets) + len(sides))[: len(tets)]
    return np.asarray(tets[part == np.bincount(part).argmax()])


def _gmsh(points: Floats, triangles: Ints, size: float) -> tuple[Floats, Ints]:
    """Return points and tets that fill a closed surface. Its triangles are kept, and its points come first, in their order."""
    import gmsh

    gmsh.initialize()
    options = {"General.Terminal": 0, "General.NumThreads": 1, "Mesh.OptimizeNetgen": 1}
    for option, value in {**options, "Mesh.MeshSizeMin": 0, "Mesh.MeshSizeMax": size}.items():
        gmsh.option.setNumber(option, value)
    skin = gmsh.model.addDiscreteEntity(2)
    gmsh.model.mesh.addNodes(2, skin, np.arange(1, len(points) + 1), points.ravel())
    gmsh.model.mesh.addElementsByType(skin, 2, [], triangles.ravel() + 1)
    gmsh.model.mesh.createTopology()
    loop = gmsh.model.geo.addSurfaceLoop([tag for _, tag in gmsh.model.getEntities(2)])
    gmsh.model.geo.addVolume([loop])
    gmsh.model.geo.synchronize()
    gmsh.model.mesh.generate(3)
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags)
    index = np.zeros(int(tags.max()) + 1, np.int64)
    index[tags[order].astype(np.int64)] = np.arange(len(tags))
    tets = gmsh.model.mesh.getElementsByType(4)[1].astype(np.int64)
    gmsh.finalize()
    return coordinates.reshape(-1, 3)[order], index[tets].reshape(-1, 4)


def _tetwild(points: Floats, triangles: Ints, size: float) -> tuple[Floats, Ints]:
    """Return points and tets whose boundary is within a twentieth of ``size`` of a surface, which may intersect itself."""
    import pytetwild

    near = size / 20 / diagonal(points)
    return pytetwild.tetrahedralize(  # type: ignore[no-any-return]
        points, triangles.astype(np.int32), edge_length_abs=size, epsilon=near, num_threads=1
    )


if __name__ == "__main__":
    with np.load(sys.argv[1], allow_pickle=False) as given:
        mesher = {"gmsh": _gmsh, "tetwild": _tetwild}[str(given["mesher"])]
        points, tets = mesher(given["points"], given["triangles"], float(given["size"]))
    np.savez(sys.argv[2], points=points, tets=tets)
