"""Loads on parts that are prescribed exactly: refused for muscles and bodies, however these were made; nothing else is."""

from dataclasses import replace

import numpy as np
import pytest
import shapes

import fem_reference as fr
from fem_reference import effects
from fem_reference.problems.checks import check
from fem_reference.problems.paths import Rest
from fem_reference.solvers import scikit_fem

RAMP = [{"frame": 0, "amount": 0.0}, {"frame": 1, "amount": 1.0}]
MESH = fr.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron")
FIXED = fr.Prescribed("bottom", "z0", (0, 1, 2), Rest())
LAW = fr.make_effect("neo_hooke", mu=0.01)


def load(name: str, on: str) -> effects.Effect:
    size = {"pressure": "1 kPa"} if name == "pressure" else {"force": "0, 0, 1 kPa"}
    return effects.make(name, on=on, ramp=RAMP, **size)


def body(*prescribed: fr.Prescribed, on: str = "z0", name: str = "pressure") -> fr.Body:
    return fr.Body(MESH, (LAW, load(name, on)), prescribed, (0.0, 1.0))


@pytest.mark.parametrize("name", ["pressure", "traction"])
def test_a_load_on_a_clamped_face_of_a_body_is_refused_by_every_solver(name) -> None:
    message = r'effects\[1\].on: got .* on "z0", which is prescribed exactly, .* want a part that is free along an axis'
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
    with pytest.raises(fr.InputError, match='"half", which is prescribed exactly'):
        check(replace(body(FIXED, on="half"), mesh=mesh), "P1")
    # The half alone is clamped: the other facet of the face deforms.
    check(replace(body(replace(FIXED, on="half")), mesh=mesh), "P1")


def test_springs_and_other_faces_are_loaded() -> None:
    check(body(replace(FIXED, stiffness=1.0)), "P1")
    check(body(FIXED, on="z1"), "P1")


def test_a_muscle_changed_in_python_is_refused() -> None:
    bar = shapes.bar((1, 1, 2), (2.0, 3.0, 4.0), {"bottom": None, "top": None}, (LAW,), (0, 1))
    free = replace(bar, effects=(LAW, load("pressure", "free")))
    assert len(np.unique(free.body.mesh.facets["free"])) == 12
    with pytest.raises(fr.InputError, match=r'effects\[1\].on: got .* on "top", which is prescribed exactly'):
        replace(bar, effects=(LAW, load("pressure", "top"))).body  # noqa: B018
