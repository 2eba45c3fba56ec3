"""Case -> problem: what is attached, what the mesh is like, and what does not depend on it."""

from dataclasses import replace

import numpy as np
import pytest
import small

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import boundary, enclosed_volume
from fem_reference.foundations.motion import apply
from fem_reference.geometry.skins import Skin
from fem_reference.geometry.tetrahedra import tetrahedralise
from fem_reference.io import files
from fem_reference.problems import muscle
from fem_reference.runs.store import Frame
from fem_reference.scenes import casefile
from fem_reference.solvers import fenicsx

pytestmark = pytest.mark.slow


def build(case):
    return build_scene(casefile.read(case))


def build_scene(scene):
    return muscle.build(scene, muscle.setup(scene))


@pytest.fixture(scope="module")
def built(bar):
    return build(bar)


def test_attachments_keep_their_names(built) -> None:
    assert set(built.mesh.facets) == {"origin", "insertion"}
    assert {attached.attachment: attached.bone.name for attached in built.attached} == {
        "origin": "floor",
        "insertion": "lid",
    }


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


def test_where_the_mesher_keeps_no_rim_facets_are_those_under_the_attachment(bar, monkeypatch) -> None:
    def without_rims(*arguments):
        return replace(tetrahedralise(*arguments), facets={})

    monkeypatch.setattr(muscle, "tetrahedralise", without_rims)
    sampled = build(bar)
    for name in ("origin", "insertion"):
        # A facet beside a sharp edge of 10 mm may be taken for one under it: 6 x 6 / 2 mm2 at most.
        assert sampled.mesh_facts[f"{name}_area_on_tets_mm2"] == pytest.approx(100, rel=0.18)


def test_mesh_facts_say_who_made_it_and_how_good_it_is(built) -> None:
    facts = built.mesh_facts
    assert facts["maker"] == "gmsh"
    assert facts["self_intersections_of_surface"] == 0
    assert facts["tets"] == len(built.mesh.tets)
    assert 0 < facts["quality_min"] <= facts["quality_5_percent"] <= 1
    body = small.body()  # coarsening keeps the enclosed volume
    assert facts["volume_mm3"] == pytest.approx(enclosed_volume(body.points, body.triangles), rel=1e-3)


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


def test_a_vertex_has_one_bone(bar) -> None:
    scene = casefile.read(bar, changes={"attachment[1].bone": "floor"})
    with pytest.raises(InputError, match=r"attachment\[1\]: got vertex \d+, which another attachment has"):
        muscle.setup(scene)


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


def test_a_stiffness_of_an_attachment_reaches_the_body(bar) -> None:
    scene = casefile.read(bar)
    soft = scene.attachment[1].model_copy(update={"stiffness": 0.1})
    scene = scene.model_copy(update={"attachment": (scene.attachment[0], soft)})
    body = muscle.build(scene, muscle.setup(scene)).body
    assert [entry.stiffness for entry in body.prescribed] == [None, 0.1]
    assert (body.prescribed[0].on, type(body.prescribed[1].on)) == ("origin", Skin)
    # A load may still act on what springs attach, and what is free is free of both.
    assert set(body.mesh.facets) == {"origin", "insertion", "free"}


def test_a_body_may_be_attached_by_nothing(squeezed) -> None:
    built = build_scene(squeezed)
    assert built.attached == ()
    assert built.mesh.facets == {}
    body = built.body
    assert body.prescribed == ()
    assert list(body.mesh.facets) == ["free"]
    assert len(body.mesh.facets["free"]) == len(boundary(built.mesh.tets)[0])


def test_a_block_is_meshed_as_one_and_its_fibres_stay_where_they_are(squeezed) -> None:
    built = build_scene(squeezed)
    assert built.mesh_facts["maker"] == "block"
    assert len(built.mesh.tets) == 6 * 5 * 4 * 5
    assert built.mesh_facts["volume_mm3"] == pytest.approx(100 * 80 * 100)
    given = files.read_polylines(squeezed.file("mesh:box/fibres.vtk", "fibres"), 1.0)
    assert np.array_equal(built.fibres.points, given.points)


def test_what_is_no_block_is_refused_at_the_key_of_the_surface(bar) -> None:
    scene = casefile.read(bar)
    scene = scene.model_copy(update={"muscle": scene.muscle.model_copy(update={"mesher": "block"})})
    with pytest.raises(InputError, match=r"case.toml: muscle.surface: .*bar.vtp: got \d+ triangles in no face"):
        build_scene(scene)


def test_a_frame_of_a_body_attached_by_nothing_states_nothing_of_attachments(squeezed) -> None:
    built = build_scene(squeezed)
    frame = Frame(0, np.array(built.surface.points), scalars={"energy": 1.0})
    assert fenicsx._with_attachment_errors(built, frame).scalars == {"energy": 1.0}
