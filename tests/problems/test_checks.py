"""What a body from Python cannot be is refused before it is solved, by argument, what was got and what is wanted."""

import cProfile
import pstats
from dataclasses import replace

import numpy as np
import pytest

import fem_reference as fr
from fem_reference import effects
from fem_reference.geometry.skins import Skin
from fem_reference.problems.body import ByCell
from fem_reference.problems.checks import check, check_agreement
from fem_reference.problems.paths import Affine, Along, Rest
from fem_reference.runs.store import Outcome
from fem_reference.solvers.fenicsx.processes import installed
from fem_reference.solvers.fenicsx.session import Session

ALL, STILL = (0, 1, 2), ((0.0, 0.0, 0.0),) * 3
NAN, INF = float("nan"), float("inf")
MESH = fr.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron")
MIDDLES = MESH.points[MESH.cells].mean(axis=1)
FIXED = fr.Prescribed("bottom", "z0", ALL, Rest())
TOP = fr.Prescribed("top", "z1", ALL, Affine(STILL, (0.0, 0.0, 0.1)))
BODY = fr.Body(MESH, (fr.make_effect("neo_hooke", mu=0.01),), (FIXED, TOP), (0.0, 1.0))
ACTIVE = effects.make(
    "fibre_active",
    stress="10 kPa",
    optimal_stretch=1.0,
    ramp=[{"frame": 0, "amount": 0.0}, {"frame": 1, "amount": 1.0}],
)


def refused(body, message: str) -> None:
    with pytest.raises(fr.InputError, match=message):
        check(body, "P1")
    with pytest.raises(fr.InputError, match=message):
        fr.solve_body(body, element="P1")


def test_the_body_itself_is_one() -> None:
    check(BODY, "P1")
    check(replace(BODY, effects=list(BODY.effects), prescribed=list(BODY.prescribed), frames=[0, 1]), "P1")
    check(replace(BODY, frames=np.array([0.0, 2.5])), "P1")
    refused(None, "body: got NoneType None, want a Body")


@pytest.mark.parametrize(
    ("frames", "message"),
    [
        ((), r"frames: got tuple \(\), want one or more frame numbers"),
        ((0, 2, 1), "frames: got tuple .*, want increasing frame numbers"),
        ((2, 1, 0), "increasing frame numbers"),
        ((0, 1, 1), "increasing frame numbers"),
        ((0, NAN, 1), "want one or more frame numbers"),
        ((0, INF), "want one or more frame numbers"),
        ((0, "1"), "want one or more frame numbers"),
        ((0, True), "want one or more frame numbers"),
        ("01", "frames: got str '01', want one or more frame numbers"),
        (3, "frames: got int 3"),
        (None, "frames: got NoneType None"),
    ],
)
def test_frames_are_numbers_in_order(frames, message) -> None:
    refused(replace(BODY, frames=frames), message)


@pytest.mark.parametrize("components", [(3,), (-1,), (), (0, 0), (1.0,), ("x",), 2, None, (True,), (np.nan,)])
def test_components_are_axes(components) -> None:
    wrong = replace(TOP, components=components)
    refused(replace(BODY, prescribed=(FIXED, wrong)), r"prescribed\.top\.components: got .*, want axes among 0, 1, 2")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": 3}, r"prescribed\.3: name and on: got int 3"),
        ({"name": np.zeros(0)}, r"prescribed\.\[\]: name and on: got "),
        ({"on": None}, r"prescribed\.top: name and on: got .*NoneType None"),
        ({"on": "lid"}, 'on: got "lid", want a region of the body'),
        ({"path": 3}, r"prescribed\.top\.path: got int 3, want a function of points and a frame number"),
        ({"path": lambda points: points}, 'prescribed "top": path at frame 0: got TypeError'),
        (
            {"path": lambda points, _: points[:, 0]},
            r'"top": path at frame 0: got displacements \(4,\) of points \(4, 3\)',
        ),
        ({"path": lambda points, _: points * np.nan}, '"top": path at frame 0: got nan, want finite displacements'),
        ({"path": lambda points, frame: points * (np.inf if frame == 1 else 0)}, '"top": path at frame 1: got '),
        ({"path": lambda *_: "no"}, '"top": path at frame 0: got ValueError'),
        ({"stiffness": -1.0}, r"prescribed\.top\.stiffness: got -1.0, want a stiffness above 0"),
        ({"stiffness": "1 N"}, r"prescribed\.top\.stiffness: got 1 N, want a stiffness above 0"),
        ({"anchor": (0.0, 0.0, 9.0)}, r"prescribed\.top\.anchor: got .*, want None, or springs at points of a skin"),
    ],
)
def test_what_is_prescribed_is_a_path_of_a_region(changes, message) -> None:
    refused(replace(BODY, prescribed=(FIXED, replace(TOP, **changes))), message)


