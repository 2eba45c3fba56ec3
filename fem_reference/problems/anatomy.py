"""Attachments and fibres of a muscle, from its case."""

import logging
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, Polylines, Surface, TetMesh, boundary, enclosed_volume, united
from fem_reference.foundations.motion import RigidMotion
from fem_reference.foundations.records import join
from fem_reference.geometry.coarsening import resampled
from fem_reference.geometry.distance import distances
from fem_reference.geometry.fibre_templates import contours, mapped
from fem_reference.geometry.fibres import Directions, NearestLine, Turned, fibre_field, trace
from fem_reference.geometry.flux_fibres import area_flux, streamlines
from fem_reference.geometry.sectors import shares_at
from fem_reference.geometry.signed_distance import signed_distances
from fem_reference.geometry.skins import edge_lengths
from fem_reference.geometry.surface_fibres import between, outermost
from fem_reference.io import files
from fem_reference.scenes.fibres import PolylineFile, Traced
from fem_reference.scenes.muscle import MuscleCase, Outline, VertexList

# Sample points of a triangle: its centroid, points near its corners, and points near the midpoints of its sides.
_SAMPLES = np.concatenate([np.full((1, 3), 1 / 3), 0.2 + 0.4 * np.eye(3), 0.45 - 0.35 * np.eye(3)[::-1]])
# The maximum number of triangles of a draped patch: enough for a patch of several metres.
_MOST_TRIANGLES = 2**20
# The maximum length [mm] of the sides of triangles of a draped patch.
_SIDE = 2.0


def pick(case: MuscleCase, i: int, surface: Surface, bone_surface: Surface) -> Ints:
    """The sorted vertices (k,) of the muscle's ``surface`` that ``case.attachment[i]`` attaches to a bone with ``bone_surface``.

    Raises an InputError that names the invalid key of the case, or the file and its row (comment lines do not count).
    """
    attachment = case.attachment[i]
    key = f"attachment[{i}]"
    if attachment.vertices is not None:
        path = case.file(attachment.vertices.file, f"{key}.vertices.file")
        return _listed(path, attachment.vertices, len(surface.points))
    if attachment.within is not None:
        return np.flatnonzero(distances(surface.points, bone_surface).distance <= attachment.within)
    outline = attachment.outline
    assert outline is not None  # an Attachment record has one of the three
    path = case.file(outline.file, f"{key}.outline.file")
    patches = draped(_patches(path, outline, join(case.place, f"{key}.outline.clouds")), bone_surface)
    return np.flatnonzero(distances(surface.points, patches).distance <= outline.reach)


def unshifted(case: MuscleCase) -> MuscleCase:
    """A copy of the case whose outlines are at their unshifted landmarks; the case itself if no outline is shifted."""
    still = tuple(
        one.model_copy(update={"outline": one.outline.model_copy(update={"shift": None})})
        if one.outline and one.outline.shift and one.outline.shift.by
        else one
        for one in case.attachment
    )
    return case if still == case.attachment else case.model_copy(update={"attachment": still})


def tendon_of(case: MuscleCase, i: int) -> Floats | None:
    """The point (3,) [mm] of the tendon of ``case.attachment[i]``: the mean of its landmarks; None without a tendon."""
    if (tendon := case.attachment[i].tendon) is None:
        return None
    key = f"attachment[{i}].tendon"
    path = case.file(tendon.file, f"{key}.file")
    clouds = _clouds(path, tendon.unit)
    if tendon.cloud not in clouds:
        want = f"one of {', '.join(sorted(clouds))}"
        raise InputError(join(case.place, f"{key}.cloud"), f'"{tendon.cloud}", which {path} does not have', want)
    return np.array(clouds[tendon.cloud]).mean(axis=0)


def facets_under(mesh: TetMesh, surface: Surface, shares: Floats) -> Ints:
    """The boundary triangles (m, 3), oriented outwards, that count as attached in a ``mesh`` that does not follow the rim of the
    attachment.

    A triangle is attached if its attached share, averaged over seven sample points, is above 1/2. ``surface``: the surface that the
    mesh fills; ``shares`` (k, 3): the attached shares of the corners of each triangle of this surface.
    """
    triangles, _ = boundary(mesh.tets)
    samples = np.einsum("qk,mkd->mqd", _SAMPLES, mesh.points[triangles]).reshape(-1, 3)
    at = shares_at(samples, surface, shares).reshape(len(triangles), -1)
    return triangles[at.mean(axis=1) > 1 / 2]


