"""Contact in FEBio's file: its tangent, and no more pressure from overlaps at rest than the matrix bears; another model is said
with numbers, in the file, beside it and on the terminal.
"""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import feb_file
import numpy as np
import pytest
import shapes
import small
from feb_file import cells, nodes

import fem_reference as fr
from fem_reference import cli
from fem_reference.export import febio, febio_contact
from fem_reference.export.febio_contact import overlaps
from fem_reference.export.febio_mesh import SHRUNK, spring_points
from fem_reference.foundations.mesh import Surface, corner_areas
from fem_reference.geometry.skins import attached_skin
from fem_reference.problems.muscle import MuscleProblem

STIFFNESS = 0.1  # MPa/mm
HIGH = 30.25  # mm


def test_contact_has_its_whole_tangent(bar: MuscleProblem, feb: Element) -> None:
    """That of sliding is not symmetric; without contact FEBio's solver is left as it is."""
    assert feb.find("Contact/contact/symmetric_stiffness").text == "0"
    assert feb.find("Control/solver/symmetric_stiffness").text == "non-symmetric"
    plain = febio.model(replace(bar, effects=bar.effects[:3]))
    assert plain.find("Control/solver/symmetric_stiffness") is None


def overlapping(deep: float, name: str = "top") -> MuscleProblem:
    """The bar, and a bone of this name that is ``deep`` [mm] in one of its sides between its ends."""
    bar = feb_file.bar()
    plate = shapes.skin(shapes.box((1, 1, 1), (10, 30, 6)))
    plate = plate.moved_to(plate.points + [deep - 10, -10, 12])
    far = plate.moved_to(plate.points - [100, 0, 0])
    bones = tuple(replace(bone, surface=plate if bone.name == name else far) for bone in bar.bones)
    return replace(bar, bones=bones)


def radius(problem: MuscleProblem) -> float:
    (contact,) = febio.model(problem).iterfind("Contact/contact[@type='sliding-elastic']")
    return float(contact.find("search_radius").text)


@pytest.mark.parametrize(("deep", "wanted"), [(0.0, 5.0), (0.15, 5.0), (0.19, 5.0), (0.21, 0.2), (0.5, 0.2)])
def test_an_overlap_at_rest_presses_with_no_more_than_the_matrix_bears(deep: float, wanted: float) -> None:
    """Ten shear moduli of 10 kPa press 0.2 mm deep where the stiffness is 500 kPa/mm."""
    problem = overlapping(deep)
    assert overlaps(problem) == {"top": pytest.approx(deep, abs=1e-12)}
    assert radius(problem) == pytest.approx(wanted, rel=1e-12)
    said = febio_contact.notes(problem)
    assert len(said) == (deep > 0)
    assert all(f"{deep:.2g} mm inside" in text and f"search_radius of {wanted:.2g} mm" in text for text in said)


@pytest.mark.parametrize("friction", [None, 0.3])
def test_friction_is_exported(friction: float | None) -> None:
    problem = overlapping(0.1)
    acting = tuple(
        one.model_copy(update={"friction": friction}) if one is problem.contact else one for one in problem.effects
    )
    contacts = list(febio.model(replace(problem, effects=acting)).iterfind("Contact/contact[@type='sliding-elastic']"))
    assert contacts
    assert {float(one.find("fric_coeff").text) for one in contacts} == {friction or 0.0}


def test_a_bone_that_is_no_obstacle_may_overlap() -> None:
    """The contact of the bar is by the bone "top" alone."""
    problem = overlapping(0.5, "rests & <waits>")
    assert overlaps(problem) == {"top": 0.0}
    assert radius(problem) == 5.0


@pytest.fixture(scope="module")
def springs() -> MuscleProblem:
    """A bar whose top of 10 x 10 mm, all of it facets of the tets, is attached on 10 x 8 mm of the muscle's own surface, which is
    0.25 mm above; the bones are far from its sides.
    """
    bar = feb_file.bar()
    far = bar.bones[0].surface.moved_to(bar.bones[0].surface.points - [100, 0, 0])
    bar = replace(bar, bones=tuple(replace(bone, surface=far) for bone in bar.bones))
    area = Surface(
        np.array([[0.0, 0, HIGH], [10, 0, HIGH], [10, 8, HIGH], [0, 8, HIGH]]), np.array([[0, 1, 2], [0, 2, 3]])
    )
    top = replace(bar.attached[1], stiffness=STIFFNESS)
    skin = attached_skin(area, np.array([[1.0, 1, 1], [1, 1, 0]]), bar.mesh, 3.0)
    return replace(bar, attached=(bar.attached[0], top), attached_skins={"top": skin})