def test_a_tendon_is_not_beside_tension_at_rest() -> None:
    skin = Skin(np.zeros(1, int), MESH.points[:1], np.ones(1))
    tendon = fr.Prescribed("tendon", skin, ALL, Rest(), 1.0, (0.0, 0.0, 9.0))
    check_agreement(replace(BODY, prescribed=(FIXED, tendon)))
    tense = (*BODY.effects, effects.make("in_situ", stretch=1.1))
    with pytest.raises(fr.InputError, match="effects: got a tendon together with in_situ, want only one of these"):
        check_agreement(replace(BODY, effects=tense, prescribed=(FIXED, tendon)))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"kind": "cube"}, r"mesh\.kind: got str 'cube'"),
        ({"degree": 3}, r"mesh\.degree: got int 3"),
        ({"points": MESH.points[:, :2]}, r"mesh\.points: got an array \(8, 2\)"),
        ({"points": MESH.points * np.nan}, r"mesh\.points: got a point that is not finite"),
        ({"points": MESH.points.tolist()}, r"mesh\.points: got list"),
        ({"points": MESH.points * [1, 1, 0]}, r"mesh\.cells\[0\]: got a cell without volume"),
        ({"cells": MESH.cells + 1}, r"mesh\.cells: got index 1 to 8, want indices from 0 to 7"),
        ({"cells": MESH.cells[:, :3]}, r"mesh\.cells: got an array \(6, 3\)"),
        ({"cells": MESH.cells[:0]}, r"mesh\.cells: got none"),
        ({"cells": MESH.cells * 1.0}, r"mesh\.cells: got an array \(6, 4\)"),
        ({"facets": {"z0": np.array([[0, 1, 9]])}}, r"mesh\.facets\['z0'\]: got index 0 to 9"),
        ({"facets": []}, r"mesh\.facets: got list \[\]"),
    ],
)
def test_cells_are_between_points(changes, message) -> None:
    refused(replace(BODY, mesh=replace(MESH, **changes)), message)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mesh": None}, "mesh: got NoneType None, want Cells"),
        ({"effects": None}, "effects: got NoneType None"),
        ({"effects": ("neo_hooke",)}, r"effects\[0\]: got str 'neo_hooke', want Effect records"),
        ({"prescribed": FIXED}, "prescribed: got Prescribed"),
        ({"interval": -1.0}, "interval: got float -1.0, want a time above 0 s, or None"),
        ({"interval": NAN}, "interval: got float nan"),
        ({"fibre": 3}, "fibre: got int 3, want a function, or None"),
        ({"start": 3}, "start: got int 3, want a function, or None"),
        ({"contact": 3}, "contact: got int 3, want a ContactLaw, or None"),
    ],
)
def test_parts_are_what_they_should_be(changes, message) -> None:
    refused(replace(BODY, **changes), message)


@pytest.mark.parametrize(
    ("fibre", "message"),
    [
        (Along((0.0, 0.0, 2.0)), r"fibre: got a direction of length 2 in cell 0, want unit vectors"),
        (Along((0.0, 0.0, 0.0)), "fibre: got a direction of length 0"),
        (Along((NAN, 0.0, 0.0)), "fibre: got a direction of length nan"),
        (ByCell(np.eye(3)[[0, 0, 0, 0, 0, 2]] * np.array([1, 1, 1, 1, 1, 1.01])[:, None]), "of length 1.01 in cell 5"),
        (ByCell(np.eye(3)), "fibre: got IndexError"),
        (lambda *given: given[1][:, 0], r"fibre: got directions \(6,\) at points \(6, 3\)"),
        # As long as they should be in the middles of cells alone.
        (
            lambda _, points: np.eye(3)[[2] * 6] * (1 + np.abs(points - MIDDLES).max(axis=1))[:, None],
            "a direction of len",
        ),
        (lambda _, points: np.where(np.abs(points - MIDDLES) < 1e-9, [0.0, 0, 1], NAN), "a direction of length nan"),
    ],
)
def test_fibres_are_unit_vectors(fibre, message) -> None:
    check(replace(BODY, effects=(*BODY.effects, ACTIVE), fibre=Along((0.0, 0.6, 0.8))), "P1")
    refused(replace(BODY, effects=(*BODY.effects, ACTIVE), fibre=fibre), message)


