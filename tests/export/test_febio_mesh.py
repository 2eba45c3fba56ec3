"""The mesh of FEBio's file: its order of nodes, what is attached, and surfaces of contact, from its manual once more."""

from dataclasses import replace
from xml.etree.ElementTree import Element

import numpy as np
import pytest
from feb_file import cells, nodes

from fem_reference.export import febio
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import boundary, tet_volumes, triangle_areas
from fem_reference.problems.muscle import MuscleProblem


def shapes_of_febio(r: np.ndarray) -> np.ndarray:
    """FEBio's ten shape functions at points (n, 3) of its reference tet, (n, 10)."""
    a, (b, c, d) = 1 - r.sum(axis=1), r.T
    corners = [x * (2 * x - 1) for x in (a, b, c, d)]
    return np.stack([*corners, 4 * a * b, 4 * b * c, 4 * c * a, 4 * a * d, 4 * b * d, 4 * c * d], axis=1)


def test_elements_are_straight_tets_of_positive_volume_in_febios_order(feb: Element, bar: MuscleProblem) -> None:
    """In that order alone its shape functions carry its reference tet linearly to where the corners are (rounding at 30 mm)."""
    at = nodes(feb)[cells(feb, "muscle")]
    r = np.random.default_rng(1).dirichlet(np.ones(4), size=20)
    linear = np.einsum("pk,ekx->epx", r, at[:, :4])
    assert np.allclose(np.einsum("pk,ekx->epx", shapes_of_febio(r[:, 1:]), at), linear, rtol=0, atol=1e-12)
    volumes = tet_volumes(at.reshape(-1, 3), 10 * np.arange(len(at))[:, None] + np.arange(4))
    assert volumes.min() > 0
    assert volumes.sum() == pytest.approx(3000, rel=1e-12)  # 10 x 10 x 30
    assert len(at) == len(bar.mesh.tets)


def test_attached_nodes_are_all_of_an_end(feb: Element) -> None:
    """5 x 5 nodes of the 2 x 2 cells in a face: corners, and middles of edges and diagonals."""
    points = nodes(feb)
    for name, height in (("bottom", 0.0), ("top", 30.0)):
        attached = [int(text) for text in feb.find(f"Mesh/NodeSet[@name='attached_{name}']").text.split(",")]
        assert set(attached) == set(np.flatnonzero(np.isclose(points[: 1 + cells(feb, "muscle").max(), 2], height)))
        assert len(attached) == 25
        assert feb.find(f"Boundary/bc[@node_set='attached_{name}']/rb").text == f"bone_{name}"


def test_a_node_goes_with_one_bone(bar: MuscleProblem) -> None:
    """Attachments that share an edge: what the first has, the second has not."""
    facets = bar.mesh.facets["bottom"]
    split = replace(bar.mesh, facets={"bottom": facets[:4], "top": facets[4:]})
    feb = febio.model(replace(bar, mesh=split))
    one, other = (set(entry.text.split(",")) for entry in feb.iterfind("Mesh/NodeSet"))
    assert not one & other
    assert len(one | other) == 25


def test_the_contact_surfaces(feb: Element) -> None:
    """All of the sides 10 x 30, up to the attached ends: the reference feels contact from 0.4 mm off them, less than the size of a
    facet; they face outwards, as FEBio's surfaces must.
    """
    points, free = nodes(feb), cells(feb, "muscle_free", "Surface")
    assert triangle_areas(points, free[:, :3]).sum() == pytest.approx(4 * 10 * 30, rel=1e-12)
    for middle, (a, b) in zip(free[:, 3:].T, ((0, 1), (1, 2), (2, 0)), strict=True):
        assert np.allclose(points[middle], (points[free[:, a]] + points[free[:, b]]) / 2, rtol=0, atol=1e-12)
    a, b, c = (points[free[:, k]] for k in range(3))
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), a - [5, 5, 15]) > 0).all()
    (contact,) = feb.iterfind("Contact/contact")  # of the bone that the effect names
    assert contact.find("penalty").text == "0.5"  # 500 kPa/mm
    assert contact.find("auto_penalty").text == "0"
    pair = feb.find("Mesh/SurfacePair")
    assert [surface.text for surface in pair] == ["muscle_free", "bone_top_surface"]
    ball = cells(feb, "bone_top_surface", "Surface")
    a, b, c = (points[ball[:, k]] for k in range(3))
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), a) > 0).all()
    assert np.array_equal(ball, cells(feb, "bone_top"))


def test_a_contact_surface_without_facets_is_refused(bar: MuscleProblem) -> None:
    """All sides attached: no facet is left, where FEBio would run without contact and say nothing."""
    outer = boundary(bar.mesh.tets)[0]
    nowhere = replace(bar, mesh=replace(bar.mesh, facets={"bottom": outer, "top": outer[:1]}))
    with pytest.raises(
        InputError, match=r"contact: got no facet of the tetrahedra farther than 0\.41 mm from attached parts"
    ):
        febio.model(nowhere)


def test_a_bone_whose_triangles_face_inwards_is_turned(bar: MuscleProblem) -> None:
    ball = bar.bones[0].surface
    inwards = replace(bar.bones[0], surface=replace(ball, triangles=ball.triangles[:, ::-1]))
    upright, turned = (febio.model(replace(bar, bones=(bone,), attached=())) for bone in (bar.bones[0], inwards))
    assert np.array_equal(cells(upright, "bone_bottom"), cells(turned, "bone_bottom"))
