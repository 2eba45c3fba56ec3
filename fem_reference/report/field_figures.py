"""Drawings of a scalar example inside a page: curves in SVG, maps and views in WebP."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter
from PIL import Image

from fem_reference.assessment.comparison import Comparison
from fem_reference.foundations.mesh import Floats, normals
from fem_reference.geometry.field_mesh import FieldMesh
from fem_reference.problems.scalar import at
from fem_reference.report.drawings import LOOK, Drawing, colour_of, drawn, positive
from fem_reference.report.embedded import webp
from fem_reference.runs.store import Run

VALUES, DIFFERENCES = "viridis", "RdBu_r"
_DPI = 150
_LIGHT = np.array([0.3, 0.45, 0.84])  # the direction towards the light, above and to the right of the viewer
_LISTING: Any = {"color": "blue", "linewidth": 2, "marker": "o", "markersize": 6, "markerfacecolor": "lime"}
_MARKERS = "xd+s^v"


def rival(example: Comparison) -> Run | None:
    """The run that is compared with the reference: the listing of the report or, without one, the first candidate."""
    listings = [run for run in example.candidates if run.solver == "listing"]
    return next(iter([*listings, *example.candidates]), None)


def drawings(example: Comparison) -> list[Drawing]:
    """Drawings of the solutions of an example: lines on an interval, otherwise maps and views of triangles."""
    dimension = example.setup.mesh.points.shape[1]
    return _lines(example) if dimension == 1 else list(_panels(example, _plate if dimension == 2 else _body))


def convergence(example: Comparison) -> Drawing:
    """A drawing of the error against the number of cells, with a line for each element."""
    title = "Error as the mesh is refined"
    lines = [(one.element, *positive(np.array(one.cells, float), np.array(one.errors))) for one in example.ladders]
    if not any(len(cells) for _, cells, _ in lines):
        return Drawing(title, missing="no error is a positive number")

    def draw(axes: Axes) -> None:
        for i, (element, cells, errors) in enumerate(lines):
            axes.loglog(cells, errors, "o-", color=colour_of(i + 1), label=element)
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.set_minor_formatter(NullFormatter())
        axes.set(xlabel="cells", ylabel="error")

    return _svg(f"{example.scene.name}-convergence", title, draw)


def _lines(example: Comparison) -> list[Drawing]:
    name, exact = example.scene.name, example.setup.exact
    known = [run for run in example.runs if np.isfinite(run.vertex_values[-1]).all()]
    if not known:
        return [Drawing("Solution", missing="no run has values that are numbers")]

    def solutions(axes: Axes) -> None:
        for i, run in sorted(enumerate(known), key=lambda entry: entry[1].solver != "listing"):
            axes.plot(*_sorted(run, run.vertex_values[-1]), label=run.name, **_look(i, run))
        if exact is not None:
            ends = example.setup.mesh.points[:, 0].min(), example.setup.mesh.points[:, 0].max()
            x = np.linspace(*ends, 300)
            axes.plot(x, at(exact, x[:, None]), color="red", linewidth=1.2, label=f"exact, {exact}")
        axes.set_xlabel("x")

    drawn = [_svg(f"{name}-solution", "Solution at the nodes", solutions)]
    return [*drawn, _distances(example, known)]


def _distances(example: Comparison, known: list[Run]) -> Drawing:
    """A drawing of the difference at the nodes between every run and the exact solution or, without one, between candidates and the
    reference.
    """
    exact, runs, base = example.setup.exact, known, example.reference.vertex_values[-1]
    if exact is not None:
        base, title = at(exact, example.setup.mesh.points), "Difference from the exact solution at nodes"
    else:
        runs, title = [run for run in known if run is not example.reference], "Difference from the reference at nodes"
    apart = [np.abs(run.vertex_values[-1] - base) for run in runs]
    if not any(np.isfinite(values).all() and values.max() > 0 for values in apart):
        return Drawing(title, missing="the difference is zero everywhere, or not a number")

    def draw(axes: Axes) -> None:
        for run, values in zip(runs, apart, strict=True):
            look = _look(known.index(run), run) | {"linewidth": 0.8, "markersize": 3}
            axes.plot(*_sorted(run, np.where(values > 0, values, np.nan)), label=run.name, **look)
        axes.set(yscale="log", xlabel="x")

    return _svg(f"{example.scene.name}-distance", title, draw)


def _sorted(run: Run, values: Floats) -> tuple[Floats, Floats]:
    x = run.points[:, 0]
    order = np.argsort(x)
    return x[order], values[order]


def _look(i: int, run: Run) -> dict[str, Any]:
    """The style of a line. The listing has the style of its ``plot`` command; the style of other runs depends on their index."""
    if run.solver == "listing":
        return dict(_LISTING)
    marker = _MARKERS[i % len(_MARKERS)]
    colour = colour_of(i + 1 if i else 0)  # colour 1 is left out, as it resembles the colour of the listing
    return {"color": colour, "linewidth": 1, "linestyle": "--", "marker": marker, "markersize": 3}


def _svg(name: str, title: str, draw: Callable[[Axes], None]) -> Drawing:
    def whole(figure: Figure, axes: Axes) -> None:
        draw(axes)
        figure.legend(loc="outside upper left", ncols=3, handlelength=2.2, columnspacing=1.2)

    return drawn(name, title, (5.4, 3.6), whole)


def _panels(example: Comparison, draw: Callable[..., None]) -> Iterator[Drawing]:
    """Drawings of the :func:`rival`, the reference and their difference. The arguments of ``draw`` are the values (n,) at the
    vertices, all values (k, n) that share the colour scale, and the name of the colour map.
    """
    reference, other = example.reference, rival(example)
    solutions = [run.vertex_values[-1] for run in (reference, other) if run is not None]
    both = np.stack([values for values in solutions if np.isfinite(values).all()] or solutions)
    wanted = [(_called(reference), reference.vertex_values[-1], both, VALUES)]
    if other is not None:
        wanted.insert(0, (_called(other), other.vertex_values[-1], both, VALUES))
        apart = other.vertex_values[-1] - reference.vertex_values[-1]
        wanted.append((f"Difference: {other.name} minus reference", apart, apart[None], DIFFERENCES))
    for title, values, scale_of, colours in wanted:
        if np.isfinite(values).all():
            yield _webp(title, partial(draw, example=example, values=values, scale_of=scale_of, colours=colours))
        else:
            yield Drawing(title, missing="its values are not numbers")


def _called(run: Run) -> str:
    name = run.name.capitalize()
    return name if run.name == run.solver else f"{name} ({run.solver})"


def _webp(title: str, draw: Callable[[Figure], None]) -> Drawing:
    with mpl.rc_context(LOOK | {"axes.grid": False}):
        figure = Figure(figsize=(9.6, 4.2), dpi=_DPI, layout="constrained")
        canvas: Any = FigureCanvasAgg(figure)
        draw(figure)
        canvas.draw()
        picture = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    width, height = picture.size
    return Drawing(title, f'<img src="{webp(picture, 86)}" width="{width}" height="{height}" alt="">')


def _plate(figure: Figure, example: Comparison, values: Floats, scale_of: Floats, colours: str) -> None:
    """Draw a map with the triangles of the mesh, and a view with the values as heights above the plate."""
    mesh, scale = example.setup.mesh, _scale(scale_of, colours)
    x, y = mesh.points.T
    axes: Any = figure.add_subplot(1, 2, 1)
    shown = axes.tripcolor(x, y, mesh.cells, values, shading="gouraud", cmap=colours, norm=scale)
    axes.triplot(x, y, mesh.cells, color="black", linewidth=0.3, alpha=0.35)
    axes.set(aspect="equal", xlabel="x", ylabel="y")
    figure.colorbar(shown, ax=axes, shrink=0.8)
    view: Any = figure.add_subplot(1, 2, 2, projection="3d")
    surface = view.plot_trisurf(x, y, values, triangles=mesh.cells, cmap=colours, norm=scale, linewidth=0.15)
    surface.set_edgecolor((0, 0, 0, 0.4))
    view.set(xlabel="x", ylabel="y")
    for axis in (view.xaxis, view.yaxis, view.zaxis):
        axis.set_major_locator(MaxNLocator(4))
    view.view_init(elev=28, azim=-60)
    view.set_box_aspect((1, 1, 0.75), zoom=0.9)


def _scale(values: Floats, colours: str) -> Normalize:
    """The colour scale, from the minimum to the maximum; for differences it is symmetric about zero."""
    low, high = float(values.min()), float(values.max())
    if colours == DIFFERENCES:
        high = max(-low, high)
        low = -high
    return Normalize(low, high) if high > low else Normalize(low - 0.5, low + 0.5)


@dataclass(frozen=True)
class _Window:
    """A part of a surface: its ``low`` and ``high`` corners (3,), and the width of the ``line`` around triangles."""

    title: str
    low: Floats
    high: Floats
    line: float

    @property
    def half(self) -> tuple[float, float]:
        """Half the width and half the height of the window, which is a square, or narrower if the part is higher than wide."""
        width, height = (float(length) for length in 0.53 * (self.high - self.low)[:2])
        height = max(width, height)
        return max(width, height / 2), height


def _windows(points: Floats, anchors: Floats) -> list[_Window]:
    """The entire surface, the belt around the mean height of ``points``, and the part around fixed vertices ``anchors`` (k, 3)."""
    height, extent = float(np.ptp(points[:, 1])), float(np.ptp(points, axis=0).max())
    windows = [_Window("whole", points.min(axis=0), points.max(axis=0), 0.0)]
    belt = points[np.abs(points[:, 1] - points[:, 1].mean()) < 0.1 * height]
    if len(belt):
        windows.append(_Window("detail about the mean of y", belt.min(axis=0), belt.max(axis=0), 0.2))
    if len(anchors):
        room = np.array([0.06, 0.06, 1.0]) * extent
        low, high = anchors.min(axis=0) - room, anchors.max(axis=0) + room
        windows.append(_Window("detail about the fixed vertices", low, high, 0.3))
    return windows


def _body(figure: Figure, example: Comparison, values: Floats, scale_of: Floats, colours: str) -> None:
    """Draw a surface in space with y up, seen along z from the side of its fixed vertices. Each window has a colour scale."""
    mesh = example.setup.mesh
    anchors = mesh.points[~np.isnan(example.setup.fixed[: len(mesh.points)])]
    behind = len(anchors) > 0 and anchors[:, 2].mean() < mesh.points[:, 2].mean()
    side = np.array([-1.0, 1.0, -1.0]) if behind else np.ones(3)
    turned = FieldMesh(mesh.points * side, mesh.cells, mesh.place)
    windows = _windows(turned.points, anchors * side)
    ratios = [window.half[0] / window.half[1] for window in windows]
    grid: Any = figure.add_gridspec(1, len(windows), width_ratios=ratios)
    for window, place in zip(windows, grid, strict=True):
        axes = figure.add_subplot(place)
        inside = ((turned.points >= window.low) & (turned.points <= window.high)).all(axis=1)
        scale = ScalarMappable(_scale(scale_of[:, inside], colours), colours)
        axes.add_collection(_front(turned, values, scale, window.line))
        (x, y, _), (width, height) = (window.low + window.high) / 2, window.half
        axes.set(xlim=(x - width, x + width), ylim=(y - height, y + height), aspect="equal")
        axes.set_axis_off()
        axes.set_title(window.title, fontsize=9)
        figure.colorbar(scale, ax=axes, orientation="horizontal", shrink=0.8, ticks=MaxNLocator(3))


def _front(mesh: FieldMesh, values: Floats, scale: ScalarMappable, line: float) -> PolyCollection:
    """The triangles as seen along z, from the farthest to the nearest. Triangles that face away from the light are darker."""
    corners = mesh.points[mesh.cells]
    across = normals(corners)
    light = np.abs(across @ _LIGHT) / np.linalg.norm(across, axis=1)
    faces = np.asarray(scale.to_rgba(values[mesh.cells].mean(axis=1)))
    faces[:, :3] *= (0.55 + 0.45 * light)[:, None]
    order = np.argsort(corners[:, :, 2].mean(axis=1))
    # Triangles have edges in their own colour; otherwise the white background would be visible between them.
    edges: Any = (0, 0, 0, 0.5) if line else faces[order]
    shown = list(corners[order, :, :2])
    return PolyCollection(shown, facecolors=faces[order], edgecolors=edges, linewidths=line or 0.2)
