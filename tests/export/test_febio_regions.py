"""Regions in FEBio's file: each tetrahedron is in one part, with the parameters that its share calls for."""

from dataclasses import replace
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import feb_file
import numpy as np
import pytest

from fem_reference import effects
from fem_reference.effects import Effect
from fem_reference.effects.fibre_passive import FibrePassive
from fem_reference.effects.fibre_passive_febio import FibrePassiveFebio
from fem_reference.export import febio, febio_contact, febio_regions
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import tet_volumes
from fem_reference.geometry.regions import Blended
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.scenes import casefile

MU = 0.01  # [MPa]
WITHIN = febio_regions.FACTOR - 1  # of the parameters of a part
LENGTH, WIDTH = 10.0, 20.0  # [mm]: where the tendon begins, and the transition beyond


def depth(points: np.ndarray) -> np.ndarray:
    """The depth [mm] in the upper part of a bar."""
    return points[:, 2] - LENGTH


def law(name: str, region: str, **parameters: Any) -> Effect:
    return effects.make(name, **parameters).model_copy(update={"region": region})


def tendinous(*more: Effect, width: float = WIDTH, stiff: float = 1.0) -> MuscleProblem:
    """A bar of 30 mm that becomes a tendon of a ``stiff`` shear modulus [MPa], with the bones of the shared one and more laws."""
    acting = (
        law("neo_hooke", "not tendon", mu=MU),
        law("neo_hooke", "tendon", mu=stiff),
        law("incompressible", "not tendon", bulk=1000 * MU),
        law("incompressible", "tendon", bulk=100 * stiff),
    )
    return replace(feb_file.bar(), effects=(*acting, *more), regions={"tendon": Blended(depth, width)})


@pytest.fixture(scope="module", params=[1.0, 100.0])
def problem(request: pytest.FixtureRequest) -> MuscleProblem:
    """With a tendon a hundred times as stiff as the muscle, or ten thousand times."""
    fibres = law("fibre_passive", "not tendon", **effects.example("fibre_passive"))
    return tendinous(fibres, stiff=request.param)


@pytest.fixture(scope="module")
def feb(problem: MuscleProblem, tmp_path_factory: pytest.TempPathFactory) -> Element:
    folder = tmp_path_factory.mktemp("regions")
    febio.write(problem, folder)
    return ElementTree.parse(folder / "scene.feb").getroot()


def parts_of(feb: Element) -> dict[str, Element]:
    """The materials of the muscle by the name of their elements, as the file says it."""
    materials = {one.get("name"): one for one in feb.iterfind("Material/material")}
    return {str(one.get("name")): materials[one.get("mat")] for one in feb.iterfind("MeshDomains/SolidDomain")}


def test_each_tetrahedron_is_in_one_part_once(feb: Element, problem: MuscleProblem) -> None:
    own = parts_of(feb)
    assert len(own) > 3
    cells = np.concatenate([feb_file.cells(feb, name) for name in own])[:, :4] - 1
    assert sorted(map(tuple, cells.tolist())) == sorted(map(tuple, problem.mesh.tets.tolist()))
    ids = [one.get("id") for one in feb.iterfind("Material/material")]
    assert ids == [str(number) for number in range(1, len(ids) + 1)]
    assert [one.get("elem_set") for one in feb.iterfind("MeshData/ElementData")] == list(own)


def test_materials_are_the_laws_times_their_shares(feb: Element, problem: MuscleProblem) -> None:
    """The stiffness rises a hundredfold: in each tetrahedron it is that of the mean share, as near as parts are."""
    share, stiff = Blended(depth, WIDTH), problem.effects[1].mu
    stress = next(one.stress for one in problem.effects if isinstance(one, FibrePassive))
    # A quadrature of 20 x 20 x 20 points, by barycentric shares, for the one of four.
    random = np.random.default_rng(1).dirichlet(np.ones(4), 8000)
    for name, material in parts_of(feb).items():
        corners = problem.mesh.points[feb_file.cells(feb, name)[:, :4] - 1]
        means = np.array([share(random @ points).mean() for points in corners])
        at = {key: [float(one.text or "") for one in material.iter(key)] for key in ("c1", "k", "smax")}
        assert 2 * at["c1"][0] == pytest.approx(MU + means * (stiff - MU), rel=WITHIN)
        assert at["k"][0] == pytest.approx(1000 * MU + means * (100 * stiff - 1000 * MU), rel=WITHIN)
        assert sum(at["smax"]) == pytest.approx(stress * (1 - means), rel=WITHIN, abs=1e-6 * stress)


def test_the_stiffness_of_all_is_kept(problem: MuscleProblem) -> None:
    """What a part has in all is what its tetrahedra have: nothing is lost by the parts."""
    volumes = tet_volumes(problem.mesh.points, problem.mesh.tets)
    inner = febio_regions.shares(problem)["tendon"]
    tendon = problem.effects[1].mu
    stiff = sum(
        sum(getattr(one, "mu", 0.0) for one in part.effects) * volumes[part.cells].sum()
        for part in febio_regions.parts(problem)
    )
    assert stiff == pytest.approx(volumes @ (MU + inner * (tendon - MU)), rel=1e-12)


def test_a_jump_that_follows_facets_is_two_materials() -> None:
    """No effect that has no share is in a part: FEBio has no law of zero stiffness."""
    found = febio_regions.parts(tendinous(width=0.0))
    assert [[one.mu for one in part.effects if hasattr(one, "mu")] for part in found] == [[1.0], [MU]]
    assert [len(part.cells) for part in found] == [48, 24]  # thirds of 72


def test_without_regions_the_muscle_is_one_part() -> None:
    (part,) = febio_regions.parts(plain := feb_file.bar())
    assert (part.name, part.effects) == ("muscle", plain.effects)
    assert not febio_regions.note(plain)


def test_the_file_says_what_a_region_is_there(problem: MuscleProblem) -> None:
    many = len(febio_regions.parts(problem))
    assert any(
        text.startswith(f"regions are represented by {many} materials; ") for text in febio_contact.notes(problem)
    )


def test_fibres_of_two_laws_that_febio_has_as_one_are_refused() -> None:
    """The second would replace the first in the file."""
    case = casefile.muscle(casefile.read("hip_flexion_tendon"))
    febio.check(case)
    given = effects.example("fibre_passive_febio")
    two = (
        law("fibre_passive_febio", "tendon", **given),
        law("fibre_passive_febio", "not tendon", **given | {"c4": 1.5}),
    )
    with pytest.raises(InputError, match="fibre_passive_febio with different c4 or linear_from"):
        febio.check(case.model_copy(update={"effect": (*case.effect, *two)}))
    (part, *_) = febio_regions.parts(tendinous(two[0], two[0].model_copy(update={"region": "not tendon"})))
    assert sum(one.c3 for one in part.effects if isinstance(one, FibrePassiveFebio)) == pytest.approx(two[0].c3)
