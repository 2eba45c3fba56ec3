"""Bodies of any shape: reference cells, what element fits, what is prescribed, and where load steps end."""

from dataclasses import replace

import numpy as np
import pytest

from fem_reference.effects import make
from fem_reference.foundations.errors import InputError
from fem_reference.problems import shapes
from fem_reference.problems.body import (
    ELEMENTS,
    Body,
    ByCell,
    Kind,
    Prescribed,
    check_element,
    check_quadrature,
    is_stabilised,
    outer_facets,
    reference_nodes,
)
from fem_reference.problems.contact import ContactLaw
from fem_reference.problems.paths import Affine, Rest, Turn

LAW = make("neo_hooke", mu=0.01)
MIXED = (LAW, make("incompressible", bulk=1.0))
BOX = shapes.box((2, 3, 4), (2.0, 3.0, 4.0), "hexahedron")
KINDS: tuple[Kind, ...] = ("tetrahedron", "hexahedron")


@pytest.mark.parametrize(("kind", "counts"), [("tetrahedron", (4, 10)), ("hexahedron", (8, 27))])
def test_a_reference_cell_has_its_corners_first_each_node_once(kind: Kind, counts: tuple[int, int]) -> None:
    straight, curved = (reference_nodes(kind, degree) for degree in (1, 2))
    assert (len(straight), len(curved)) == counts
    assert np.array_equal(curved[: len(straight)], straight)
    assert len(np.unique(curved, axis=0)) == len(curved)
    assert np.isin(straight, (0, 1)).all()
    assert not np.isin(curved[len(straight) :], (0, 1)).all(axis=1).any()
    # In the order of (z, y, x): x runs fastest.
    assert straight[:2].tolist() == [[0, 0, 0], [1, 0, 0]]
    keys = straight @ [1, 2, 4]
    assert (np.diff(keys) > 0).all()


@pytest.mark.parametrize(("kind", "sides"), [("tetrahedron", 2), ("hexahedron", 1)])
def test_the_boundary_of_a_box_is_its_faces(kind: Kind, sides: int) -> None:
    mesh = shapes.box((2, 3, 4), (2.0, 3.0, 4.0), kind)
    found = np.sort(outer_facets(mesh)[0], axis=1)
    assert len(found) == sides * 2 * (2 * 3 + 3 * 4 + 4 * 2)
    assert (np.diff(found, axis=1) > 0).all()
    corners = mesh.points[found]
    ends = np.array([2.0, 3.0, 4.0])
    flat = (corners == 0).all(axis=1) | (corners == ends).all(axis=1)
    assert flat.any(axis=1).all()


def test_only_elements_of_one_degree_for_both_are_stabilised() -> None:
    assert [name for name in ELEMENTS if is_stabilised(name)] == ["P1/P1"]
    check_quadrature("P1/P1", 2, "here")
    check_quadrature("P1/P1", None, "here")
    check_quadrature("P2/P1", 1, "here")
    with pytest.raises(InputError, match="here: got 1, want 2 or more for P1/P1"):
        check_quadrature("P1/P1", 1, "here")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("effects", [(LAW,), MIXED])
def test_an_element_fits_by_cells_degree_and_pressure(kind: Kind, degree: int, effects) -> None:
    """Each element is taken or refused, and a message names just those that are taken."""
    taken, named = [], set()
    for name in ELEMENTS:
        try:
            check_element(name, kind, degree, effects, "here")
            taken.append(name)
        except InputError as error:
            named.add(error.want.rpartition(": ")[2])
    assert named == {", ".join(taken)}
    for name in taken:
        assert name.startswith("P" if kind == "tetrahedron" else "Q")
        assert ("/" in name) == (effects is MIXED)
        assert degree == 1 or name[1] == "2"
    assert len(taken) > 0


def test_an_element_that_there_is_not_is_refused_by_name() -> None:
    with pytest.raises(InputError, match=r'here: got "P7", want one of P1, P1/P1, P2'):
        check_element("P7", "tetrahedron", 1, (LAW,), "here")


def test_a_displacement_is_prescribed_along_its_components_only() -> None:
    points = BOX.points[:7]
    path = Affine(((0.1, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.3)))
    found = Prescribed("end", "x0", (0, 2), path).displacements(points, 1.0)
    assert found == pytest.approx(points * [0.1, 0, 0.3])
    for wrong, said in (
        (lambda points, _: points[:2], r"displacements \(2, 3\) of points \(7, 3\)"),
        (lambda points, _: points * 1j, "TypeError: complex numbers"),
        (lambda *_: 1 // 0, "ZeroDivisionError"),
    ):
        with pytest.raises(InputError, match=f'prescribed "end": path at frame 1: got {said}'):
            Prescribed("end", "x0", (0,), wrong).displacements(points, 1.0)


def test_a_path_cannot_change_the_points_of_a_body() -> None:
    points = np.array(BOX.points)

    def path(given: np.ndarray, _: float) -> np.ndarray:
        given[:] = 0
        return given

    Prescribed("end", "x0", (0,), path).displacements(points, 1.0)
    assert np.array_equal(points, BOX.points)


def test_fibres_of_cells_are_those_of_the_cell() -> None:
    vectors = np.eye(3)[[0, 1, 2, 0]]
    assert np.array_equal(ByCell(vectors)(np.array([3, 1, 1]), np.zeros((3, 3))), vectors[[3, 1, 1]])


def test_a_body_knows_its_size_and_the_points_of_its_regions() -> None:
    body = Body(BOX, (LAW,), (), (0.0, 1.0))
    assert body.size == pytest.approx(np.sqrt(4 + 9 + 16))
    end = body.points_on("x1")
    assert len(end) == 4 * 5
    assert (end[:, 0] == 2).all()


def test_what_overlaps_at_rest_is_wanted_from_where_it_is_relaxed() -> None:
    body = Body(BOX, (LAW,), (), (0.0, 1.0, 2.0))
    assert body.first == 0
    law = ContactLaw("x1", 1.0, 0.1)
    assert replace(body, contact=law).first == 0
    assert replace(body, contact=replace(law, relaxed=(0.0, 1.0))).first == 1


def test_load_steps_end_where_a_turn_is_a_quarter_and_at_no_frame_of_what_rests() -> None:
    fixed = Prescribed("foot", "z0", (0, 1, 2), Rest())
    turned = Prescribed("head", "z1", (0, 1, 2), Turn((0.0, 0.0, 1.0), 2 * np.pi, (1.0, 1.5, 0.0)))
    still, turning = (Body(BOX, (LAW,), some, (0.0, 1.0)) for some in ((fixed,), (fixed, turned)))
    assert set(still.stops) <= {0.0, 1.0}
    assert len(turning.stops) >= 3
    inside = [0.0, *(stop for stop in turning.stops if 0 < stop < 1), 1.0]
    assert max(np.diff(inside)) <= 0.25 + 1e-9
