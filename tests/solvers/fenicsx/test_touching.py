"""Contact between parts of the surface: forces and moments balance, both sides are alike, and nothing passes unseen."""

from dataclasses import replace

import numpy as np
import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.geometry.rigid_bodies import HalfSpace
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Cells, Prescribed
from fem_reference.problems.contact import ContactBone, ContactLaw
from fem_reference.problems.paths import Affine
from fem_reference.problems.touching import Touching
from fem_reference.solvers import fenicsx, scikit_fem
from fem_reference.verification import parts

pytestmark = pytest.mark.slow

LAW = Touching("low_z1", "high_z0", 1.0, 0.02)
SOFT = parts.neo_hooke(0.01, 10.0)
STABLE = fenicsx.BodySettings(element="Q1/P0", follow="stable")


def placed(mesh: Cells, *shift: float, turn=((1.0, 0, 0), (0, 1, 0), (0, 0, 1))) -> Cells:
    """The mesh turned and then moved."""
    return replace(mesh, points=mesh.points @ np.array(turn) + shift)


def block(counts: tuple[int, int, int], size: tuple[float, float, float] = (1.0, 1.0, 0.5)) -> Cells:
    return shapes.box(counts, size, "hexahedron")


def moved(*shift: float) -> Affine:
    """The path from rest to a ``shift`` [mm] at frame 1."""
    return Affine(parts.NO_GRADIENT, shift)


def pair(low: Cells, high: Cells, *shift: float, law: Touching = LAW) -> Body:
    """Two pieces, the lower one clamped below, the upper one moved at its top."""
    prescribed = (*parts.clamped("low_z0"), Prescribed("top", "high_z1", (0, 1, 2), moved(*shift)))
    return Body(shapes.joined({"low": low, "high": high}), SOFT, prescribed, (0.0, 1.0), touching=(law,))


def at_rest(_: float) -> np.ndarray:
    return np.eye(4)


def solved(lab, body: Body, **settings):
    return lab.solve(body, "Q1/P0", **({"first_step": 0.5, "residual": 1e-12} | settings))


def test_pieces_of_one_mesh_do_not_feel_each_other_without_contact(fem_lab) -> None:
    low, high = block((2, 2, 1)), placed(block((1, 1, 1)), 0.1, 0.2, 0.4)  # they overlap
    top = Prescribed("top", "z1", (0, 1, 2), moved(0.1, 0.0, -0.1))
    alone = Body(high, SOFT, (top, *parts.clamped("z0")), (0.0, 1.0))
    clamped = replace(pair(low, high, 0.1, 0.0, -0.1), touching=())
    clamped = replace(clamped, prescribed=(*clamped.prescribed, *parts.clamped("high_z0")))
    both, one = solved(fem_lab, clamped).last, solved(fem_lab, alone).last
    assert both.points[: len(low.points)] == pytest.approx(low.points, abs=1e-12)
    assert both.points[len(low.points) :] == pytest.approx(one.points, abs=1e-12)
    assert both.forces["top"] == pytest.approx(one.forces["top"], abs=1e-12)


def test_forces_and_moments_balance_to_rounding(fem_lab) -> None:
    # Askew, off centre, and with unrelated meshes; the residual of Newton's method is 1e-12 N, arms are 1 mm.
    turn = np.array([[np.cos(0.3), np.sin(0.3), 0], [-np.sin(0.3), np.cos(0.3), 0], [0, 0, 1]])
    high = placed(block((2, 1, 1), (0.6, 0.5, 0.4)), 0.3, 0.2, 0.51, turn=turn)
    state = solved(fem_lab, pair(block((3, 3, 1)), high, 0.03, 0.02, -0.1)).last
    up, down = state.forces["low_z1 on high_z0"], state.forces["high_z0 on low_z1"]
    assert up[2] > 1e-3
    assert up + down == pytest.approx([0, 0, 0], abs=1e-17)
    moments = state.moments["low_z1 on high_z0"] + state.moments["high_z0 on low_z1"]
    assert moments == pytest.approx([0, 0, 0], abs=1e-16)
    assert state.forces["top"] + up == pytest.approx([0, 0, 0], abs=1e-11)
    assert state.moments["low_z0"] + state.moments["high_z0 on low_z1"] == pytest.approx([0, 0, 0], abs=1e-11)
    assert 0 < state.scalars["touching_depth"] < 0.02
    # Of the lower side by points up to 0.1 mm apart, half of the mean.
    assert state.scalars["touching_area"] == pytest.approx(0.3, rel=0.2)


