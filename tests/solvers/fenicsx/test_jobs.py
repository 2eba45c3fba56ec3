"""States to go on from: those of this mesh; anything else in the folder is removed."""

import json
from dataclasses import replace

import numpy as np

from fem_reference.foundations.mesh import fingerprint
from fem_reference.problems import shapes
from fem_reference.problems.body import Body
from fem_reference.problems.touching import Touching
from fem_reference.runs.states import write_arrays
from fem_reference.runs.writer import CutOff
from fem_reference.solvers.fenicsx.jobs import kept
from fem_reference.verification import parts

BODY = Body(shapes.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron"), parts.neo_hooke(0.01, 10.0), (), (0.0, 1.0))


def left(folder, number: int, **facts: object) -> None:
    """What an earlier process left of a frame."""
    known = {"mesh": fingerprint(BODY.mesh.points, BODY.mesh.cells)} | facts
    write_arrays(folder / f"frame_{number:04d}.npz", {"facts": np.array(json.dumps(known))})


def test_states_of_this_mesh_are_gone_on_from(tmp_path) -> None:
    for number in (0, 5):
        left(tmp_path, number)
    (tmp_path / "strange.txt").write_text("of nobody", encoding="utf-8")
    found = kept(CutOff(tmp_path, (0, 5)), BODY)
    assert found.frames == (0, 5)
    assert found.place(5).is_file()
    assert not (tmp_path / "strange.txt").exists()


def test_states_whose_contact_depends_on_those_before_are_not_gone_on_from(tmp_path) -> None:
    laws = {"itself": Touching("z1", "z1", 1.0, 0.1), "friction": Touching("z1", "z0", 1.0, 0.1, friction=0.2)}
    laws["two parts"] = replace(laws["friction"], friction=None)
    for name, law in laws.items():
        left(tmp_path, 0)
        found = kept(CutOff(tmp_path, (0,)), replace(BODY, touching=(law,)))
        assert found.frames == ((0,) if name == "two parts" else ())


def test_states_of_something_else_are_removed(tmp_path) -> None:
    left(tmp_path, 0)
    left(tmp_path, 5, mesh="another")
    assert kept(CutOff(tmp_path, (0, 5)), BODY).frames == (0,)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["frame_0000.npz"]