def _listed(path: Path, chosen: VertexList, count: int) -> Ints:
    """The ``chosen`` vertices in a file with rows ``vertex[,value]``. ``count``: the number of vertices of the surface."""
    vertices = []
    for number, row in enumerate(files.read_rows(path), start=1):
        if number == 1 and _is_header(row[0]):
            continue
        place = f"{path}: row {number}"
        vertex = _integer(row[0])
        if vertex is None or not 0 <= vertex < count:
            raise InputError(place, _quoted(row[0]), f"a vertex from 0 to {count - 1}")
        value = _integer(row[1]) if chosen.value is not None and len(row) > 1 else None
        if chosen.value is not None and value is None:
            raise InputError(place, _quoted(",".join(row)), "a vertex and its value, an integer")
        if value == chosen.value:
            vertices.append(vertex)
    return np.unique(np.array(vertices, np.int64))


def _is_header(cell: str) -> bool:
    """True if the first cell of a file is a word: it contains a letter and does not begin like a number (``1e5``)."""
    return any(character.isalpha() for character in cell) and re.match(r"[-+.]?\d", cell) is None


def _integer(text: str) -> int | None:
    """The integer, of at most 18 digits, in a cell; None if it contains anything else."""
    return int(text) if re.fullmatch(r"-?\d{1,18}", text) else None


def _quoted(text: str) -> str:
    return f'"{text}"' if len(text) <= 40 else f'"{text[:40]}..."'


def _patches(path: Path, outline: Outline, place: str) -> Surface:
    """The patches that the clouds of an ``outline`` span, as one surface [mm]. ``place``: the key of the clouds for messages."""
    clouds, shift, patches = _clouds(path, outline.unit), outline.shift, []
    moved = np.zeros(3) if shift is None else shift.by * np.array(shift.along) / np.linalg.norm(shift.along)
    for name in outline.clouds:
        if name not in clouds:
            raise InputError(place, f'"{name}", which {path} does not have', f"some of {', '.join(sorted(clouds))}")
        if len(clouds[name]) < 3:
            raise InputError(f'{path}: cloud "{name}"', f"{len(clouds[name])} landmarks", "at least three")
        patches.append(fan(np.array(clouds[name]) + moved))
    return Surface(*united([(patch.points, patch.triangles) for patch in patches]), str(path))


def draped(patches: Surface, bone_surface: Surface) -> Surface:
    """The ``patches`` draped on the bone: they are cut into triangles with sides of at most 2 mm, whose corners are then moved to
    the nearest points of the bone. Landmarks lie on the bone, but triangles between them need not: over the hollow of the iliac
    fossa they are 13 mm from the bone, which is more than the thickness of the muscle.
    """
    longest = _longest_side(patches)
    if len(patches.triangles) * (longest / _SIDE) ** 2 > _MOST_TRIANGLES:
        got = f"landmarks {longest:.4g} mm apart"
        raise InputError(patches.place, got, "landmarks around one attachment, in the stated unit")
    while _longest_side(patches) > _SIDE:
        patches = resampled(patches, 1)
    return patches.moved_to(distances(patches.points, bone_surface).closest)


@np.errstate(over="ignore")  # squares overflow for a point at infinity
def _longest_side(surface: Surface) -> float:
    return float(edge_lengths(surface.points[surface.triangles]).max())


def fan(points: Floats) -> Surface:
    """A fan of triangles between the centroid of ``points`` (n, 3) and each pair of neighbouring points. Neighbours are consecutive
    in the order of the angles in the best-fit plane.
    """
    centre = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - centre)
    x, y, _ = axes @ (points - centre).T
    ring = np.argsort(np.arctan2(y, x), kind="stable")
    triangles = np.stack([np.full(len(ring), len(points)), ring, np.roll(ring, -1)], axis=1)
    return Surface(np.concatenate([points, centre[None]]), triangles)


def _clouds(path: Path, unit: float) -> dict[str, list[list[float]]]:
    """The landmarks [mm] of each cloud in a file with rows ``cloud,landmark,x,y,z`` below a header row."""
    clouds: dict[str, list[list[float]]] = {}
    for number, row in enumerate(files.read_rows(path), start=1):
        try:
            cloud, _, *coordinates = row
            place = [float(text) * unit for text in coordinates]
        except ValueError:
            place = []
        if number == 1 and place:
            raise InputError(f"{path}: row 1", f'"{",".join(row)}"', "a header row: cloud,landmark,x,y,z")
        if number > 1 and not (len(place) == 3 and np.isfinite(place).all()):
            raise InputError(f"{path}: row {number}", f'"{",".join(row)}"', "cloud, landmark and three coordinates")
        if place:
            clouds.setdefault(cloud, []).append(place)
    return clouds


log = logging.getLogger(__name__)

# Fibres are traced in a separate mesh of about this number of tetrahedra.
TETS = 8000
# The number of lines traced for each required surface fibre; the outermost, just below the surface, become the surface fibres.
_OUTER = 5


def fibres_of(case: MuscleCase, surface: Surface, fill: Callable[[float], TetMesh]) -> tuple[Polylines, Directions]:
    """The fibres of a case inside the closed ``surface`` of its muscle, and the fibre direction of the material at any point.

    ``fill``: a function that fills the surface with tetrahedra of a given size [mm].
    """
    lines, directions = lines_of(case, surface, fill)
    if case.fibres.turned is not None:
        directions = Turned(directions, _turning(case))
    return (lines if case.fibres.traced else inside(surface, lines)), directions


