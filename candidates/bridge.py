"""Shared part of third-party solvers: it reads an exported scene in SI units, moves its bones, and writes the frames.

A candidate is a class with ``step(held, bones)``, ``positions()`` and ``lost``; ``main`` runs it. Its file states law, element,
contact, threads, units and what it cannot take; the ``candidate.toml`` next to it states the effects that it ``takes`` besides its
law. Parts of a scene that it leaves out are printed, and stored in ``candidate.toml`` with the frames. It needs numpy and meshio.
"""

import argparse
import csv
import json
import os
import sys
import time
import tomllib
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, NoReturn, Protocol

import meshio
import numpy as np

METRE = 1e-3  # the unit of length of the scene [m]
DENSITY = 1060.0  # density of muscle [kg/m^3]: Mendez and Keys 1960, Metabolism 9
STEP = 0.01  # length of a step [s], independent of the scene's interval: the truth is in equilibrium in each frame
DAMPING = 0.9  # fraction of the velocities that remains after a step
LAW = ("neo_hooke", "incompressible")  # effects of the scene that the law of a candidate replaces


def _rows(path: Path) -> list[list[str]]:
    return list(csv.reader(path.read_text().splitlines()))[1:]


@dataclass(frozen=True)
class Bone:
    """A rigid surface at rest that the muscle may touch: ``points`` (n, 3) [m], ``triangles`` (t, 3)."""

    name: str
    points: np.ndarray
    triangles: np.ndarray


@dataclass(frozen=True)
class Scene:
    """A muscle at rest: ``points`` (n, 3) [m], ``tets`` (e, 4), vertices ``held`` (h,) by the bones ``holders`` (h,); ``mu`` and
    ``bulk`` [Pa]; ``poses[bone][frame]`` (4, 4) [m]; ``bones`` in contact; ``effects``: what acts, by name or in words.
    """

    points: np.ndarray
    tets: np.ndarray
    held: np.ndarray
    holders: np.ndarray
    mu: float
    bulk: float
    bones: tuple[Bone, ...]
    poses: dict[str, dict[int, np.ndarray]]
    frames: list[int]
    effects: tuple[str, ...]

    @property
    def masses(self) -> np.ndarray:
        """Mass at each vertex (n,) [kg]."""
        return np.bincount(self.tets.ravel(), np.repeat(self.volumes * DENSITY / 4, 4), len(self.points))

    @property
    def volumes(self) -> np.ndarray:
        """Volume of each tetrahedron (e,) [m^3]."""
        corners = self.points[self.tets]
        return np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6

    def lame(self, most: float) -> tuple[float, float, float]:
        """Young's modulus, lambda [Pa] and Poisson's ratio, which is at most ``most``, for the mu of the scene."""
        ratio = min((3 * self.bulk - 2 * self.mu) / (2 * (3 * self.bulk + self.mu)), most)
        return 2 * self.mu * (1 + ratio), 2 * self.mu * ratio / (1 - 2 * ratio), ratio

    def boundary(self) -> np.ndarray:
        """Outward triangles (t, 3) of the surface of the tetrahedra."""
        faces = self.tets[:, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]].reshape(-1, 3)
        _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
        return faces[first[count == 1]]

    def pose(self, bone: str, before: int, after: int, share: float) -> np.ndarray:
        """The rigid motion (4, 4) at a fraction ``share`` of the path from one frame to the next."""
        mixed = (1 - share) * self.poses[bone][before] + share * self.poses[bone][after]
        u, _, v = np.linalg.svd(mixed[:3, :3])
        mixed[:3, :3] = u @ v
        return mixed

    def attached(self, poses: dict[str, np.ndarray]) -> np.ndarray:
        """Positions (h, 3) [m] of the held vertices, each moved with its bone."""
        at = np.array([poses[bone] for bone in self.holders]).reshape(-1, 4, 4)
        return np.einsum("hij,hj->hi", at[:, :3, :3], self.points[self.held]) + at[:, :3, 3]


class Solver(Protocol):
    """A third-party solver, set up with a scene at rest; ``lost``: the parts of the scene that it dropped, in words."""

    lost: tuple[str, ...]

    def step(self, held: np.ndarray, bones: dict[str, np.ndarray]) -> None:
        """Advance by ``STEP``, with vertices ``held`` at (h, 3) [m] and ``bones`` at their poses (4, 4)."""

    def positions(self) -> np.ndarray:
        """Positions of all vertices (n, 3) [m]."""


def refuse(why: str) -> NoReturn:
    """Print a sentence and exit with the status of a program that does not accept the scene."""
    print(why)
    sys.exit(77)


