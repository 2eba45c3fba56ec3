"""Scenes of muscles that several files of tests here ask about: a bar between two plates, and a box that is attached to nothing."""

import pytest
import small

from fem_reference.scenes import casefile


@pytest.fixture(scope="module")
def bar(tmp_path_factory):
    return small.write(tmp_path_factory.mktemp("problem") / "bar")


SQUEEZED = """
title = "A box between plates"
proves = "that bones may have a closed form and no attachment"
fibres.polylines = { file = "mesh:box/fibres.vtk", unit = "mm" }

[muscle]
surface = "mesh:box/box.ply"
unit = "mm"
tet_size = "20 mm"
mesher = "block"

[[bone]]
name = "floor"
half_space = { point = "0, 10, 0 mm", normal = [0, 1, 0] }

[[bone]]
name = "lid"
box = { centre = "0, 140, 0 mm", size = "400, 100, 400 mm" }
motion.direction = [0, -1, 0]
motion.keyframes = [{ frame = 0, distance = "0 mm" }, { frame = 100, distance = "40 mm" }]

[[effect]]
name = "neo_hooke"
mu = "10 kPa"

[[effect]]
name = "incompressible"
bulk = "1 MPa"

[[effect]]
name = "contact"
stiffness = "1 MPa/mm"

[[effect]]
name = "damping"
coefficient = "1 Pa s/mm^2"

[frames]
first = 0
last = 100
every = 50
interval = "1 s"

[reference]
solver = "fenicsx"

[[expect]]
of = "reference"
metric = "volume"
statistic = "deviation"
frame = "any"
truth = "0 %"
within = "90 %"
kind = "property"
because = "it is a body"

[negative_control]
key = "effect[0].mu"
value = "9 kPa"
because = "it is softer"
"""


@pytest.fixture(scope="module")
def squeezed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("problem") / "squeezed"
    folder.mkdir()
    (folder / "case.toml").write_text(SQUEEZED)
    return casefile.read(folder)