def _turning(case: MuscleCase) -> Floats:
    """The rotation (3, 3) from the directions of the lines to the fibre directions of the material."""
    if (turned := case.fibres.turned) is None:
        return np.eye(3)
    return RigidMotion(turned.axis, (0.0, 0.0, 0.0), (0.0,), (turned.angle,)).pose(0.0)[:3, :3]


def lines_of(case: MuscleCase, surface: Surface, fill: Callable[[float], TetMesh]) -> tuple[Polylines, Directions]:
    """The fibres of a case as given by their source, with points that may be outside ``surface``, and the direction at any point.

    The direction is that of the nearest fibre, or of a field between attachments. ``fill``: a function that fills the surface with
    tetrahedra of a given size [mm], for sources that need tetrahedra.
    """
    if (lines := _given(case)) is not None:
        return lines, NearestLine(lines)
    mesh = field_mesh(surface, fill)
    if (traced := case.fibres.traced) is not None:
        return _along_field(mesh, traced, traced.count)
    if (chmd := case.fibres.chmd) is not None and (around := chmd.around) is not None:
        outer = outermost(_along_field(mesh, around, _OUTER * around.count)[0], around.count)
        lines = between([outer], chmd.count)
        return lines, NearestLine(lines)
    asked = case.fibres.kohout_kukacka
    assert asked is not None  # a Fibres record has one source
    field = fibre_field(mesh, asked.start, asked.end)
    towards = None if asked.towards is None else np.array(asked.towards)
    lines = mapped(field, contours(field, asked.contours, towards), asked.count, asked.pennation or 0.0)
    return lines, NearestLine(lines)


def _along_field(mesh: TetMesh, asked: Traced, count: int) -> tuple[Polylines, Directions]:
    """``count`` lines along the Laplace field that ``asked`` describes, and the directions of this field."""
    if asked.flux == "area":
        flux = area_flux(mesh, asked.start, asked.end)
        return streamlines(flux, count), flux.field
    field = fibre_field(mesh, asked.start, asked.end)
    return trace(field, count), field


def field_mesh(surface: Surface, fill: Callable[[float], TetMesh]) -> TetMesh:
    """The tetrahedra for fields between attachments. ``fill``: as in ``lines_of``."""
    return fill(float(np.cbrt(6 * np.sqrt(2) * enclosed_volume(surface.points, surface.triangles) / TETS)))


def lean(case: MuscleCase, axis: Floats) -> float:
    """The inclination of fibres to the unit vector ``axis`` (3,): the root mean square of ``sin 2 a``, where a is the angle between
    fibre and axis. The shear due to the tension of fibres is proportional to it. Traced and mapped fibres are assumed to follow the
    axis, apart from pennation and the rotation ``turned``.
    """
    turning = _turning(case)
    if (lines := _given(case)) is None:
        asked, moved = case.fibres.kohout_kukacka, float(np.linalg.norm(turning @ axis - axis))
        pennation = 0.0 if asked is None else asked.pennation or 0.0
        return float(abs(np.sin(2 * pennation + 4 * np.arcsin(moved / 2))))
    axis = turning.T @ axis
    pieces = np.delete(np.diff(lines.points, axis=0), lines.offsets[1:-1] - 1, axis=0)
    lengths, along = np.linalg.norm(pieces, axis=1), np.abs(pieces @ axis)
    cosine = along / np.maximum(lengths, np.finfo(float).tiny)
    return float(np.sqrt((4 * cosine**2 * np.maximum(1 - cosine**2, 0)) @ lengths / lengths.sum()))


def _given(case: MuscleCase) -> Polylines | None:
    """The fibres in the files of a case, or fibres interpolated between surface fibres in its files; None if there are no files."""
    if (given := case.fibres.polylines) is not None:
        return _read(case, given, "fibres.polylines")
    if (asked := case.fibres.chmd) is not None and asked.heads is not None:
        heads = [_read(case, head, f"fibres.chmd.heads[{i}]") for i, head in enumerate(asked.heads)]
        return between(heads, asked.count)
    return None


def _read(case: MuscleCase, given: PolylineFile, key: str) -> Polylines:
    return files.read_polylines(case.file(given.file, f"{key}.file"), given.unit)


def inside(surface: Surface, fibres: Polylines) -> Polylines:
    """The ``fibres`` with points outside the ``surface`` moved to its nearest points, because there is no solution outside."""
    away = signed_distances(fibres.points, surface)
    points = np.array(fibres.points)
    points[away > 0] = distances(points[away > 0], surface).closest
    if away.max() > 0:
        moved, most = (away > 0).sum(), away.max()
        log.info("fibres: %d of %d points moved into the muscle, by up to %.1f mm", moved, len(points), most)
    return Polylines(points, fibres.offsets)
