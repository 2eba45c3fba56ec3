"""Several muscles in FEBio's input file: each as it is alone, with names and numbers of its own, and contact between them."""

import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
import pytest

from fem_reference import export
from fem_reference.effects.incompressible import Incompressible
from fem_reference.effects.neo_hooke import NeoHooke
from fem_reference.export import febio, febio_several
from fem_reference.problems import of_case
from fem_reference.problems.muscles import MusclesProblem
from fem_reference.scenes import casefile

pytestmark = pytest.mark.slow
NAMES = ("deep", "superficial")


@pytest.fixture(scope="module")
def problem() -> MusclesProblem:
    case = casefile.read("two_muscles", changes={f"muscle[{i}].tet_size": "14 mm" for i in (0, 1)})
    built = of_case.problem(case, of_case.setup(case))
    assert isinstance(built, MusclesProblem)
    return built


@pytest.fixture(scope="module")
def folder(problem: MusclesProblem, tmp_path_factory: pytest.TempPathFactory) -> Path:
    to = tmp_path_factory.mktemp("export") / "two"
    export.export(casefile.read("two_muscles"), lambda: problem, to, "febio")
    return to


@pytest.fixture(scope="module")
def feb(folder: Path) -> Element:
    return ElementTree.parse(folder / "scene.feb").getroot()


def numbers(entries: list[Element]) -> list[int]:
    return [int(entry.get("id", "")) for entry in entries]


def nodes(feb: Element) -> dict[int, np.ndarray]:
    return {int(one.get("id", "")): np.array(one.text.split(","), float) for one in feb.iter("node")}


def test_numbers_are_in_one_row_and_names_are_once(feb: Element) -> None:
    for tag in ("node", "elem", "material", "load_controller"):
        found = numbers(list(feb.iter(tag)))
        assert found == list(range(1, len(found) + 1))
    for tag in ("Nodes", "Elements", "Surface", "SurfacePair", "NodeSet", "material", "contact", "rigid_bc", "bc"):
        names = [one.get("name") for one in feb.iter(tag)]
        assert len(names) == len(set(names))
        assert names or tag == "NodeSet"


def test_what_is_referred_to_is_there(feb: Element) -> None:
    named = {
        tag: {one.get("name") for one in feb.iter(tag)} for tag in ("Surface", "SurfacePair", "material", "Elements")
    }
    curves = set(numbers(list(feb.iter("load_controller"))))
    assert {one.text for pair in feb.iter("SurfacePair") for one in pair} <= named["Surface"]
    assert {one.get("surface_pair") for one in feb.iter("contact")} <= named["SurfacePair"]
    assert {one.text for one in feb.iter("rb")} <= named["material"]
    domains = [one for kind in ("SolidDomain", "ShellDomain") for one in feb.iter(kind)]
    assert {one.get("name") for one in domains} == named["Elements"]
    assert {one.get("mat") for one in domains} == named["material"]
    assert {int(one.get("lc", "")) for one in feb.iter() if one.get("lc")} <= curves
    sets = {one.get("name") for kind in ("NodeSet", "Nodes") for one in feb.iter(kind)}
    assert {one.get("node_set") for one in feb.iter() if one.get("node_set")} <= sets


def test_each_muscle_is_where_it_is_alone(feb: Element, problem: MusclesProblem) -> None:
    at = nodes(feb)
    for name, one in problem.problems.items():
        alone = febio.model(one)
        own = nodes(alone)
        for tag in ("elem", "tri6"):
            parents = [(p, f"{name}_{p.get('name')}") for kind in ("Elements", "Surface") for p in alone.iter(kind)]
            for parent, full in parents:
                wanted = [[own[int(i)] for i in entry.text.split(",")] for entry in parent.findall(tag)]
                (there,) = [p for kind in ("Elements", "Surface") for p in feb.iter(kind) if p.get("name") == full]
                found = [[at[int(i)] for i in entry.text.split(",")] for entry in there.findall(tag)]
                assert np.array_equal(wanted, found)


