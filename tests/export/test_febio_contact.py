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

import fem_reference as fr
from fem_reference import cli
from fem_reference.export import febio, febio_contact
from fem_reference.export.febio_contact import overlaps
from fem_reference.foundations.mesh import Surface
from fem_reference.geometry.skins import attached_skin
from fem_reference.problems.muscle import MuscleProblem

STIFFNESS = 0.1  # MPa/mm


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
    assert all(f"{deep:.2g} mm inside" in text and f"search_radius is {wanted:.2g} mm" in text for text in said)


def test_a_bone_that_is_no_obstacle_may_overlap() -> None:
    """The contact of the bar is by the bone "top" alone."""
    problem = overlapping(0.5, "rests & <waits>")
    assert overlaps(problem) == {"top": 0.0}
    assert radius(problem) == 5.0


@pytest.fixture(scope="module")
def springs() -> MuscleProblem:
    """A bar whose top of 10 x 10 mm, all of it facets of the tets, is attached on 10 x 8 mm of the muscle's own surface; the bones
    are far from its sides.
    """
    bar = feb_file.bar()
    far = bar.bones[0].surface.moved_to(bar.bones[0].surface.points - [100, 0, 0])
    bar = replace(bar, bones=tuple(replace(bone, surface=far) for bone in bar.bones))
    area = Surface(np.array([[0.0, 0, 30], [10, 0, 30], [10, 8, 30], [0, 8, 30]]), np.array([[0, 1, 2], [0, 2, 3]]))
    top = replace(bar.attached[1], stiffness=STIFFNESS)
    skin = attached_skin(area, np.ones((2, 3)), bar.mesh, 3.0)
    return replace(bar, attached=(bar.attached[0], top), attached_skins={"top": skin})


def test_springs_of_another_spread_are_said_with_how_stiff_they_are(springs: MuscleProblem) -> None:
    """0.1 MPa/mm over 100 and 80 mm2, whose middles are 5 and 4 mm from the edge; about that of the 80, second moments of area are
    ``10^3 10 / 12`` and ``10^3 10 / 12 + 100`` for ``10^3 8 / 12`` and ``8^3 10 / 12``, about z their sums.
    """
    first, measured = febio_contact.notes(springs)
    assert 'attachment "top"' in first
    assert "10 N/mm in all for 8 (+25.0 %), their middle 1.00 mm away" in first
    x, y, own_x, own_y = 1e4 / 12, 1e4 / 12 + 100, 8e3 / 12, 5120 / 12
    ratios = sorted([x / own_x, y / own_y, (x + y) / (own_x + own_y)])
    assert f"{ratios[0]:.2f} to {ratios[-1]:.2f} times as stiff against turning" in first  # 1.25 to 2.19
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
    assert any("a- -b - ->" in text and "10 N/mm in all for 8" in text for text in comments(named))


def test_the_terminal_and_the_page_beside_the_file_say_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = small.write(tmp_path / "bar")
    words = ["export", str(scene), "--format", "febio", "--quiet", "--out", str(tmp_path)]
    changes = ["--set", "muscle.tet_size=9 mm", "--set", "attachment[1].stiffness=100 kPa/mm"]
    assert cli.main([*words, *changes, "--to", str(tmp_path / "springs")]) == cli.DONE
    said = capsys.readouterr().err
    assert 'another model in FEBio: attachment "insertion": springs over facets' in said
    assert "5.3 and 8.8 % of the force" in said
    readme = (tmp_path / "springs" / "FEBIO.md").read_text()
    sentences = [line.split("FEBio: ")[1] for line in said.splitlines() if "another model" in line]
    assert sentences
    assert all(f"- {sentence}\n" in readme for sentence in sentences)
    assert cli.main([*words, "--set", "muscle.tet_size=9 mm", "--to", str(tmp_path / "exact")]) == cli.DONE
    assert "another model" not in capsys.readouterr().err
    assert "- no springs at points of the surface" in (tmp_path / "exact" / "FEBIO.md").read_text()


def test_python_exports_for_febio_as_well(tmp_path: Path) -> None:
    case = fr.load_case(small.write(tmp_path / "bar"), {"muscle.tet_size": "9 mm"})
    written = fr.export_case(case, tmp_path / "febio", "febio")
    assert {"scene.feb", "tet10.csv", "FEBIO.md"} <= set(written)
    assert ElementTree.parse(tmp_path / "febio" / "scene.feb").getroot().tag == "febio_spec"
    assert "scene.feb" not in fr.export_case(case, tmp_path / "open")
