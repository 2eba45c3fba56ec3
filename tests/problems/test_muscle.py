"""Muscles of cases, filled with tetrahedra: their mesh, attachments, springs and contact."""

import importlib.util
from dataclasses import replace

import numpy as np
import pytest
import shapes
import small

import fem_reference as fr
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines, boundary, enclosed_volume
from fem_reference.foundations.motion import apply
from fem_reference.geometry.skins import Skin
from fem_reference.geometry.tetrahedra import tetrahedralise
from fem_reference.io import files
from fem_reference.metrics import MeasurementContext, penetration
from fem_reference.problems import muscle, of_case
from fem_reference.problems.setup import Setup
from fem_reference.runs.store import Frame, Outcome, Run
from fem_reference.scenes import casefile
from fem_reference.solvers import fenicsx

COARSE, FINE = (2, 2, 3), (4, 4, 12)  # edges of 13 and of 3 mm
LAST = 22


def scene(folder, cells, within: str = "1.5 mm", effects: str = "listed"):
    """A bar of 10 x 10 x 40 mm between two plates; the ball of 3 mm begins 1 mm beside it and ends 5 mm behind."""
    bar = shapes.skin(shapes.box(cells, (10.0, 10.0, 40.0)))
    files.write_surface(folder / "bar.vtp", bar, bar.points)
    plates = {"floor": -5.0, "lid": 45.0}
    bones = [
        {"name": name, "box": {"centre": f"5, 5, {z} mm", "size": "30, 30, 9 mm", "rounding": "1 mm"}}
        for name, z in plates.items()
    ]
    motion = {
        "direction": [1, 0, 0],
        "keyframes": [{"frame": 0, "distance": 0.0}, {"frame": LAST, "distance": float(LAST)}],
    }
    bones.append({"name": "ball", "sphere": {"centre": "-4, 5, 20 mm", "radius": "3 mm"}, "motion": motion})
    table = {
        "title": "A ball across a bar",
        "proves": "that contact is felt between the vertices of a surface",
        "effects": effects,
        "muscle": {"surface": "bar.vtp", "unit": "mm", "tet_size": "5 mm", "mesher": "block"},
        "bone": bones,
        "attachment": [{"name": f"to {name}", "bone": name, "within": within} for name in plates],
        "effect": [
            {"name": "neo_hooke", "mu": "10 kPa"},
            {"name": "incompressible", "bulk": "10 MPa"},
            {"name": "contact", "stiffness": "500 kPa/mm", "smoothing": "0.3 mm"},
        ],
        "fibres": {"traced": {"count": 4, "start": "to floor", "end": "to lid"}},
        "frames": {"first": 0, "last": LAST, "every": LAST // 2},
        "reference": {"solver": "fenicsx"},
    }
    return fr.make_case(table, folder)


def deepest(rest: Setup, numbers, positions) -> np.ndarray:
    run = Run("run", "test", Outcome("converged", ""), tuple(numbers), rest.surface, np.array(positions), None, None)
    lines = Polylines(rest.surface.points[:2], np.array([0, 2]))
    context = MeasurementContext.of(run, lines, rest.bones, rest.exempt)
    return penetration.measure(run, run, context)[0].values


@pytest.mark.slow
def test_a_ball_that_passes_through_is_deep_in_the_bar(tmp_path) -> None:
    rest = muscle.setup(scene(tmp_path, COARSE))
    # Its middle is 4 mm before the side, in the bar, and 8 mm behind: points drawn in it come within 0.4 mm of that.
    found = deepest(rest, (0, 11, 22), [rest.surface.points] * 3)
    assert found[[0, 2]].tolist() == [0, 0]
    assert 2.6 < found[1] <= 3


@pytest.mark.slow
@pytest.mark.parametrize("cells", [(1, 1, 1), COARSE, FINE])
def test_it_is_known_before_that_the_ball_reaches_the_bar(tmp_path, cells) -> None:
    for effects in ("listed", "auto"):
        case = scene(tmp_path, cells, effects=effects)
        said = next(str(one) for one in of_case.explained(case) if one.effect.title == "Contact")
        assert "(ball, nearest at frame" in said
        assert "no bone is reached" not in said
        assert "left out" not in said
        assert [type(effect).__name__ for effect in of_case.chosen(case).effects][-1] == "Contact"


def test_a_bar_that_is_attached_all_round_is_refused_before_it_is_meshed(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(muscle, "filled", lambda *_: pytest.fail("it was meshed"))
    case = scene(tmp_path, COARSE, within="14 mm")  # the vertices 13.3 mm away too: none is left
    with pytest.raises(InputError, match=r"case.attachment: got 100 % .* without contact .*, want at most 50 %"):
        muscle.build(case, muscle.setup(case))


def plate(folder, thick: float, smoothing: str = "0.3 mm"):
    """The bar and a plate beside it, which goes face on to its other side within the one interval between two frames."""
    case = scene(folder, COARSE)
    size = f"20, {thick}, 20 mm"
    ball = {"centre": "5, -3, 20 mm", "size": size, "rounding": "0.05 mm"}
    bones = [*case.bone[:2], case.bone[2].model_copy(update={"sphere": None, "box": type(case.bone[0].box)(**ball)})]
    motion = case.bone[2].motion.model_copy(update={"direction": (0.0, 1.0, 0.0)})
    bones[2] = bones[2].model_copy(update={"motion": motion})
    effects = [*case.effects[:2], case.effects[2].model_copy(update={"smoothing": float(smoothing.split()[0])})]
    frames = case.frames.model_copy(update={"every": LAST})
    return case.model_copy(update={"bone": tuple(bones), "effect": tuple(effects), "frames": frames})


def test_a_bone_that_would_pass_between_contact_points_is_refused(tmp_path) -> None:
    # Points of the bar are 0.53 mm apart, an eightieth of its diagonal: 1.5 times that is 0.8 mm.
    case = plate(tmp_path, 0.4)
    with pytest.raises(InputError, match=r"bone\[2\]: got a bone 0.4 mm thick, want 0.8 mm or more"):
        muscle.build(case, muscle.setup(case))


@pytest.mark.slow
def test_a_plate_thinner_than_twice_the_smoothing_does_not_pass_in_one_step(tmp_path) -> None:
    if not any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx")):
        pytest.skip("FEniCSx is not installed")
    case, frames = plate(tmp_path, 0.9, "0.6 mm"), []
    settings = fenicsx.Settings(ranks=1, first_step=float(LAST), smallest_step=LAST / 4)
    outcome = fenicsx.solve(muscle.build(case, muscle.setup(case)), settings, frames.append)
    # It cannot be solved in steps of that size: what matters is that no step takes it through.
    assert outcome.status != "converged"
    assert "went through" in outcome.message


@pytest.fixture(scope="module")
def pressed(tmp_path_factory):
    """By the surface, its setup and its frames."""
    if not any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx")):
        pytest.skip("FEniCSx is not installed")
    found = {}
    for cells in (COARSE, FINE):
        case = scene(tmp_path_factory.mktemp("bar"), cells)
        rest, frames = muscle.setup(case), []
        outcome = fenicsx.solve(muscle.build(case, rest), fenicsx.Settings(ranks=1), frames.append)
        assert outcome.status == "converged"
        found[cells] = rest, frames
    return found


@pytest.mark.slow
def test_the_ball_presses_a_coarse_bar_aside_as_a_fine_one(pressed) -> None:
    # The same tetrahedra under both: what differs are the points at which contact is felt, half a millimetre apart in both.
    coarse, fine = (pressed[cells][1] for cells in (COARSE, FINE))
    for one, other in zip(coarse[1:], fine[1:], strict=True):
        assert one.scalars["force_ball"] > 0.1
        assert one.scalars["force_ball"] == pytest.approx(other.scalars["force_ball"], rel=0.01)
        assert one.scalars["contact_area"] == pytest.approx(other.scalars["contact_area"], rel=0.03)
        assert 0 <= one.scalars["contact_depth"] <= one.scalars["contact_pressure"] / 0.5 + 1e-9  # gives way by p / k
    # At the end the ball's middle is 13 mm beyond where the bar's axis was: nearest vertices of both go with the bar.
    shared = np.linalg.norm(pressed[COARSE][0].surface.points[:, None] - pressed[FINE][0].surface.points, axis=2)
    one, other = np.nonzero(shared < 1e-6)
    assert len(one) > 20
    moves = [frames[-1].surface - rest.surface.points for rest, frames in pressed.values()]
    assert np.abs(moves[0][one] - moves[1][other]).max() < 0.1
    assert np.linalg.norm(moves[0], axis=1).max() > 10


@pytest.mark.slow
def test_that_a_coarse_surface_does_not_show_the_dent_is_said(pressed) -> None:
    # The bar has been pressed aside with a give of half a millimetre; what 34 vertices say of it passes through the ball, and what
    # is not shown is not called zero. Triangles of 3 mm show most of it.
    depths = {
        cells: deepest(rest, [frame.number for frame in frames], [frame.surface for frame in frames])
        for cells, (rest, frames) in pressed.items()
    }
    assert depths[COARSE][0] == depths[FINE][0] == 0
    assert depths[COARSE][-1] > 2
    assert pressed[FINE][1][-1].scalars["contact_depth"] < depths[FINE][-1] < 1.5


def build(case):
    return build_scene(casefile.read(case))


def build_scene(scene):
    return muscle.build(scene, muscle.setup(scene))


@pytest.fixture(scope="module")
def built(bar):
    return build(bar)


@pytest.mark.slow
def test_attachments_keep_their_names(built) -> None:
    assert set(built.mesh.facets) == {"origin", "insertion"}
    assert {attached.attachment: attached.bone.name for attached in built.attached} == {
        "origin": "floor",
        "insertion": "lid",
    }


@pytest.mark.slow
@pytest.mark.parametrize("size", [3.5, 4.5, 6.0])
def test_attachments_keep_their_area_at_every_size(bar, size) -> None:
    scene = casefile.read(bar)
    built = build_scene(scene.model_copy(update={"muscle": scene.muscle.model_copy(update={"tet_size": size})}))
    for name in ("origin", "insertion"):
        facts = {key.removeprefix(name): value for key, value in built.mesh_facts.items() if key.startswith(name)}
        # Each end is a square of 10 mm with sharp edges, on which the strip around it is not attached.
        assert facts["_area_mm2"] == pytest.approx(100)
        # Each of four shifts of its rim leaves about a tenth of what is missing.
        assert facts["_area_on_tets_mm2"] == pytest.approx(100, rel=0.003)
        assert facts["_vertices_beside_facets"] == 0


@pytest.mark.slow
def test_where_the_mesher_keeps_no_rim_facets_are_those_under_the_attachment(bar, monkeypatch) -> None:
    def without_rims(*arguments):
        return replace(tetrahedralise(*arguments), facets={})

    monkeypatch.setattr(muscle, "tetrahedralise", without_rims)
    sampled = build(bar)
    for name in ("origin", "insertion"):
        # A facet beside a sharp edge of 10 mm may be taken for one under it: 6 x 6 / 2 mm2 at most.
        assert sampled.mesh_facts[f"{name}_area_on_tets_mm2"] == pytest.approx(100, rel=0.18)


@pytest.mark.slow
def test_mesh_facts_say_who_made_it_and_how_good_it_is(built) -> None:
    facts = built.mesh_facts
    assert facts["maker"] == "gmsh"
    assert facts["self_intersections_of_surface"] == 0
    assert facts["tets"] == len(built.mesh.tets)
    assert 0 < facts["quality_min"] <= facts["quality_5_percent"] <= 1
    assert facts["fibre_ends"] == 2 * len(built.fibres.lengths())
    assert facts["fibre_ends_beside"] == 0
    body = small.body()  # coarsening keeps the enclosed volume
    assert facts["volume_mm3"] == pytest.approx(enclosed_volume(body.points, body.triangles), rel=1e-3)


@pytest.mark.slow
def test_fibres_and_contact_do_not_depend_on_the_tetrahedra(bar) -> None:
    text = (bar / "case.toml").read_text()
    (bar / "case.toml").write_text(text.replace("[fibres]", f"{FIBRE}{CONTACT}\n[fibres]"))
    scene = casefile.read(bar)
    (bar / "case.toml").write_text(text)
    soft = scene.attachment[1].model_copy(update={"stiffness": 0.1})
    scene = scene.model_copy(update={"attachment": (scene.attachment[0], soft)})
    one, other = (
        build_scene(scene.model_copy(update={"muscle": scene.muscle.model_copy(update={"tet_size": size})}))
        for size in (4.5, 6.0)
    )
    assert len(one.mesh.tets) != len(other.mesh.tets)
    assert np.array_equal(one.fibres.points, other.fibres.points)
    points = one.fibres.points[::7]
    cells = np.zeros(len(points), int)
    assert np.array_equal(one.fibre(cells, points), other.fibre(cells, points))
    assert len(one.skin.points) > 0
    for mine, theirs in ((one.skin, other.skin), (one.attached_skins["insertion"], other.attached_skins["insertion"])):
        assert np.array_equal(mine.points, theirs.points)
        assert np.array_equal(mine.areas, theirs.areas)


@pytest.mark.slow
def test_a_shifted_attachment_moves_the_clamped_area_and_not_the_fibres(bar) -> None:
    """An outline of 6 mm on the end of 10 mm of the bar, 2 mm further: runs of both are measured on the same lines."""
    marks = "\n".join(f"top,{i},{x},{y},40.5" for i, (x, y) in enumerate([(2, 2), (8, 2), (8, 8), (2, 8)]))
    (bar / "marks.csv").write_text(f"cloud,landmark,x,y,z\n{marks}\n")
    outline = {"file": "marks.csv", "unit": "mm", "clouds": ["top"], "reach": "1 mm"}
    outline["shift"] = {"along": [1, 0, 0], "by": "0 mm"}
    end = {"name": "insertion", "bone": "lid", "outline": outline}
    own = casefile.read_muscle(bar, {"attachment[1]": end, "frames.every": 10})
    there, moved = (
        build_scene(casefile.with_numbers(own, {"attachment[1].outline.shift.by": far})) for far in (0.0, 2.0)
    )
    assert np.array_equal(there.fibres.points, moved.fibres.points)
    middles = [one.surface.points[one.attached[1].vertices].mean(axis=0) for one in (there, moved)]
    assert middles[1] - middles[0] == pytest.approx([2.5, 0, 0], abs=1e-9), "2.5, 5 and 7.5 mm, then 5, 7.5 and 10 mm"


@pytest.mark.slow
def test_a_vertex_has_one_bone(bar) -> None:
    scene = casefile.read(bar, changes={"attachment[1].bone": "floor"})
    with pytest.raises(InputError, match=r"attachment\[1\]: got vertex \d+, which belongs to another attachment"):
        muscle.setup(scene)


@pytest.mark.slow
def test_an_attachment_that_tets_cannot_resolve_is_named(bar, monkeypatch) -> None:
    def without_insertion(*arguments):
        mesh = tetrahedralise(*arguments)
        return replace(mesh, facets=mesh.facets | {"insertion": np.zeros((0, 3), np.int64)})

    monkeypatch.setattr(muscle, "tetrahedralise", without_insertion)
    with pytest.raises(InputError, match=r"attachment\[1\]: got an area smaller than the tetrahedra resolve"):
        build(bar)


CONTACT = """
[[effect]]
name = "contact"
stiffness = "100 kPa/mm"
"""
FIBRE = """
[[effect]]
name = "active_tension"
tension = "60 kPa"
ramp = [{ frame = 0, amount = 0.0 }, { frame = 20, amount = 1.0 }]
"""


@pytest.mark.slow
def test_directions_only_where_an_effect_needs_them(bar, built) -> None:
    assert built.directions is None
    assert built.body.fibre is None
    text = (bar / "case.toml").read_text()
    (bar / "case.toml").write_text(text.replace("[fibres]", f"{FIBRE}\n[fibres]"))
    along = build(bar).directions
    (bar / "case.toml").write_text(text)
    # From one end of the bar to the other; at its ends the field bends by what the cells resolve.
    assert along.shape == (len(built.mesh.tets), 3)
    assert np.linalg.norm(along, axis=1) == pytest.approx(1, abs=1e-12)
    assert along[:, 2].mean() > 0.95


@pytest.mark.slow
def test_as_a_body_its_bones_prescribe_their_facets_and_the_rest_is_free(built) -> None:
    body = built.body
    skin, _ = boundary(built.mesh.tets)
    parts = [tuple(sorted(facet)) for facets in body.mesh.facets.values() for facet in facets.tolist()]
    assert sorted(parts) == sorted(tuple(sorted(facet)) for facet in skin.tolist())
    assert set(body.mesh.facets) == {"origin", "insertion", "free"}
    points = built.mesh.points[:5]
    for entry, attached in zip(body.prescribed, built.attached, strict=True):
        assert (entry.name, entry.on, entry.components, entry.stiffness) == (
            attached.attachment,
            attached.attachment,
            (0, 1, 2),
            None,
        )
        assert entry.path(points, 7.0) == pytest.approx(apply(attached.bone.pose(7.0), points) - points)


@pytest.mark.slow
def test_a_stiffness_of_an_attachment_reaches_the_body(bar) -> None:
    scene = casefile.read(bar)
    soft = scene.attachment[1].model_copy(update={"stiffness": 0.1})
    scene = scene.model_copy(update={"attachment": (scene.attachment[0], soft)})
    body = muscle.build(scene, muscle.setup(scene)).body
    assert [entry.stiffness for entry in body.prescribed] == [None, 0.1]
    assert (body.prescribed[0].on, type(body.prescribed[1].on)) == ("origin", Skin)
    # A load may still act on what springs attach, and what is free is free of both.
    assert set(body.mesh.facets) == {"origin", "insertion", "free"}


@pytest.mark.slow
def test_a_body_may_be_attached_by_nothing(squeezed) -> None:
    built = build_scene(squeezed)
    assert built.attached == ()
    assert built.mesh.facets == {}
    body = built.body
    assert body.prescribed == ()
    assert list(body.mesh.facets) == ["free"]
    assert len(body.mesh.facets["free"]) == len(boundary(built.mesh.tets)[0])


@pytest.mark.slow
def test_a_block_is_meshed_as_one_and_its_fibres_stay_where_they_are(squeezed) -> None:
    built = build_scene(squeezed)
    assert built.mesh_facts["maker"] == "block"
    assert len(built.mesh.tets) == 6 * 5 * 4 * 5
    assert built.mesh_facts["volume_mm3"] == pytest.approx(100 * 80 * 100)
    given = files.read_polylines(squeezed.file("mesh:box/fibres.vtk", "fibres"), 1.0)
    assert np.array_equal(built.fibres.points, given.points)


@pytest.mark.slow
def test_what_is_no_block_is_refused_at_the_key_of_the_surface(bar) -> None:
    scene = casefile.read(bar)
    scene = scene.model_copy(update={"muscle": scene.muscle.model_copy(update={"mesher": "block"})})
    with pytest.raises(InputError, match=r"case.toml: muscle.surface: .*bar.vtp: got \d+ triangles outside the faces"):
        build_scene(scene)


@pytest.mark.slow
def test_a_frame_of_a_body_attached_by_nothing_states_nothing_of_attachments(squeezed) -> None:
    built = build_scene(squeezed)
    frame = Frame(0, np.array(built.surface.points), scalars={"energy": 1.0})
    assert fenicsx._attachment_errors(built, frame) == {}
