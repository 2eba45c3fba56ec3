"""The page of hard cases: a matrix of cases by solvers, and what happened in each cell."""

import base64
import io
from html import escape

import numpy as np
from PIL import Image, ImageDraw

from fem_reference.assessment.stress import VERDICTS, History, Scene, Stress
from fem_reference.report.templates import template
from fem_reference.report.words import number

_MARKS = {"ok": "✓", "degraded": "~", "failed": "✗", "refused": "\N{EN DASH}", "inconclusive": "?"}
_SIDE, _OVERSAMPLING = 220, 2
# The camera looks along this direction, from in front, above and to the right.
_VIEW = np.array([-0.55, 0.7, -0.45])
_PAPER, _LIT, _DARK, _BACK, _EDGE, _MARK = (
    "#ffffff",
    (205, 120, 110),
    (120, 55, 48),
    (90, 130, 190),
    (60, 30, 26),
    "#1f4fd8",
)
_WIDTH, _HEIGHT, _LEFT, _BELOW = 300, 150, 52, 30


def render(stress: Stress) -> str:
    """The whole page as text."""
    return template("stress_page.html").render(
        stress=stress,
        title="Hard cases",
        verdicts=VERDICTS,
        marks=_MARKS,
        summary=summary(stress),
        picture=picture,
        curve=curve,
    )


def summary(stress: Stress) -> str:
    """How many cells there are of each verdict, in words."""
    counts = [sum(cell.verdict == verdict for cell in stress.cells) for verdict in VERDICTS]
    parts = ", ".join(f"{count} {verdict}" for count, verdict in zip(counts, VERDICTS, strict=True))
    return f"{len(stress.cases)} hard cases by {len(stress.solvers)} solvers: {parts}"


def text(stress: Stress) -> str:
    """What is printed: the matrix as lines, and a sentence for all that is not ok."""
    width = max((len(case.name) for case in stress.cases), default=0)
    lines = [summary(stress)]
    for case in stress.cases:
        found = [stress.at(case.name, solver) for solver in stress.solvers]
        lines.append(f"{case.name:{width}}  " + "  ".join(f"{cell.solver} {cell.verdict}" for cell in found))
        lines += [f"  {cell.solver}: {cell.sentence}" for cell in found if cell.verdict not in ("ok", "refused")]
    return "\n".join(lines)


def picture(scene: Scene) -> str:
    """The body as an image for a page: triangles lit from the camera, blue where one sees their inner side, and a ring around the
    place.
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
    image = Image.new("RGB", (side, side), _PAPER)
    draw = ImageDraw.Draw(image)
    corners = seen[scene.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing = normals[:, 2] / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)
    for i in np.argsort(-corners[:, :, 2].mean(axis=1)):
        outline = [(float(x), float(y)) for x, y in flat[scene.triangles[i]]]
        draw.polygon(outline, fill=_colour(float(facing[i])), outline=_EDGE)
    if scene.place is not None and np.isfinite(scene.place).all():
        x, y = ((scene.place - scene.points.mean(axis=0)) @ camera.T)[:2]
        x, y = (np.array([x, y]) - (low + high) / 2) * scale + side / 2
        for radius in (16, 17, 18):
            draw.ellipse((x - radius, y - radius, x + radius, y + radius), outline=_MARK)
    out = io.BytesIO()
    image.resize((_SIDE, _SIDE), Image.Resampling.LANCZOS).save(out, "WEBP", quality=80, method=4)
    return f"data:image/webp;base64,{base64.b64encode(out.getvalue()).decode()}"


def _colour(facing: float) -> tuple[int, int, int]:
    """Of a triangle whose normal has this component along the view: below 0 its outer side is seen."""
    if facing > 0:
        return _BACK
    red, green, blue = (round(dark + (lit - dark) * -facing) for dark, lit in zip(_DARK, _LIT, strict=True))
    return red, green, blue


def curve(history: History, bound: float) -> str:
    """A quantity over frames as SVG, with what a healthy run keeps below as a broken line; logarithmic where it spans decades."""
    values = np.asarray(history.values, float)
    shown = np.where(np.isfinite(values), values, np.nan)
    top = float(np.nanmax(np.append(shown, bound), initial=0.0))
    logarithmic = top > 30 * bound > 0
    low = bound / 30 if logarithmic else 0.0

    def height(value: float) -> float:
        share = value / top if top > 0 else 0.0
        if logarithmic:
            share = np.log(max(value, low) / low) / np.log(top / low)
        return 8 + (_HEIGHT - _BELOW - 8) * (1 - float(np.clip(share, 0, 1)))

    first, last = history.numbers[0], history.numbers[-1]

    def along(frame: float) -> float:
        return _LEFT + (_WIDTH - _LEFT - 10) * (frame - first) / max(last - first, 1)

    dots = [f"{along(n):.1f},{height(v):.1f}" for n, v in zip(history.numbers, shown, strict=True) if np.isfinite(v)]
    lost = [
        f'<text x="{along(n):.1f}" y="20" class="lost">✗</text>'
        for n, v in zip(history.numbers, shown, strict=True)
        if not np.isfinite(v)
    ]
    limit, floor = height(bound), _HEIGHT - _BELOW
    title = escape(f"{history.quantity.replace('_', ' ')}{', ' + history.unit if history.unit else ''}")
    return (
        f'<svg viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" aria-label="{title} over frames" class="history">'
        f'<path d="M{_LEFT} 8V{floor}H{_WIDTH - 10}" class="axis"/>'
        f'<path d="M{_LEFT} {limit:.1f}H{_WIDTH - 10}" class="limit"/>'
        f'<polyline points="{" ".join(dots)}" class="line"/>{"".join(lost)}'
        f'<text x="{_LEFT - 4}" y="{height(top) + 4:.1f}" class="end">{number(top)}</text>'
        f'<text x="{_LEFT - 4}" y="{floor}" class="end">{number(low)}</text>'
        f'<text x="{_LEFT}" y="{_HEIGHT - 16}">{first}</text>'
        f'<text x="{_WIDTH - 10}" y="{_HEIGHT - 16}" class="end">{last}</text>'
        f'<text x="{(_LEFT + _WIDTH) / 2}" y="{_HEIGHT - 4}" class="middle">{title} over frames</text></svg>'
    )
