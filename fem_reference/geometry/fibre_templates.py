"""Fibres of a template in the unit cube, mapped to sections of a muscle, after Kohout and Kukacka.

Their method (report DCSE/TR-2022-03, 6.1.2) uses isocontours on the surface. Here each contour is the rim of a section on which a
Laplace field in tetrahedra is constant, and points inside come from a harmonic map of that section. These points are in the muscle;
between sections, lines may leave it where it bends. If a muscle has several heads, only the largest section is followed; where a
head begins or ends, lines are twisted.
"""

from dataclasses import dataclass

import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Polylines, Surface, normals
from fem_reference.geometry.cross_sections import CrossSection, carried, cross_section
from fem_reference.geometry.curves import bezier
from fem_reference.geometry.distance import distances
from fem_reference.geometry.fibres import POINTS, FibreField, resample
from fem_reference.geometry.radial_basis import halton

PLACE = "fibres.kohout_kukacka"
_WINDOW = 7  # the number of consecutive points of a line to which smoothing fits a parabola
_FLAT = 1e-9  # twice the area, in the unit square, below which the corners of a triangle count as collinear
_SHORTEST = 0.1  # the minimum length of a pennate fibre along the muscle, as a fraction of that of the longest fibre


@dataclass(frozen=True, eq=False)
class Contours:
    """Sections of a muscle from one attachment to the other. ``squares``: the positions of the points of each section in the unit
    square; ``heights`` (k,): the positions of the sections, from 0 to 1, along the line through their centres; ``length`` [mm]: the
    length of this line.
    """

    sections: tuple[CrossSection, ...]
    squares: tuple[Floats, ...]
    heights: Floats
    length: float

    @property
    def width(self) -> float:
        """Mean width [mm] of the sections in the direction of the x axis of their squares."""
        sides = np.array([[0.0, 0.5], [1.0, 0.5]])
        return float(np.mean([np.linalg.norm(np.diff(self._on(i, sides), axis=0)) for i in range(len(self.sections))]))

    def place(self, cube: Floats) -> Floats:
        """Map positions (n, 3) in the unit ``cube`` to points (n, 3) [mm], linearly between sections and beyond both ends."""
        last = len(self.heights) - 2
        below = np.clip(np.searchsorted(self.heights, cube[:, 2], side="right") - 1, 0, last)
        found = np.empty_like(cube)
        for i in np.unique(below):
            some = below == i
            low, high = (self._on(k, cube[some, :2]) for k in (i, i + 1))
            share = (cube[some, 2] - self.heights[i]) / (self.heights[i + 1] - self.heights[i])
            found[some] = low + share[:, None] * (high - low)
        return found

    def _on(self, i: int, places: Floats) -> Floats:
        """Points (n, 3) on section ``i`` at the positions ``places`` (n, 2) in its square."""
        square, triangles = np.pad(self.squares[i], ((0, 0), (0, 1))), self.sections[i].triangles
        triangles = triangles[np.linalg.norm(normals(square[triangles]), axis=1) > _FLAT]
        found = distances(np.pad(places, ((0, 0), (0, 1))), Surface(square, triangles))
        corners = self.sections[i].points[triangles[found.triangle]]
        return np.asarray(np.einsum("nk,nkd->nd", found.barycentric, corners))


def contours(field: FibreField, count: int, towards: Floats | None = None) -> Contours:
    """Return up to ``count`` sections, at levels with equal numbers of tets between them; sections with holes are left out.

    The x axis of the middle section's square is along ``towards`` (3,) or, if that is None, along the longest axis of the section.
    Positions on rims are transferred from section to section by matching points of neighbouring rims.
    """
    means = field.values[field.mesh.tets].mean(axis=1)
    levels = np.quantile(means, (np.arange(count) + 0.5) / count)
    sections = tuple(one for level in levels if (one := cross_section(field.mesh, field.values, level)) is not None)
    if len(sections) < 2:
        raise InputError(f"{PLACE}.contours", f"{len(sections)} sections in one piece without holes", "at least two")
    moments = [one.moments for one in sections]
    ends = [field.mesh.points[facets].mean(axis=(0, 1)) for facets in (field.start, field.end)]
    centres = np.array([ends[0], *(centre for centre, _ in moments), ends[1]])
    along = np.cumsum(np.linalg.norm(np.diff(centres, axis=0), axis=1))
    middle = len(sections) // 2
    turns = {middle: sections[middle].turns(_first(sections[middle], moments[middle][1], towards))}
    ahead = [(i, i + 1) for i in range(middle, len(sections) - 1)]
    for i, other in ahead + [(i, i - 1) for i in range(middle, 0, -1)]:
        turns[other] = carried(sections[i], turns[i], sections[other])
    squares = tuple(one.square(turns[i]) for i, one in enumerate(sections))
    return Contours(sections, squares, along[:-1] / along[-1], float(along[-1]))


