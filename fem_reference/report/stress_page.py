"""The page of hard cases: a matrix with a row for each case, a column for each solver and a result in each cell."""

from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from fem_reference.assessment import stress
from fem_reference.assessment.stress import VERDICTS, History, Scene, Stress
from fem_reference.foundations.mesh import normals
from fem_reference.report.embedded import webp
from fem_reference.report.pages import Page

_MARKS = {"ok": "✓", "degraded": "~", "failed": "✗", "inconclusive": "?"}
_MARKS |= {"not applicable": "\N{EN DASH}", "no solution": "∅"}
_WITHOUT_DEFECT = ("ok", "not applicable", "no solution")
_SIDE, _OVERSAMPLING = 220, 2
# The camera looks along this direction, from the front, from above and from the right.
_VIEW = np.array([-0.55, 0.7, -0.45])
_MARK = "#3b6cf0"
_LIT, _DARK, _BACK, _EDGE = (205, 120, 110), (120, 55, 48), (90, 130, 190), (60, 30, 26)
_NO_PAPER = (255, 255, 255, 0)  # a transparent background, for light and dark pages
_LEFT, _RIGHT, _TOP, _FLOOR = 52, 290, 8, 120  # the ends of the axes in a drawing of 300 by 150 units


def page(found: Stress) -> Page:
    """The page of hard cases."""
    said, drawn = summary(found), {"picture": picture, "history": history}
    contents = {"stress": found, "verdicts": VERDICTS, "marks": _MARKS, "summary": said} | drawn
    return Page("hard cases", "Hard cases", (("", "", said),), "stress_page.html", contents, stress.facts(found))


def summary(found: Stress) -> str:
    """The number of cells with each verdict, in words."""
    counts = [sum(cell.verdict == verdict for cell in found.cells) for verdict in VERDICTS]
    parts = ", ".join(f"{count} {verdict}" for count, verdict in zip(counts, VERDICTS, strict=True))
    solvers = found.solvers[0] if len(found.solvers) == 1 else f"{len(found.solvers)} solvers"
    return f"{len(found.cases)} hard cases by {solvers}: {parts}"


def text(found: Stress) -> str:
    """The matrix as lines of text, with a sentence for each cell with a defect."""
    width = max((len(case.name) for case in found.cases), default=0)
    lines = [summary(found)]
    for case in found.cases:
        cells = [found.at(case.name, solver) for solver in found.solvers]
        lines.append(f"{case.name:{width}}  " + "  ".join(f"{cell.solver} {cell.verdict}" for cell in cells))
        lines += [f"  {cell.solver}: {cell.sentence}" for cell in cells if cell.verdict not in _WITHOUT_DEFECT]
    return "\n".join(lines)


def picture(scene: Scene) -> str:
    """The body as an image. Triangles are lit from the camera, and blue if their inner side is visible. A ring marks the position
    ``scene.place``.
    """
    forward = _VIEW / np.linalg.norm(_VIEW)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    camera = np.stack([right, -np.cross(right, forward), forward])
    seen = (scene.points - scene.points.mean(axis=0)) @ camera.T
    low, high = seen[:, :2].min(axis=0), seen[:, :2].max(axis=0)
    side = _SIDE * _OVERSAMPLING
    scale = 0.86 * side / max(float((high - low).max()), 1e-300)
    flat = (seen[:, :2] - (low + high) / 2) * scale + side / 2
    image = Image.new("RGBA", (side, side), _NO_PAPER)
    draw = ImageDraw.Draw(image)
    corners = seen[scene.triangles]
    across = normals(corners)
    facing = across[:, 2] / np.maximum(np.linalg.norm(across, axis=1), 1e-300)
    for i in np.argsort(-corners[:, :, 2].mean(axis=1)):
        outline = [(float(x), float(y)) for x, y in flat[scene.triangles[i]]]
        draw.polygon(outline, fill=_colour(float(facing[i])), outline=_EDGE)
    if scene.place is not None and np.isfinite(scene.place).all():
        x, y = ((scene.place - scene.points.mean(axis=0)) @ camera.T)[:2]
        x, y = (np.array([x, y]) - (low + high) / 2) * scale + side / 2
        for radius in (16, 17, 18):
            draw.ellipse((x - radius, y - radius, x + radius, y + radius), outline=_MARK)
    return webp(image.resize((_SIDE, _SIDE), Image.Resampling.LANCZOS), 80)


def _colour(facing: float) -> tuple[int, int, int]:
    """The colour of a triangle whose normal has the component ``facing`` along the view: if negative, the outer side is visible."""
    if facing > 0:
        return _BACK
    red, green, blue = (round(dark + (lit - dark) * -facing) for dark, lit in zip(_DARK, _LIT, strict=True))
    return red, green, blue


def history(of: History, bound: float) -> dict[str, Any]:
    """The drawing of a quantity over frames: its title, the ``points`` of its line, the positions of frames without a number
    (``lost``), the height of the bound (``limit``), and both ends of each axis. The axis of values is logarithmic if a value
    exceeds 30 times the ``bound``.
    """
    values = np.asarray(of.values, float)
    known = np.isfinite(values)
    top = float(np.max(np.append(values[known], bound), initial=0.0))
    far = top > 30 * bound > 0
    low = bound / 30 if far else 0.0

    def height(value: float) -> float:
        share = value / top if top > 0 else 0.0
        if far:
            share = np.log(max(value, low) / low) / np.log(top / low)
        return _TOP + (_FLOOR - _TOP) * (1 - float(np.clip(share, 0, 1)))

    first, last = of.numbers[0], of.numbers[-1]
    along = [_LEFT + (_RIGHT - _LEFT) * (frame - first) / max(last - first, 1) for frame in of.numbers]
    return {
        "title": f"{of.quantity.replace('_', ' ')}{', ' + of.unit if of.unit else ''}",
        "points": [(x, height(value)) for x, value in zip(along, values, strict=True) if np.isfinite(value)],
        "lost": [x for x, one in zip(along, known, strict=True) if not one],
        "limit": height(bound),
        "frames": (first, last),
        "ends": ((low, _FLOOR), (top, height(top) + 4)),
    }