def test_two_mirrored_blocks_are_one_on_a_smooth_plate_of_twice_the_stiffness(fem_lab) -> None:
    # The gap between the two is twice that to the plane of the mirror, and so is its smoothing. The surfaces in contact are not
    # quite flat: to the square of their slope, 0.01, the gap is another.
    half = block((2, 2, 1))
    other = replace(half, points=half.points * [1, 1, -1])
    ends = [Prescribed(f"{i}", f"{i}_z1", (0, 1, 2), moved(0.0, 0.0, z)) for i, z in (("a", -0.1), ("b", 0.1))]
    law = Touching("a_z0", "b_z0", 1.0, 0.02)
    body = Body(shapes.joined({"a": half, "b": other}), SOFT, tuple(ends), (0.0, 1.0), touching=(law,))
    plate = ContactBone("plate", HalfSpace((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), at_rest)
    alone = Body(half, SOFT, (replace(ends[0], on="z1"),), (0.0, 1.0))
    one = replace(alone, contact=ContactLaw("z0", 2.0, 0.01), bones=(plate,))
    two, single = solved(fem_lab, body).last, solved(fem_lab, one).last
    assert single.forces["a"][2] < -1e-3
    assert two.forces["a"] == pytest.approx(single.forces["a"], rel=1e-4, abs=1e-11)
    assert two.points[: len(half.points)] == pytest.approx(single.points, abs=3e-5)


def test_what_is_far_away_costs_and_does_nothing(fem_lab) -> None:
    far = placed(block((1, 1, 1)), 0.0, 0.0, 3.0)
    state = solved(fem_lab, pair(block((1, 1, 1)), far, 0.0, 0.0, -0.2)).last
    assert not state.forces["low_z1 on high_z0"].any()
    assert [state.scalars[f"touching_{name}"] for name in ("depth", "pressure", "area", "points")] == [0, 0, 0, 0]
    assert state.points[: len(block((1, 1, 1)).points)] == pytest.approx(block((1, 1, 1)).points, abs=1e-15)


@pytest.mark.parametrize("face", ["z1", "z0"])
def test_nothing_passes_a_thin_sheet_within_a_step(fem_lab, face) -> None:
    # In one step the block is moved to the other side of the sheet, where nothing is in contact. The back of the sheet faces the
    # same way as the block: it is not in the way of its points, but has points of its own.
    sheet, ball = block((4, 4, 1), (1.0, 1.0, 0.02)), placed(block((2, 2, 1), (0.4, 0.4, 0.2)), 0.3, 0.3, 0.5)
    body = pair(sheet, ball, 0.0, 0.0, -1.5, law=replace(LAW, one=f"low_{face}"))
    body = replace(body, prescribed=(*parts.clamped("low_x0", "low_x1"), *body.prescribed[1:]))
    outcome = solved(fem_lab, body, first_step=1.0, smallest_step=0.4).outcome
    assert outcome.status != "converged"
    assert f'a point of "low_{face}", at (0.3, 0.3, 0.0) mm in the rest state and at' in outcome.message
    assert 'went through the other side, "high_z0" beyond frame 0.00' in outcome.message


@pytest.mark.parametrize("across", [0.0, 0.3])
def test_a_pressed_block_does_not_pass_a_thin_sheet_within_a_step(across, fem_lab) -> None:
    # All points of the block start 0.005 mm deep, on facets of 0.25 mm. Moved across by more, none is behind the facet that it was
    # on; and facets reach 0.01 mm deep, half the thickness of the sheet, whose lower face is clamped.
    sheet, ball = block((4, 4, 1), (1.0, 1.0, 0.02)), placed(block((2, 2, 1), (0.4, 0.4, 0.2)), 0.1, 0.3, 0.015)
    body = pair(sheet, ball, across, 0.0, -0.5, law=replace(LAW, stiffness=1e-3))
    bottom = Prescribed("bottom", "high_z0", (0, 1, 2), moved(across, 0.0, -0.5))
    body = replace(body, prescribed=(*body.prescribed, bottom))
    outcome = solved(fem_lab, body, first_step=1.0, smallest_step=0.8).outcome
    assert outcome.status != "converged"
    assert 'a point of "low_z1", at' in outcome.message
    assert 'went through the other side, "high_z0"' in outcome.message


@pytest.mark.parametrize(("end", "status"), [(0.5, "diverged"), (1.0, "converged")])
def test_a_pressed_point_that_slides_past_the_rim_of_a_part_is_no_silent_loss(end, status, fem_lab) -> None:
    # The upper block, 0.4 mm wide, slides from x = 0.05 .. 0.45 to 0.25 .. 0.65 on a face of which the part ends at 0.5 or is all.
    low, high = block((4, 2, 1)), placed(block((2, 1, 1), (0.4, 0.4, 0.3)), 0.05, 0.3, 0.495)
    flat = low.facets["z1"]
    low = replace(low, facets=low.facets | {"near": flat[low.points[flat][..., 0].max(axis=1) <= end + 1e-9]})
    outcome = solved(fem_lab, pair(low, high, 0.2, 0.0, -0.005, law=replace(LAW, one="low_near"))).outcome
    assert outcome.status == status
    said = 'a point of "high_z0", at', 'slid past the rim of "low_near" beyond frame'
    assert all((one in outcome.message) == (status == "diverged") for one in said)


def test_points_past_a_rim_feel_the_skin_around_where_that_is_wanted(fem_lab) -> None:
    """As above, the part ends at 0.5: beyond it the points of the upper block alone press, with half the area, and the give of
    contact, p / k, is 1 % of the squeeze.
    """
    low, high = block((4, 2, 1)), placed(block((2, 1, 1), (0.4, 0.4, 0.3)), 0.05, 0.3, 0.495)
    flat = low.facets["z1"]
    low = replace(low, facets=low.facets | {"near": flat[low.points[flat][..., 0].max(axis=1) <= 0.5 + 1e-9]})
    laws = replace(LAW, one="low_near", around=True), replace(LAW, one="low_z1")
    part, whole = (solved(fem_lab, pair(low, high, 0.2, 0.0, -0.005, law=law)) for law in laws)
    assert part.outcome.status == "converged"
    up = part.last.forces["low_near on high_z0"]
    assert up == pytest.approx(whole.last.forces["low_z1 on high_z0"], rel=0.05, abs=1e-4)
    assert up + part.last.forces["high_z0 on low_near"] == pytest.approx([0, 0, 0], abs=1e-17)


def test_a_point_that_slides_off_a_sharp_edge_is_free(fem_lab) -> None:
    high = placed(block((2, 1, 1), (0.4, 0.4, 0.3)), 0.5, 0.3, 0.495)
    run = solved(fem_lab, pair(block((4, 2, 1)), high, 0.3, 0.0, -0.005))
    assert run.outcome.status == "converged"
    assert run.last.points[:, 0].max() > 1.1


def test_overlap_at_rest_is_refused(fem_lab) -> None:
    outcome = solved(fem_lab, pair(block((1, 1, 1)), placed(block((1, 1, 1)), 0.0, 0.0, 0.4), 0.0, 0.0, 0.1)).outcome
    assert outcome.status == "diverged"
    assert 'at rest: "low_z1" and "high_z0" overlap by 0.1 mm' in outcome.message


def test_an_overlap_at_rest_is_removed_beside_a_plate_that_is_only_met_then(fem_lab) -> None:
    """What is solved without the plate and then discarded leaves no pressures. The plate is 0.005 mm above the upper block and as
    stiff as contact of the two: rigid ones would share what is left, 0.095 mm, and these give way as well.
    """
    plate = ContactBone("plate", HalfSpace((0.0, 0.0, 0.905), (0.0, 0.0, -1.0)), at_rest)
    hold = Prescribed("hold", "high_z1", (0, 1, 2), moved(0.0, 0.0, 0.0), stiffness=1e-3)
    law = replace(LAW, stiffness=0.1, relaxed=(0.0, 1.0))
    body = pair(block((1, 1, 1)), placed(block((1, 1, 1)), 0.0, 0.0, 0.4), 0.0, 0.0, 0.0, law=law)
    body = replace(body, prescribed=(*parts.clamped("low_z0"), hold), contact=ContactLaw("high_z1", 0.1, 0.002))
    run = solved(fem_lab, replace(body, bones=(plate,)), residual=1e-11)
    assert run.outcome.status == "converged"
    forces = {name: force[2] for name, force in run.last.forces.items()}
    assert 0.005 < run.last.scalars["touching_depth"] < 0.0475
    assert forces["low_z1 on high_z0"] > 1e-3
    assert forces["low_z1 on high_z0"] == pytest.approx(-forces["plate"] - forces["hold"], abs=1e-10)


@pytest.mark.parametrize(("deep", "status"), [(0.0, "converged"), (0.15, "diverged")])
def test_overlap_at_rest_is_refused_where_it_is_deeper_than_facets_are_wide(deep, status, fem_lab) -> None:
    # Facets of 0.1 mm: no point meets one that is 0.15 mm above it.
    low, high = (block((4, 4, 1), (0.4, 0.4, 0.4)) for _ in range(2))
    outcome = solved(fem_lab, pair(low, placed(high, 0.0, 0.0, 0.4 - deep), 0.0, 0.0, 0.01)).outcome
    assert outcome.status == status
    assert ('at rest: "low_z1" and "high_z0" overlap by 0.15 mm' in outcome.message) == bool(deep)


def test_what_is_not_supported_is_refused() -> None:
    body = pair(block((1, 1, 1)), placed(block((1, 1, 1)), 0.0, 0.0, 0.5), 0.0, 0.0, -0.1)
    with pytest.raises(InputError, match="touching: got parts that touch, want a body without"):
        scikit_fem.solve_body(body, scikit_fem.ScikitBodySettings(element="Q1/P0"))
    with pytest.raises(InputError, match='linear_solver: got "multigrid"'):
        fenicsx.solve_body(body, fenicsx.BodySettings(element="Q2/Q1", linear_solver="multigrid"))
    with fenicsx.session(ranks=2) as two, pytest.raises(InputError, match="ranks: got 2, want 1"):
        two.solve(body, fenicsx.BodySettings(element="Q1/P0"))


def test_contact_along_own_normals_has_two_parts_no_friction_and_no_stability() -> None:
    one = Touching("low_z1", "high_z0", 1.0, 0.02, own_normals=True)
    body = replace(pair(block((1, 1, 1)), placed(block((1, 1, 1)), 0, 0, 0.6), 0.0, 0.0, -0.1), touching=(one,))
    with pytest.raises(InputError, match='follow: got "stable" with contact along own normals, want "equilibrium"'):
        fenicsx.solve_body(body, STABLE)
    for wrong in (replace(one, friction=0.3), Touching("low_z1", "low_z1", 1.0, 0.02, own_normals=True)):
        with pytest.raises(
            InputError, match=r"touching\[0\]\.own_normals: got True .*, want two parts without friction"
        ):
            fenicsx.solve_body(replace(body, touching=(wrong,)), fenicsx.BodySettings(element="Q1/P0"))


def steep(edges: np.ndarray, faces: str) -> Cells:
    """A block with these ``edges`` (3, 3), the part "tip" of three faces or two that meet in front, and "top" of those behind."""
    found = block((2, 2, 2), (0.4, 0.4, 0.4))
    names = {
        name: np.concatenate([found.facets[f"{face}{end}"] for face in faces]) for name, end in (("tip", 0), ("top", 1))
    }
    return replace(placed(found, 0.5, 0.5, 0.501, turn=edges), facets=found.facets | names)


@pytest.mark.parametrize("own_normals", [False, True])
@pytest.mark.parametrize("tip", ["wedge", "corner"])
def test_a_steep_tip_without_pressure_does_not_converge(tip, own_normals, fem_lab) -> None:
    """A wedge of a half angle of 22 degrees, and a cube on its corner, stretched to a cosine of 0.33 between its faces and the
    block below: along own normals, pressure ends at a cosine of 0.3. Pressed in by 0.04 mm, the tip would be all of that deep.
    """
    angle, (a, b, c) = np.radians(22), 1 / np.sqrt([2, 6, 3])
    across, up = np.sin(angle), np.cos(angle)
    wedge = np.array([[across, 0, up], [0, 1, 0], [-across, 0, up]])
    corner = np.array([[a, b, 2 * c], [-a, b, 2 * c], [0, -2 * b, 2 * c]])
    high = steep(wedge, "xz") if tip == "wedge" else steep(corner, "xyz")
    law = Touching("low_z1", "high_tip", 1.0, 0.005, own_normals=own_normals)
    body = pair(block((4, 4, 2)), high, 0.0, 0.0, -0.04, law=law)
    body = replace(
        body,
        effects=parts.neo_hooke(0.1, 1.0),
        prescribed=(*parts.clamped("low_z0"), replace(body.prescribed[-1], on="high_top")),
    )
    outcome = solved(fem_lab, body).outcome
    assert outcome.status == ("diverged" if own_normals else "converged")
    said = "at (0.5, 0.5, 0.5) mm in the rest state", "went through the other side"
    assert all((one in outcome.message) == own_normals for one in said)
