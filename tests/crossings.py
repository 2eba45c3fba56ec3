"""A coarse bar between two plates with a ball that goes through it, and runs of it."""

from functools import cache
from pathlib import Path

import numpy as np
import shapes

from fem_reference.foundations.mesh import Surface
from fem_reference.geometry.rigid_bodies import Sphere
from fem_reference.geometry.tessellation import tessellated
from fem_reference.io import files
from fem_reference.problems import of_case
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.runs.store import Outcome, Run
from fem_reference.scenes import casefile

CONVERGED = Outcome("converged", "all frames reached")


def ball(radius: float, at=(0.0, 0.0, 0.0)) -> tuple[Surface, Sphere]:
    form = Sphere(at, radius)
    return tessellated(form, np.zeros((1, 3)), "ball"), form


BLOCK = shapes.skin(shapes.box((2, 2, 3), (10, 10, 40)))


SCENE = """
title = "A ball through a coarse bar"
proves = "what crosses is denied"
effects = "listed"
[muscle]
surface = "bar.ply"
unit = "mm"
tet_size = "5 mm"
mesher = "block"
[[bone]]
name = "floor"
box = { centre = "5, 5, -5.5 mm", size = "20, 20, 10 mm", rounding = "0 mm" }
[[bone]]
name = "lid"
box = { centre = "5, 5, 45.5 mm", size = "20, 20, 10 mm", rounding = "0 mm" }
[[bone]]
name = "ball"
sphere = { centre = "-6, 5, 20 mm", radius = "3 mm" }
[bone.motion]
direction = [1, 0, 0]
keyframes = [{ frame = 0, distance = "0 mm" }, { frame = 20, distance = "22 mm" }]
[[attachment]]
name = "low"
bone = "floor"
within = "1 mm"
[[attachment]]
name = "high"
bone = "lid"
within = "1 mm"
[[effect]]
name = "neo_hooke"
mu = "10 kPa"
[[effect]]
name = "incompressible"
bulk = "10 MPa"
[[effect]]
name = "contact"
stiffness = "500 kPa/mm"
[fibres.traced]
count = 4
start = "low"
end = "high"
[frames]
first = 0
last = 20
every = 5
[reference]
solver = "fenicsx"
[[expect]]
of = "reference"
metric = "volume"
statistic = "deviation"
frame = "any"
truth = "0 %"
within = "0.5 %"
kind = "property"
because = "it is next to incompressible"
[[expect]]
of = "candidates"
metric = "surface_deviation"
statistic = "max"
frame = "any"
truth = "0 mm"
within = "1 mm"
kind = "property"
because = "it is the same"
"""


@cache
def coarse(folder: Path) -> MuscleProblem:
    """The bar whose surface has 2 x 2 x 3 cells."""
    files.write_surface(folder / "bar.ply", BLOCK, BLOCK.points)
    (folder / "case.toml").write_text(SCENE.replace('effects = "listed"\n', ""))
    case = casefile.read(folder)
    return of_case.problem(case, of_case.setup(case))


def resting(problem: MuscleProblem, **scalars) -> Run:
    positions = np.broadcast_to(problem.surface.points, (len(problem.frames), *problem.surface.points.shape))
    return Run("reference", "fenicsx", CONVERGED, problem.frames, problem.surface, positions, scalars=scalars)