def test_springs_at_points_are_small_triangles_of_their_stiffness(springs: MuscleProblem) -> None:
    """One for each point that has an area, in the facet below it, with the penalty greater by what the triangle is smaller."""
    skin, found = springs.attached_skins["top"], spring_points(springs, springs.attached[1])
    assert skin.areas[found.of].sum() == pytest.approx(skin.areas.sum(), rel=1e-12)
    assert np.linalg.norm((found.points - skin.points[found.of])[:, :2], axis=1).max() < 0.15  # facets are of 5 mm
    assert found.points[:, 2] == pytest.approx(30.0, abs=1e-12)
    assert corner_areas(found.corners) == pytest.approx(SHRUNK * skin.areas[found.of], rel=1e-9)
    assert found.corners.mean(axis=1) == pytest.approx(found.points, abs=1e-12)
    assert np.abs(found.corners - found.points[:, None]).max() < 0.3
    assert (np.cross(*np.swapaxes(found.corners[:, 1:] - found.corners[:, :1], 0, 1))[:, 2] < 0).all()  # they face it
    corners = springs.mesh.points[found.facets]
    for one in np.swapaxes(found.corners, 0, 1):  # a ray from any point of them meets the facet
        edges = np.roll(corners, -1, axis=1) - corners
        assert (np.cross(edges, one[:, None] - corners)[:, :, 2] > 0).all()
    feb = febio.model(springs)
    (tied,) = feb.iterfind("Contact/contact[@type='tied-elastic']")
    assert float(tied.find("penalty").text) == pytest.approx(STIFFNESS / SHRUNK, rel=1e-12)
    bone, muscle = (cells(feb, f"springs_top_{side}", "Surface") for side in ("bone", "muscle"))
    assert nodes(feb)[bone] == pytest.approx(found.corners, abs=1e-12)
    assert np.array_equal(bone, cells(feb, "springs_top"))
    assert {tuple(sorted(facet)) for facet in muscle[:, :3] - 1} == {tuple(sorted(facet)) for facet in found.facets}
    assert feb.find("Mesh/Elements[@name='springs_top']").attrib["type"] == "tri3"


def test_springs_at_points_pull_as_those_of_the_reference(springs: MuscleProblem) -> None:
    """A quadratic displacement u of the top; FEBio's rule for triangles of three nodes has points at 1/6, 1/6 and 2/3 of them."""
    skin, found = springs.attached_skins["top"], spring_points(springs, springs.attached[1])
    at = np.einsum("qc,nci->nqi", np.full((3, 3), 1 / 6) + np.eye(3) / 2, found.corners)
    each = STIFFNESS / SHRUNK * corner_areas(found.corners)[:, None, None] / 3

    def displacement(points: np.ndarray) -> np.ndarray:
        x, y, _ = np.moveaxis(points, -1, 0)
        return np.stack([x**2 / 50, x * y / 80, 0 * x + 3], axis=-1)

    pulls, own = each * displacement(at), STIFFNESS * skin.areas[:, None] * displacement(skin.points)
    assert pulls.sum(axis=(0, 1)) == pytest.approx(own.sum(axis=0), rel=2e-3)
    moments = np.cross(at, pulls).sum(axis=(0, 1)), np.cross(skin.points * [1, 1, 0] + [0, 0, 30], own).sum(axis=0)
    assert moments[0] == pytest.approx(moments[1], rel=2e-3)


def test_small_triangles_stay_in_small_facets(springs: MuscleProblem) -> None:
    """Points at corners and edges, of 80 mm2 each: triangles of a quarter of the size of a facet of 12.5 mm2."""
    skin = springs.attached_skins["top"]
    ticks = np.stack(np.meshgrid([0.0, 5, 10], [0.0, 2.5, 10]), axis=-1).reshape(-1, 2)
    points = np.column_stack([ticks, np.full(9, 30.0)])
    rims = replace(skin, cells=skin.cells[:9], points=points, areas=np.full(9, 80.0))
    found = spring_points(replace(springs, attached_skins={"top": rims}), springs.attached[1])
    corners = springs.mesh.points[found.facets]
    edges = np.roll(corners, -1, axis=1) - corners
    outward = np.cross(edges[:, 0], edges[:, 1])
    for one in np.swapaxes(found.corners, 0, 1):
        assert (np.einsum("nci,ni->nc", np.cross(edges, one[:, None] - corners), outward) > 0).all()


