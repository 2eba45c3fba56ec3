"""Blocks are whole, held where they can be, and moved at random alike."""

import numpy as np
import pytest
from hard_cases import CASES

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import tet_volumes
from fem_reference.studies.hard import blocks, records, running


@pytest.mark.slow
@pytest.mark.parametrize("hard", [hard for hard in CASES.values() if hard.block], ids=lambda hard: hard.name)
def test_blocks_are_whole(hard) -> None:
    problem = blocks.problem(hard)
    assert tet_volumes(problem.mesh.points, problem.mesh.tets).min() > 0
    assert all(len(problem.mesh.facets[entry.attachment]) for entry in problem.attached)
    assert np.isin(problem.surface.points, problem.mesh.points).all()
    assert hard.healthy


def test_holds_that_would_tear_an_edge_are_refused() -> None:
    """Whichever came last would win at the vertices that faces share."""
    hard = CASES["twist.whole_turn"]
    bottom, top = hard.hold
    for other in ("x0", "y1"):
        torn = hard.model_copy(update={"hold": (top, bottom.model_copy(update={"face": other}))})
        with pytest.raises(
            InputError, match=rf"hold\[1\]\.face: got {other}, which shares 4 vertices with z1 and moves diff"
        ):
            blocks.problem(torn)
        found = running.cell(running.Posed(torn), records.choices()["pbd"])
        assert (found.verdict, "moves differently" in found.sentence) == ("not applicable", True)
    # Faces that move alike may meet, as may the middle of one.
    alike = (top, top.model_copy(update={"face": "x0"}))
    assert len(blocks.problem(hard.model_copy(update={"hold": alike})).attached) == 2
    middle = (top, bottom.model_copy(update={"face": "x0", "middle": True}))
    assert len(blocks.problem(hard.model_copy(update={"hold": middle})).attached) == 2


@pytest.mark.parametrize(
    ("name", "got", "want"),
    [
        ("bones.deep_overlap", "5.9 mm of overlap with the muscle at rest", "in the middle of the bone, 6 mm deep"),
        ("degenerate.coincident", r"2.8e\+07 times as long as thick", "double precision"),
    ],
)
def test_what_no_mesh_and_no_direction_resolves_is_refused(name, got, want) -> None:
    with pytest.raises(InputError, match=f"got {got}, want less.*{want}"):
        _ = blocks.problem(CASES[name]).body


def test_bodies_beside_a_block_are_muscles_of_one_problem() -> None:
    built = blocks.several(CASES["neighbours.row"])
    assert list(built.problems) == ["block", "middle", "upper"]
    assert built.pairs == (("block", "middle"), ("block", "upper"), ("middle", "upper"))
    assert built.apart
    names = [bone.name for bone in built.bones]
    assert len(names) == len(set(names)) == 3
    for one in built.problems.values():
        assert one.bones == built.bones
        assert all(entry.bone in one.bones for entry in one.attached)
        assert one.body.touching == ()  # none touches itself
    hard = CASES["neighbours.stiff"]
    soft, stiff = blocks.several(hard).problems.values()
    assert [one.effects[0].mu for one in (soft, stiff)] == [0.01, 10.0]
    alone = blocks.several(hard.model_copy(update={"effect": hard.effect[:2]}))
    assert (alone.law, alone.pairs, alone.apart) == (None, (), True)


def test_a_rounded_block_is_between_a_box_and_an_ellipsoid() -> None:
    """Corners of a cube are at the root of 3, those of a ball at 1; the middles of faces stay."""
    block = records.Lattice(size="2, 4, 6 mm", cells=(2, 2, 2), corner="-1, -2, -3 mm", rounding=0.7)
    hard = CASES["at_rest.millimetres"].model_copy(update={"block": block})
    unit = blocks.problem(hard).mesh.points / [1, 2, 3]
    away = np.sort(np.linalg.norm(unit, axis=1))
    assert away[0] == 0
    assert away[1:7] == pytest.approx(np.ones(6))
    assert away[-8:] == pytest.approx(np.full(8, 0.3 * np.sqrt(3) + 0.7))
