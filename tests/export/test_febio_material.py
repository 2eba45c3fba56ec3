"""What of FEBio's file has a law of its own there: passive fibres, springs. The laws are written down here as FEBio has them."""

from dataclasses import replace
from xml.etree.ElementTree import Element

import acting
import feb_file
import numpy as np
import pytest
from feb_file import cells, effects, nodes

from fem_reference.export import febio, febio_material
from fem_reference.foundations.mesh import triangle_areas
from fem_reference.problems.muscle import MuscleProblem

FIBRE = {"stress": "300 kPa", "p1": 0.05, "p2": 6.6, "linear_from": 1.4}
STIFFNESS = 0.1  # MPa/mm


@pytest.fixture(scope="module")
def bar() -> MuscleProblem:
    """With passive fibres; attached exactly at one end and by springs at the other."""
    plain = feb_file.bar()
    acts = effects("neo_hooke", "incompressible", "fibre_passive", "contact")
    bottom, top = plain.attached
    return replace(plain, effects=acts, attached=(bottom, replace(top, stiffness=STIFFNESS)))


@pytest.fixture(scope="module")
def feb(bar: MuscleProblem) -> Element:
    return febio.model(bar)


def muscle_material(constants: dict[str, float], F: np.ndarray, fibre: np.ndarray) -> np.ndarray:
    """The Cauchy stress [MPa] of FEBio's ``muscle material`` (theory manual, "Muscle Material") without its shear moduli and
    activation, (3, 3): ``l W'(l) dev(a a) / J`` with the isochoric fibre stretch l and the fibre's direction a.
    """
    J = np.linalg.det(F)
    along = F @ fibre
    stretch = np.linalg.norm(along) * J ** (-1 / 3)
    a = along / np.linalg.norm(along)
    p1, p2, optimal, end = (constants[key] for key in ("p1", "p2", "Lofl", "lam_max"))
    if stretch <= optimal:
        force = 0.0
    elif stretch < end:
        force = p1 * (np.exp(p2 * (stretch / optimal - 1)) - 1)
    else:
        p3 = p1 * p2 * np.exp(p2 * (end / optimal - 1))
        p4 = p1 * (np.exp(p2 * (end / optimal - 1)) - 1) - p3 * end / optimal
        force = p3 * stretch / optimal + p4
    slope = constants["smax"] * force / optimal
    return stretch * slope / J * (np.outer(a, a) - np.eye(3) / 3)


@pytest.mark.parametrize("optimal", [0.9, 1.0, 1.1])
@pytest.mark.parametrize("stretch", [0.8, 0.95, 1.05, 1.2, 1.35, 1.5, 1.7])
def test_passive_fibres_have_the_stress_of_the_effect(optimal: float, stretch: float) -> None:
    """``dW/dF F^T / J`` of the effect by central differences, whose error at a step of 1e-5 is 1e-9 of a stress of 1 MPa; below,
    in and beyond the toe, in states that shear and change the volume.
    """
    effect = acting.make("fibre_passive", optimal_stretch=optimal, **FIBRE)
    constants = febio_material.fibre_constants(effect)
    assert {constants[key] for key in ("g1", "g2", "g3", "activation")} == {0.0}
    sheared = np.array([[1, 0.2, 0.1], [0, 0.9, 0.3], [-0.1, 0, 1.05]])
    volume, along = np.linalg.det(sheared), np.linalg.norm(sheared @ acting.FIBRE)
    extended = (stretch * volume ** (1 / 3) / along) ** 1.5  # it changes the volume as well
    F = sheared @ (np.eye(3) + (extended - 1) * np.outer(acting.FIBRE, acting.FIBRE))
    assert np.linalg.norm(F @ acting.FIBRE) == pytest.approx(stretch * np.linalg.det(F) ** (1 / 3), rel=1e-12)
    slope = np.zeros((3, 3))
    for i, j in np.ndindex(3, 3):
        step = np.zeros((3, 3))
        step[i, j] = 1e-5
        after, before = (effect.energy(acting.state(F + sign * step)) for sign in (1, -1))
        slope[i, j] = (after - before) / 2e-5
    assert np.allclose(muscle_material(constants, F, acting.FIBRE), slope @ F.T / np.linalg.det(F), rtol=0, atol=1e-7)