def test_regions_agree_at_what_they_share() -> None:
    side = fr.Prescribed("side", "x0", ALL, Rest())
    refused(
        replace(BODY, prescribed=(TOP, side)),
        r'prescribed "top" and "side": got displacements 0.05 mm apart at \(0, \S+, 1\) mm at frame 0.5, want the same',
    )
    # Along other axes, by springs, on faces apart, or where both prescribe the same, they do.
    check(replace(BODY, prescribed=(TOP, replace(side, components=(0,)))), "P1")
    check(replace(BODY, prescribed=(TOP, replace(side, stiffness=1.0))), "P1")
    shear = Affine(((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.1)))
    check(replace(BODY, prescribed=(TOP, replace(side, path=shear))), "P1")
    # In the middle of a common edge alone: quadratic elements have a node there.
    bump = fr.Prescribed("side", "x0", ALL, lambda points, _: 0.1 * points[:, 1:2] * (1 - points[:, 1:2]) * (1, 0, 0))
    refused(replace(BODY, prescribed=(FIXED, bump)), r"0.025 mm apart at \(0, 0.5, 0\) mm")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (((0, 1, 1), (1.0, 1.0, 1.0), "tetrahedron"), "counts: got"),
        (((1, 1), (1.0, 1.0, 1.0), "tetrahedron"), "counts: got"),
        (((1.5, 1, 1), (1.0, 1.0, 1.0), "tetrahedron"), "counts: got"),
        (((10**4, 10**4, 10**4), (1.0, 1.0, 1.0), "tetrahedron"), "counts: got .* at most .* cells"),
        ((3, (1.0, 1.0, 1.0), "tetrahedron"), "counts: got int 3"),
        (((1, 1, 1), (1.0, 0.0, 1.0), "tetrahedron"), "size: got"),
        (((1, 1, 1), (1.0, NAN, 1.0), "tetrahedron"), "size: got"),
        (((1, 1, 1), 10.0, "tetrahedron"), "size: got float 10"),
        (((1, 1, 1), ((), 1.0, 1.0), "tetrahedron"), r"size: got tuple \(\(\), 1.0, 1.0\)"),
        (((1, 1, 1), np.array(3.0), "tetrahedron"), r"size: got an array \(\)"),
        (
            ((1, 1, 1), (1e-5, 1.0, 1e4), "tetrahedron"),
            "size: got .*, want edges whose lengths differ by a factor of less than",
        ),
        (((1, 1, 1), (1.0, 1.0, 1.0), "P2"), "kind: got str 'P2'"),
        (((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron", 3), "degree: got int 3"),
    ],
)
def test_boxes_have_cells_and_edges(given, message) -> None:
    with pytest.raises(fr.InputError, match=message):
        fr.box(*given)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"path": lambda points, _: 1j * points}, "path at frame 0: got TypeError: complex numbers"),
        ({"path": lambda points, _: 0 * points + 1, "stiffness": 1.0}, "path at frame 0: got displacements up to 1 mm"),
        ({"path": lambda points, _: 0 * points + 1}, "path at frame 0: got displacements up to 1 mm"),
    ],
)
def test_a_path_is_real_and_begins_at_rest(changes, message) -> None:
    with pytest.raises(fr.InputError, match=message):
        fr.solve_body(replace(BODY, prescribed=(replace(TOP, **changes),)), element="P1")


def test_bones_and_a_start_are_what_they_should_be() -> None:
    refused(replace(BODY, bones=(3,)), r"bones\[0\]: got int 3, want ContactBone records")
    refused(replace(BODY, start=lambda points: points * NAN), "start: got positions .*, not all finite")
    refused(replace(BODY, start=lambda _: np.zeros(3)), r"start: got positions \(3,\)")


@pytest.mark.skipif(not installed(), reason="FEniCSx is not installed")
def test_each_check_of_a_body_runs_once(monkeypatch) -> None:
    monkeypatch.setattr(Session, "run", lambda *_: Outcome("diverged", "nothing was solved"))
    with cProfile.Profile() as profile:
        fr.solve_body(BODY, element="P1")
    calls = {name: entry[1] for (_, _, name), entry in pstats.Stats(profile).stats.items()}  # type: ignore[attr-defined]
    once = "check check_frames check_element check_quadrature check_agreement _check_start require_installed"
    assert {name: calls.get(name, 0) for name in once.split()} == dict.fromkeys(once.split(), 1)


def test_quadrature_suits_the_element() -> None:
    body = replace(BODY, effects=(*BODY.effects, fr.make_effect("incompressible", bulk=1.0)))
    check(body, "P1/P1", 2)
    check(body, "P2/P1", 1)
    with pytest.raises(fr.InputError, match="quadrature_degree: got 1, want 2 or more for P1/P1"):
        check(body, "P1/P1", 1)
