"""The bar of which other people's solvers were measured: 90 x 30 x 30 mm, one end fixed, the other turned by 1 rad."""

from pathlib import Path

import shapes

from fem_reference.io import files

CASE = """
title = "A bar whose end turns by 1 rad"
proves = "the exchange with solvers of other people"
muscle = { surface = "bar.vtp", unit = "mm", tet_size = "10 mm", mesher = "block" }
fibres = { traced = { count = 4, start = "left", end = "right" } }
frames = { first = 0, last = 20, every = 10 }
reference = { solver = "fenicsx" }
attachment = [{ name = "left", bone = "fixed", within = "1.5 mm" }, { name = "right", bone = "turning", within = "1.5 mm" }]
effect = [{ name = "neo_hooke", mu = "10 kPa" }, { name = "incompressible", bulk = "96.6666666666667 kPa" }]
[[bone]]
name = "fixed"
box = { centre = "-6, 15, 15 mm", size = "10, 60, 60 mm" }
[[bone]]
name = "turning"
box = { centre = "96, 15, 15 mm", size = "10, 60, 60 mm" }
motion = { axis = [0, 0, 1], centre = "45, 0, 15 mm", keyframes = [
    { frame = 0, angle = "0 rad" }, { frame = 20, angle = "-1 rad" }] }
"""


def write(folder: Path) -> Path:
    """The scene in ``folder``, whose tetrahedra are 486; returns the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    skin = shapes.skin(shapes.box((9, 3, 3), (90, 30, 30)))
    files.write_surface(folder / "bar.vtp", skin, skin.points)
    (folder / "case.toml").write_text(CASE)
    return folder
