"""Loads on parts that are prescribed exactly: refused for muscles and bodies, however these were made; nothing else is."""

from dataclasses import replace

import numpy as np
import pytest
import shapes

import fem_reference as fr
from fem_reference import effects
from fem_reference.problems.checks import check
from fem_reference.problems.paths import Affine, Rest
from fem_reference.solvers import scikit_fem

RAMP = [{"frame": 0, "amount": 0.0}, {"frame": 1, "amount": 1.0}]
MESH = fr.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron")
FIXED = fr.Prescribed("bottom", "z0", (0, 1, 2), Rest())
LAW = fr.make_effect("neo_hooke", mu=0.01)


def load(name: str, on: str, force: str = "0, 0, 1 kPa") -> effects.Effect:
    size = {"pressure": "1 kPa"} if name == "pressure" else {"force": force}
    return effects.make(name, on=on, ramp=RAMP, **size)


def body(*prescribed: fr.Prescribed, on: str = "z0", name: str = "pressure") -> fr.Body:
    return fr.Body(MESH, (LAW, load(name, on)), prescribed, (0.0, 1.0))


@pytest.mark.parametrize("name", ["pressure", "traction"])
def test_a_load_on_a_clamped_face_of_a_body_is_refused_by_every_solver(name) -> None:
    message = (
        rf'{name.title()} on "z0": got a part that is prescribed exactly .* want a part that is free along an axis'
    )
    with pytest.raises(fr.InputError, match=message):
        fr.solve_body(body(FIXED, name=name), element="P1")
    with pytest.raises(fr.InputError, match=message):
        scikit_fem.solve_body(body(FIXED, name=name), scikit_fem.ScikitBodySettings(element="P1"))


def test_axes_of_several_regions_count_together() -> None:
    sides = [replace(FIXED, name=f"side {axis}", components=(axis,)) for axis in range(3)]
    check(body(*sides[:2]), "P1")  # z0 slides along z: a load moves it
    with pytest.raises(fr.InputError, match="prescribed exactly"):
        check(body(*sides), "P1")


def test_a_face_is_known_by_its_facets_under_any_name_and_order() -> None:
    mesh = replace(MESH, facets={**MESH.facets, "half": MESH.facets["z0"][:1, ::-1]})
    with pytest.raises(fr.InputError, match='Pressure on "half": got a part that is prescribed exactly'):
        check(replace(body(FIXED, on="half"), mesh=mesh), "P1")
    # The half alone is clamped: the other facet of the face deforms.
    check(replace(body(replace(FIXED, on="half")), mesh=mesh), "P1")


@pytest.mark.parametrize("kind", ["tetrahedron", "hexahedron"])
def test_a_load_along_the_fixed_axis_of_a_symmetry_plane_is_refused(kind) -> None:
    mesh = fr.box((2, 1, 1), (2.0, 3.0, 4.0), kind)
    planes = tuple(replace(FIXED, name=name, on=name, components=(i,)) for i, name in enumerate(("x0", "y0", "z0")))
    corner = np.concatenate([mesh.facets[one.on] for one in planes])
    mesh = replace(mesh, facets={**mesh.facets, "corner": corner})

    def loaded(effect: effects.Effect, *prescribed: fr.Prescribed) -> fr.Body:
        return fr.Body(mesh, (LAW, effect), prescribed, (0.0, 1.0))

    element = "P1" if kind == "tetrahedron" else "Q1"
    for effect in (load("pressure", "z0"), load("traction", "z0"), load("pressure", "corner")):
        with pytest.raises(fr.InputError, match="prescribed exactly"):
            check(loaded(effect, *planes), element)
    check(loaded(load("traction", "z0", "1 kPa, 0 kPa, 1 kPa"), *planes), element)  # slides along x
    check(loaded(load("traction", "corner"), *planes), element)  # shears x0 and y0
    check(loaded(load("pressure", "corner"), *planes[:2]), element)


def test_a_pressure_on_a_slope_moves_it_along_the_axis_that_is_free() -> None:
    corners = MESH.points + 0.1 * MESH.points[:, :1] * [0, 0, 1]
    check(replace(body(replace(FIXED, components=(2,))), mesh=replace(MESH, points=corners)), "P1")


def test_a_pressure_on_a_face_that_its_path_tilts_acts_along_the_others() -> None:
    lifted, tilted = (
        fr.Prescribed("lid", "z1", (2,), Affine(gradient, (0.0, 0.0, 0.1)))
        for gradient in (((0.0, 0.0, 0.0),) * 3, ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.2, 0.0, 0.0)))
    )
    side = fr.Prescribed("side", "x0", (0, 2), lifted.path)  # shares an edge, and its displacements, with the lid
    for one in ((lifted,), (lifted, side)):
        with pytest.raises(fr.InputError, match="prescribed exactly"):
            check(body(*one, on="z1"), "P1")
    check(body(tilted, on="z1"), "P1")


def test_a_membrane_on_a_prescribed_face_is_stretched_by_its_path() -> None:
    """It is no load from outside: it has energy and tension wherever the face is stretched."""
    sheet = effects.make("membrane", on="z0", thickness="0.5 mm", mu="10 MPa")
    check(replace(body(FIXED), effects=(LAW, sheet)), "P1")


def test_springs_and_other_faces_are_loaded() -> None:
    check(body(replace(FIXED, stiffness=1.0)), "P1")
    check(body(FIXED, on="z1"), "P1")


def test_a_muscle_changed_in_python_is_refused() -> None:
    bar = shapes.bar((1, 1, 2), (2.0, 3.0, 4.0), {"bottom": None, "top": None}, (LAW,), (0, 1))
    free = replace(bar, effects=(LAW, load("pressure", "free")))
    assert len(np.unique(free.body.mesh.facets["free"])) == 12
    with pytest.raises(fr.InputError, match='Pressure on "top": got a part that is prescribed exactly'):
        replace(bar, effects=(LAW, load("pressure", "top"))).body  # noqa: B018