def test_a_point_without_area_has_no_spring(springs: MuscleProblem) -> None:
    skin = springs.attached_skins["top"]
    few = replace(skin, areas=np.where(np.arange(len(skin.areas)) < 5, skin.areas, 0.0))
    assert spring_points(replace(springs, attached_skins={"top": few}), springs.attached[1]).of.tolist() == [
        0,
        1,
        2,
        3,
        4,
    ]


def test_springs_beside_those_of_the_reference_are_said_with_how_stiff_they_are(springs: MuscleProblem) -> None:
    """0.1 MPa/mm over 40 mm2, and 40 more of which two thirds are attached: half a triangle with one corner at nothing."""
    first, measured = febio_contact.notes(springs)
    assert 'attachment "top": springs act at the nearest points of the tetrahedra, 0.25 mm (mean) to 0.2' in first
    assert "Their stiffness is 6.667 instead of 6.667 N/mm, their centre is 0.25 mm away" in first
    low, high = map(float, first.partition("and they are ")[2].split(" times")[0].split(" to "))
    assert 0.98 < low <= high < 1.02
    assert "Springs at points have not been run" in measured
    assert "5.3 and 8.8 % of the force" in measured


def test_nothing_is_said_where_nothing_differs(springs: MuscleProblem) -> None:
    """Exact attachments; springs that the reference has over facets too."""
    exact = replace(springs, attached=tuple(replace(one, stiffness=None) for one in springs.attached))
    assert febio_contact.notes(exact) == []
    assert febio_contact.notes(replace(springs, attached_skins={})) == []
    assert len(list(comments(exact))) == 1  # units


def comments(problem: MuscleProblem) -> list[str]:
    """Those of the file, as a reader of it sees them."""
    kept = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))
    root = ElementTree.fromstring(ElementTree.tostring(febio.model(problem)), kept)
    return [str(entry.text) for entry in root if entry.tag is ElementTree.Comment]


def test_the_file_says_it_whatever_the_name(springs: MuscleProblem) -> None:
    """Two hyphens would end a comment of XML."""
    top = replace(springs.attached[1], attachment="a--b -->")
    mesh = replace(
        springs.mesh, facets={"bottom": springs.mesh.facets["bottom"], "a--b -->": springs.mesh.facets["top"]}
    )
    named = replace(springs, attached=(top,), mesh=mesh, attached_skins={"a--b -->": springs.attached_skins["top"]})
    assert any("a- -b - ->" in text and "6.667 instead of 6.667 N/mm" in text for text in comments(named))


@pytest.mark.slow
def test_the_terminal_and_the_page_beside_the_file_say_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = small.write(tmp_path / "bar")
    words = ["export", str(scene), "--format", "febio", "--quiet", "--out", str(tmp_path)]
    changes = ["--set", "muscle.tet_size=9 mm", "--set", "attachment[1].stiffness=100 kPa/mm"]
    assert cli.main([*words, *changes, "--to", str(tmp_path / "springs")]) == cli.DONE
    said = capsys.readouterr().err
    assert 'FEBio\'s model differs: attachment "insertion": springs act at the nearest points' in said
    assert "5.3 and 8.8 % of the force" in said
    readme = (tmp_path / "springs" / "FEBIO.md").read_text()
    sentences = [line.split("model differs: ")[1] for line in said.splitlines() if "model differs" in line]
    assert sentences
    assert all(f"- {sentence}\n" in readme for sentence in sentences)
    assert cli.main([*words, "--set", "muscle.tet_size=9 mm", "--to", str(tmp_path / "exact")]) == cli.DONE
    assert "model differs" not in capsys.readouterr().err
    assert "- no springs at points of the surface" in (tmp_path / "exact" / "FEBIO.md").read_text()


@pytest.mark.slow
def test_python_exports_for_febio_as_well(tmp_path: Path) -> None:
    case = fr.load_case(small.write(tmp_path / "bar"), {"muscle.tet_size": "9 mm"})
    written = fr.export_case(case, tmp_path / "febio", "febio")
    assert {"scene.feb", "tet10.csv", "FEBIO.md"} <= set(written)
    assert ElementTree.parse(tmp_path / "febio" / "scene.feb").getroot().tag == "febio_spec"
    assert "scene.feb" not in fr.export_case(case, tmp_path / "open")