def test_the_muscle_is_a_mixture_of_its_matrix_and_its_fibres(feb: Element) -> None:
    """The bulk modulus is that of the mixture alone: FEBio ignores those of its solids."""
    muscle = feb.find("Material/material[@name='muscle']")
    assert muscle.attrib["type"] == "uncoupled solid mixture"
    assert {entry.tag: float(entry.text) for entry in muscle if entry.tag != "solid"} == {"pressure_model": 2, "k": 10}
    matrix, fibres = muscle.iterfind("solid")
    assert matrix.attrib["type"] == "Mooney-Rivlin"
    assert {entry.tag: float(entry.text) for entry in matrix} == {"c1": 0.005, "c2": 0}
    assert fibres.attrib["type"] == "muscle material"
    found = {entry.tag: float(entry.text) for entry in fibres if entry.tag != "fiber"}
    toe = {"p1": 0.05, "p2": 6.6, "Lofl": 1.1, "smax": 0.3, "lam_max": pytest.approx(1.54)}  # 1.4 optimal lengths
    assert found == {"g1": 0, "g2": 0, "g3": 0, "activation": 0} | toe
    assert fibres.find("fiber/vector").text == "1,0,0"
    assert feb.find("MeshData/ElementData").attrib == {"type": "mat_axis", "elem_set": "muscle"}


def test_both_laws_of_fibres_together(bar: MuscleProblem) -> None:
    both = effects("mooney_rivlin", "incompressible", "fibre_passive", "fibre_passive_febio")
    solids = febio.model(replace(bar, effects=both)).findall("Material/material[@name='muscle']/solid")
    assert [solid.attrib["type"] for solid in solids] == ["trans iso Mooney-Rivlin", "muscle material"]
    assert all(solid.find("fiber/vector").text == "1,0,0" for solid in solids)


def test_an_end_attached_by_springs_is_attached_by_them_alone(feb: Element) -> None:
    assert [entry.attrib["name"] for entry in feb.iterfind("Mesh/NodeSet")] == ["attached_bottom"]
    assert [entry.attrib["node_set"] for entry in feb.iterfind("Boundary/bc")] == ["attached_bottom"]
    springs = feb.find("Contact/contact[@type='tied-elastic']")
    wanted = {"laugon": 0, "two_pass": 0, "auto_penalty": 0, "symmetric_stiffness": 0, "penalty": STIFFNESS}
    assert {key: float(springs.find(key).text) for key in wanted} == wanted
    pair = feb.find(f"Mesh/SurfacePair[@name='{springs.attrib['surface_pair']}']")
    assert [(side.tag, side.text) for side in pair] == [
        ("primary", "springs_top_bone"),
        ("secondary", "springs_top_muscle"),
    ]
    assert feb.find("MeshDomains/ShellDomain[@name='springs_top']").attrib["mat"] == "bone_top"


def test_no_node_of_the_muscle_is_attached_where_all_is_attached_by_springs(bar: MuscleProblem) -> None:
    feb = febio.model(replace(bar, attached=tuple(replace(attached, stiffness=STIFFNESS) for attached in bar.attached)))
    assert feb.find("Boundary") is None
    assert len(feb.findall("Contact/contact[@type='tied-elastic']")) == 2