def test_the_muscles_touch_by_the_surfaces_that_are_not_attached(feb: Element, problem: MusclesProblem) -> None:
    """Both sides of a muscle have half the stiffness in the reference: two passes of half the penalty."""
    (pair,) = [one for one in feb.iter("SurfacePair") if one.get("name") == "touching_0_deep_superficial_pair"]
    assert [one.text for one in pair] == ["deep_touching", "superficial_touching"]
    (contact,) = [one for one in feb.iter("contact") if one.get("surface_pair") == pair.get("name")]
    assert contact.get("type") == "sliding-elastic"
    settings = {one.tag: one.text for one in contact}
    assert (settings["two_pass"], float(settings["penalty"]), settings["laugon"]) == ("1", 0.5 / 2, "0")
    assert float(settings["fric_coeff"]) == 0
    said = [one.text for one in febio_several.model(problem).iter(ElementTree.Comment)]
    assert sum("mm, N, MPa" in text for text in said) == 1
    assert any("deep and superficial touch by FEBio's law" in text for text in said)
    at = nodes(feb)
    for name in NAMES:
        (surface,) = [one for one in feb.iter("Surface") if one.get("name") == f"{name}_touching"]
        facets = [[int(i) for i in one.text.split(",")] for one in surface]
        own = problem.problems[name].body.mesh
        corners = own.points[own.facets["free"][:, :3]]
        assert np.array_equal([[at[i] for i in facet[:3]] for facet in facets], corners)
    assert feb.findtext("Control/solver/symmetric_stiffness") == "non-symmetric"


def test_muscles_that_rub_rub_in_febio(problem: MusclesProblem) -> None:
    assert problem.law is not None
    rubbing = replace(problem, law=problem.law.model_copy(update={"friction": 0.3}))
    contacts = {one.get("surface_pair"): one for one in febio_several.model(rubbing).iter("contact")}
    assert {one.tag: one.text for one in contacts["touching_0_deep_superficial_pair"]}["fric_coeff"] == "0.3"


def test_a_muscle_with_a_region_has_its_materials_beside_those_of_the_other(problem: MusclesProblem) -> None:
    deep = problem.problems["deep"]
    acting = tuple(
        effect.model_copy(update={"region": region})
        for effect in deep.effects
        for region in (("end", "not end") if isinstance(effect, NeoHooke | Incompressible) else ("",))
    )
    stiffer = tuple(
        one.model_copy(update={"mu": 1.0}) if getattr(one, "mu", 0) and one.region == "end" else one for one in acting
    )
    regions = {"end": lambda points: np.where(points[:, 0] > 80, 1.0, 0.0)}
    several = replace(problem, problems=problem.problems | {"deep": replace(deep, effects=stiffer, regions=regions)})
    feb = febio_several.model(several)
    domains = {one.get("name"): one.get("mat") for one in feb.iter("SolidDomain")}
    names = [name for name in domains if name.startswith("deep_muscle_")]
    assert len(names) > 2
    assert set(domains) == {*names, "superficial_muscle"}
    assert set(domains.values()) <= {one.get("name") for one in feb.iter("material")}
    constants = {
        one.get("name"): float(one.findtext("c1")) for one in feb.iter("material") if one.find("c1") is not None
    }
    assert 2 * max(constants.values()) == pytest.approx(1.0)
    assert 2 * constants["superficial_muscle"] == pytest.approx(0.01)
    for tag in ("node", "elem", "material"):
        assert numbers(list(feb.iter(tag))) == list(range(1, len(list(feb.iter(tag))) + 1))


def test_each_muscle_has_a_folder_that_is_complete(folder: Path) -> None:
    assert [path.name for path in sorted(folder.iterdir())] == [
        "FEBIO.md",
        "README.md",
        "deep",
        "scene.feb",
        "superficial",
    ]
    for name in NAMES:
        files = {path.name for path in (folder / name).iterdir()}
        assert {"muscle.ply", "tets.vtu", "poses.csv", "scene.json", "tet10.csv", "candidate.toml"} <= files
        assert "compare two_muscles --candidate" in (folder / name / "README.md").read_text()
    text = (folder / "README.md").read_text()
    assert "deep and superficial" in text
    assert not re.search(r"\$\w", text)