def _first(middle: CrossSection, product: Floats, towards: Floats | None) -> Floats:
    """Unit vector (3,) in the ``middle`` section along ``towards``, or along its longest axis (largest component positive)."""
    if towards is None:
        longest = np.linalg.eigh(product)[1][:, 2]
        towards = longest * np.sign(longest[np.argmax(np.abs(longest))])
    flat = towards - (towards @ middle.normal) * middle.normal
    if np.linalg.norm(flat) < 1e-6 * np.linalg.norm(towards):
        raise InputError(f"{PLACE}.towards", "a direction along the muscle", "a direction across the muscle")
    return np.asarray(flat / np.linalg.norm(flat))


def template(count: int, slope: float) -> Floats:
    """Control points (count, 2, 3) of straight Bezier curves that are evenly distributed in the unit cube (Halton). The curves are
    parallel to the z axis, or inclined towards the x axis by the ``slope`` and cut off at the sides of the cube.
    """
    across = halton(count, 2)
    margin = _SHORTEST * min(slope, 1.0)
    at = margin - slope + across[:, 0] * (1 + slope - 2 * margin)
    low = np.maximum(0, -at / slope) if slope > 0 else np.zeros(count)
    high = np.minimum(1, (1 - at) / slope) if slope > 0 else np.ones(count)
    return np.stack([np.stack([at + slope * z, across[:, 1], z], axis=1) for z in (low, high)], axis=1)


def mapped(field: FibreField, found: Contours, count: int, pennation: float = 0.0) -> Polylines:
    """Map ``count`` template lines to the muscle, as lines of 40 points smoothed by parabolas. The lines are inclined by
    ``pennation`` [rad] towards the x axis of the squares. A line that reaches an end of the cube ends on the attachment there.
    """
    curves = template(count, np.tan(pennation) * found.length / found.width)
    samples = [_samples(ends, found.heights) for ends in curves]
    placed = np.split(found.place(np.concatenate(samples)), np.cumsum([len(one) for one in samples])[:-1])
    firsts, lasts = (np.array([line[end] for line in placed]) for end in (0, -1))
    start, end = (Surface(field.mesh.points, facets) for facets in (field.start, field.end))
    firsts = np.where(curves[:, 0, 2:] == 0, distances(firsts, start).closest, firsts)
    lasts = np.where(curves[:, 1, 2:] == 1, distances(lasts, end).closest, lasts)
    lines = [
        _smooth(resample(np.concatenate([first[None], line[1:-1], last[None]])))
        for first, line, last in zip(firsts, placed, lasts, strict=True)
    ]
    return Polylines(np.concatenate(lines), np.arange(count + 1) * POINTS)


def _samples(ends: Floats, heights: Floats) -> Floats:
    """Points (k, 3) of the Bezier curve with control points ``ends`` (2, 3): both ends, and a point at each height between them."""
    low, high = ends[:, 2]
    between = heights[(heights > low + 1e-6) & (heights < high - 1e-6)]
    return bezier(ends)((np.concatenate([[low], between, [high]]) - low) / (high - low))


def _smooth(line: Floats) -> Floats:
    """Move each point of the line (40, 3) onto the parabola that best fits it and its six neighbours; the ends stay fixed."""
    from scipy.signal import savgol_filter  # imported here because scipy.stats, which it loads, takes half a second

    found = savgol_filter(line, _WINDOW, 2, axis=0, mode="interp")
    found[[0, -1]] = line[[0, -1]]
    return np.asarray(found)