def test_springs_hang_from_a_rigid_copy_that_faces_the_area_attached(feb: Element) -> None:
    """FEBio's rays from one surface of a pair meet the other only where the normals oppose (FESurface::IntersectTri6)."""
    points = nodes(feb)
    bone, muscle = (cells(feb, f"springs_top_{side}", "Surface") for side in ("bone", "muscle"))
    assert np.array_equal(bone, cells(feb, "springs_top"))
    assert bone.min() > cells(feb, "bone_rests & <waits>").max()
    assert muscle.max() <= cells(feb, "muscle").max()
    assert triangle_areas(points, bone[:, :3]).sum() == pytest.approx(100, rel=1e-12)  # 10 x 10
    for surface, up in ((muscle, 1), (bone, -1)):
        a, b, c = (points[surface[:, k]] for k in range(3))
        normal = np.cross(b - a, c - a)
        assert (up * normal[:, 2] > 0).all()
        for middle, (p, q) in zip(surface[:, 3:].T, ((0, 1), (1, 2), (2, 0)), strict=True):
            assert np.allclose(points[middle], (points[surface[:, p]] + points[surface[:, q]]) / 2, rtol=0, atol=1e-12)
    corners = [{tuple(sorted(map(tuple, points[facet[:3]]))) for facet in surface} for surface in (bone, muscle)]
    assert corners[0] == corners[1]


def shapes_of_tri6(r: np.ndarray) -> np.ndarray:
    """FEBio's six shape functions at points (n, 2) of its reference triangle, (n, 6)."""
    b, c = r.T
    a = 1 - b - c
    return np.stack([*(x * (2 * x - 1) for x in (a, b, c)), 4 * a * b, 4 * b * c, 4 * c * a], axis=1)


def rule() -> tuple[np.ndarray, np.ndarray]:
    """Points (7, 2) and weights of the rule of degree 5 that FEBio has for six-node triangles (Radon 1948)."""
    near, far = (6 - 15**0.5) / 21, (6 + 15**0.5) / 21
    points = [(1 / 3, 1 / 3)]
    for share in (near, far):
        points += [(share, share), (1 - 2 * share, share), (share, 1 - 2 * share)]
    weights = [9 / 40, *[(155 - 15**0.5) / 1200] * 3, *[(155 + 15**0.5) / 1200] * 3]
    return np.array(points), np.array(weights) / 2


def test_springs_pull_with_their_stiffness_per_rest_area(feb: Element) -> None:
    """FEBio's sum over the points of the rigid copy, each tied to where the muscle was at rest: under a quadratic displacement u
    the energy is k / 2 times the integral of u . u over 10 x 10, and the force k times that of u, both exact.
    """
    points, (r, weights) = nodes(feb), rule()
    bone, muscle = (cells(feb, f"springs_top_{side}", "Surface") for side in ("bone", "muscle"))
    middle = {tuple(np.round(points[facet[:3]].mean(axis=0), 9)): facet for facet in muscle}
    force, energy = np.zeros(3), 0.0
    for facet in bone:
        tied = middle[tuple(np.round(points[facet[:3]].mean(axis=0), 9))]
        edges = points[tied[1:3]] - points[tied[0]]
        twice = np.linalg.norm(np.cross(*(points[facet[1:3]] - points[facet[0]])))
        for at, weight in zip(shapes_of_tri6(r) @ points[facet], weights, strict=True):
            own = np.linalg.lstsq(edges.T, at - points[tied[0]], rcond=None)[0]  # where FEBio's projection ends
            x, y, _ = points[tied].T
            displacement = shapes_of_tri6(own[None])[0] @ np.stack([x**2, x * y, 0 * x + 3], axis=1)
            force += STIFFNESS * displacement * twice * weight
            energy += STIFFNESS / 2 * displacement @ displacement * twice * weight
    assert force == pytest.approx(STIFFNESS * np.array([1e4 / 3, 2500, 300]), rel=1e-12)
    assert energy == pytest.approx(STIFFNESS / 2 * (2e5 + 1e6 / 9 + 900), rel=1e-12)  # of x^4, x^2 y^2 and 9
