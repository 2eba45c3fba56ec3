"""Cases with random muscles that a seed determines: a spindle or a strap between two bones, with motion and activation."""

from collections.abc import Sequence
from pathlib import Path
from string import Template

import numpy as np

from fem_reference.foundations.mesh import Floats, Surface, enclosed_volume
from fem_reference.io import files
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MuscleCase

EVERY = 10  # the difference between the frame numbers of successive poses
# The number of vertices around and along each surface. Vertices with the same index in two muscles correspond.
_AROUND, _ALONG = 20, 21
_TETS = 150  # the approximate number of tetrahedra, each of which is then cut into eight
_MOTION = "motion = {{ {kind}, keyframes = [{keys}] }}\n"
_OBSTACLE = """
[[bone]]
name = "obstacle"
capsule = {{ start = "{start} mm", end = "{end} mm", radius = "{radius:.4g} mm" }}
{motion}"""
_CONTACT = """
[[effect]]
name = "contact"
stiffness = "{:.4g} kPa/mm"
smoothing = "0.3 mm"
bones = ["obstacle"]
"""
_ACTIVE = """
[[effect]]
name = "fibre_active"
stress = "300 kPa"
optimal_stretch = 1.0
ramp = [{}]
"""

_PARALLEL = 'traced]\ncount = 25\nflux = "area"'
_PENNATE = """kohout_kukacka]
count = 25
contours = 12
template = "pennate"
towards = [1, 0, 0]
pennation = "{:.4g} deg\""""


def shape(rng: np.random.Generator) -> tuple[Surface, float]:
    """A closed surface along z, and its length [mm]. It has elliptical sections, and flat ends at z = 0 and z = length."""
    length, wide = rng.uniform(50, 110), rng.uniform(9, 16)
    flat, first, last = rng.uniform(0.55, 1), rng.uniform(0.5, 0.95), rng.uniform(0.5, 0.95)
    belly, bow = rng.uniform(0.35, 0.65), rng.uniform(0, 0.1) * length
    z = np.linspace(0, 1, _ALONG)
    rise = np.where(z < belly, z / belly, (1 - z) / (1 - belly))
    ends = np.where(z < belly, first, last)
    radii = wide * (ends + (1 - ends) * np.sin(np.pi / 2 * rise))
    angles = 2 * np.pi * np.arange(_AROUND) / _AROUND
    x = radii[:, None] * np.cos(angles) + bow * np.sin(np.pi * z)[:, None]
    y = flat * radii[:, None] * np.sin(angles)
    rings = np.stack([x, y, np.broadcast_to(length * z[:, None], x.shape)], axis=-1)
    here = np.arange(_AROUND * _ALONG).reshape(_ALONG, _AROUND)
    right, middle = np.roll(here, -1, axis=1), np.full(_AROUND, _AROUND * _ALONG)
    sides = [here[:-1], right[:-1], here[1:]], [right[:-1], right[1:], here[1:]]
    caps = [middle, right[0], here[0]], [middle + 1, here[-1], right[-1]]
    triangles = np.concatenate([np.stack(part, axis=-1).reshape(-1, 3) for part in (*sides, *caps)])
    return Surface(np.concatenate([rings.reshape(-1, 3), [[0, 0, 0], [0, 0, length]]]), triangles), length


def _text(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.5g}" for value in values)


def _keys(name: str, unit: str, amounts: Floats) -> str:
    """The text of keyframes with the value 0 at frame 0, followed by the ``amounts`` (f,)."""
    quote = '"' if unit else ""
    values = [0.0, *amounts]
    return ", ".join(
        f"{{ frame = {EVERY * i}, {name} = {quote}{value:.4f} {unit}".rstrip() + f"{quote} }}"
        for i, value in enumerate(values)
    )


def _turn(axis: Sequence[float], centre: Sequence[float], amounts: Floats) -> str:
    kind = f'axis = [{_text(axis)}], centre = "{_text(centre)} mm"'
    return _MOTION.format(kind=kind, keys=_keys("angle", "deg", amounts))


def write(folder: Path, seed: int, number: int, poses: int) -> MuscleCase:
    """Write muscle ``number`` of a ``seed`` into a ``folder``, with rest and the given number of random ``poses``; return its case.

    The lower bone rotates about an axis next to the muscle. Of every three muscles, two have an upper bone that rotates about
    another axis, one has an obstacle that slides into its side, and two are activated. The seed and the number determine all random
    values.
    """
    rng = np.random.default_rng([seed, number])
    surface, length = shape(rng)
    volume = enclosed_volume(surface.points, surface.triangles)
    values = {"seed": seed, "number": number, "top": f"{length + 5.5:.6g}", "every": EVERY, "last": EVERY * poses}
    values |= {"size": f"{np.cbrt(6 * np.sqrt(2) * volume / _TETS):.4g}"} | _drawn(rng, surface, number, poses)
    template = Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
    files.make_folder(folder)
    if not (folder / "muscle.ply").exists():  # another process may be reading the same file
        files.write_surface(folder / "muscle.ply", surface, surface.points)
    files.write_text(folder / "case.toml", Template(template).substitute(values))
    return casefile.read_muscle(folder)


def _drawn(rng: np.random.Generator, surface: Surface, number: int, poses: int) -> dict[str, object]:
    """Material, fibres and motion of muscle ``number``, as text for its case file."""
    length, side = surface.points[:, 2].max(), surface.points[:, 1].max()
    leans, arm, mu = rng.uniform(0, 2 * np.pi), rng.uniform(12, 30), np.exp(rng.uniform(*np.log([10, 40])))
    along, centre = [np.cos(leans), np.sin(leans), 0], [-arm * np.sin(leans), arm * np.cos(leans), 0]
    lower = np.degrees(length / arm) * rng.uniform(-0.02, 0.1, poses)  # stretches the centre line by at most a tenth
    found: dict[str, object] = {"mu": f"{mu:.4g}", "lower": _turn(along, centre, lower)}
    found |= {"upper": "", "obstacle": "", "effects": ""}
    axis, upper = rng.normal(size=3), rng.uniform(-10, 10, poses)
    if number % 3:
        found["upper"] = _turn((axis / np.linalg.norm(axis)).tolist(), (0, 0, length), upper)
    radius, gap, height = rng.uniform(5, 9), rng.uniform(1, 3), rng.uniform(0.4, 0.6) * length
    slides = rng.uniform(0, gap + 0.2 * side, poses)
    if number % 3 == 2:
        start, end = (_text((x, side + radius + gap, height)) for x in (-40, 40))
        motion = _MOTION.format(kind="direction = [0, -1, 0]", keys=_keys("distance", "mm", slides))
        found["obstacle"] = _OBSTACLE.format(start=start, end=end, radius=radius, motion=motion)
        found["effects"] = _CONTACT.format(100 * mu)
    if number % 3 != 1:
        found["effects"] = f"{found['effects']}{_ACTIVE.format(_keys('amount', '', rng.uniform(0, 0.15, poses)))}"
    return found | {"fibres": _PENNATE.format(rng.uniform(5, 25)) if number % 2 else _PARALLEL}