def read(folder: Path) -> Scene:
    """The scene that ``export`` wrote into a ``folder``; refused without the laws that the law of a candidate replaces."""
    said, mesh = json.loads((folder / "scene.json").read_text()), meshio.read(folder / "tets.vtu")
    laws = dict[str, Any]()  # of the first region, if there are several
    for effect in said["effects"]:
        laws.setdefault(effect["name"], effect["parameters"])
    if not set(LAW) <= set(laws):
        refuse(f"the scene has {', '.join(laws)}; wanted {' and '.join(LAW)}, which the law of the solver replaces")
    tets = mesh.cells_dict["tetra"]
    corners = mesh.points[tets]
    turned = np.linalg.det(corners[:, 1:] - corners[:, :1]) < 0
    tets[turned] = tets[turned][:, [0, 2, 1, 3]]
    mu, size = laws["neo_hooke"]["mu"]["value"], np.linalg.norm(np.ptp(mesh.points, axis=0))
    springs = {one["name"]: one["stiffness"] for one in said["attachments"] if one["stiffness"] is not None}
    free = {name for name, stiffness in springs.items() if stiffness * size < mu}  # softer than the muscle
    facets = [row for row in _rows(folder / "attachment_facets.csv") if row[0] not in free]
    holders = {int(point): bone for _, bone, *facet in facets for point in facet}
    poses: dict[str, dict[int, np.ndarray]] = {}
    for bone, frame, *numbers in _rows(folder / "poses.csv"):
        matrix = np.array(numbers, float).reshape(4, 4)
        matrix[:3, 3] *= METRE
        poses.setdefault(bone, {})[int(frame)] = matrix
    bones = [(bone["name"], meshio.read(folder / bone["file"])) for bone in said["bones"] if bone.get("obstacle")]
    softer = [f"springs of {name} ({'left free' if name in free else 'held exactly'})" for name in springs]
    inner = [f"{one['name']} in {one['in']}" for one in said["effects"] if laws[one["name"]] is not one["parameters"]]
    return Scene(
        points=mesh.points * METRE,
        tets=tets,
        held=np.array(sorted(holders), int),
        holders=np.array([holders[point] for point in sorted(holders)]),
        mu=mu * 1e6,
        bulk=laws["incompressible"]["bulk"]["value"] * 1e6,
        bones=tuple(Bone(name, bone.points * METRE, bone.cells_dict["triangle"]) for name, bone in bones),
        poses=poses,
        frames=said["frames"],
        effects=(*laws, *softer, *inner),
    )


class Skin:
    """The surface whose vertices are requested, each carried by a tetrahedron: rest positions plus the displacement there."""

    def __init__(self, folder: Path, scene: Scene) -> None:
        rows, tets = _rows(folder / "surface_in_tets.csv"), meshio.read(folder / "tets.vtu").cells_dict["tetra"]
        self.rest, self.scene = meshio.read(folder / "muscle.ply"), scene
        self.corners, self.shares = tets[[int(row[1]) for row in rows]], np.array([row[2:] for row in rows], float)

    def moved(self, positions: np.ndarray) -> np.ndarray:
        """Positions (v, 3) [mm] of the surface, with the vertices of the tetrahedra at ``positions`` (n, 3) [m]."""
        away = (positions - self.scene.points)[self.corners]
        return self.rest.points + np.einsum("vc,vcd->vd", self.shares, away) / METRE

    def write(self, path: Path, positions: np.ndarray) -> None:
        """Write a frame [mm]."""
        meshio.Mesh(self.moved(positions), self.rest.cells).write(path)


def drive(solver: Solver, scene: Scene, steps: int, keep: Any) -> float:
    """Move the bones from frame to frame in the first half of the ``steps``, and keep them still in the second. Pass each frame to
    ``keep(frame, positions)``. Return the time [s] that the solver took.
    """
    spent = 0.0
    for before, after in zip([scene.frames[0], *scene.frames], scene.frames, strict=False):
        begin = time.perf_counter()
        for step in range(1, steps + 1) if after != before else ():
            poses = {bone: scene.pose(bone, before, after, min(1.0, 2 * step / steps)) for bone in scene.poses}
            solver.step(scene.attached(poses), poses)
        spent += time.perf_counter() - begin
        keep(after, solver.positions())
    return spent


def main(make: Any, package: str, **kinds: type) -> None:
    """Run a candidate of a ``package`` on the scene and write frames; ``kinds``: its settings besides ``steps``."""
    if hasattr(os, "sched_setaffinity"):  # one core, however many threads its library starts
        mine = sorted(os.sched_getaffinity(0))
        os.sched_setaffinity(0, {mine[os.getpid() % len(mine)]})
    words = argparse.ArgumentParser()
    for name, kind in {"steps": int, **kinds}.items():
        words.add_argument(f"--{name}", type=kind, required=True)
    words.add_argument("scene", type=Path)
    words.add_argument("out", type=Path)
    given = vars(words.parse_args())
    folder, out, steps = given.pop("scene"), given.pop("out"), given.pop("steps")
    scene = read(folder)
    takes = tomllib.loads(Path(sys.argv[0]).with_name("candidate.toml").read_text()).get("takes", [])
    if not len(scene.held) and "contact" not in takes:
        refuse("no vertex is held by a bone, and contact is left out: nothing moves the muscle")
    skin, solver = Skin(folder, scene), make(scene, **given)
    left_out = [effect for effect in scene.effects if effect not in (*LAW, *takes)] + list(solver.lost)
    spent = drive(solver, scene, steps, lambda frame, points: skin.write(out / f"frame_{frame:04d}.ply", points))
    numbers = scene.frames[-1] - scene.frames[0]
    about = f'version = "{package}-{version(package)}"\nunit = "mm"\nseconds_per_frame = {spent / numbers:.6g}\nthreads = 1\n'
    (out / "candidate.toml").write_text(f"{about}left_out = {json.dumps(left_out)}\n")
    print("left out:", ", ".join(left_out) or "nothing")
