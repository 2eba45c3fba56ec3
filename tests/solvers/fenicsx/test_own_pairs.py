"""A part of a surface in contact with itself: neighbours and what lies through the body do not meet, arms that close do."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from mpi4py import MPI

from fem_reference import effects
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import parse
from fem_reference.geometry.intersections import self_crossings
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Cells, Prescribed, outer_facets
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.overlaps import overlap_at
from fem_reference.problems.paths import Affine
from fem_reference.problems.touching import Touching
from fem_reference.solvers import fenicsx
from fem_reference.solvers.fenicsx import meshes
from fem_reference.solvers.fenicsx.spent import Spent
from fem_reference.solvers.fenicsx.touching import TouchingForces
from fem_reference.studies.hard import blocks
from fem_reference.studies.hard.records import Hard
from fem_reference.verification import parts

ITSELF = Touching("skin", "skin", 0.1, 0.02)


def with_skin(mesh: Cells, without: str = "") -> Cells:
    """The mesh whose region "skin" is all of its surface, or all but another region."""
    facets, _ = outer_facets(mesh)
    own = set(map(tuple, np.sort(mesh.facets[without], axis=1).tolist())) if without else set()
    rest = [facet for facet in facets.tolist() if tuple(sorted(facet)) not in own]
    return replace(mesh, facets=mesh.facets | {"skin": np.array(rest)})


def letter_c(kind, columns: int = 5) -> Cells:
    """A bar of 2 x 0.4 x 0.5 mm with a slit of 0.1 mm in its middle, from its end "tip" up to 0.4 mm from its "back"."""
    whole = shapes.box((columns, 1, 5), (2.0, 0.4, 0.5), kind)
    middles = whole.points[whole.cells].mean(axis=1)
    slit = (middles[:, 0] > 0.4) & (np.abs(middles[:, 2] - 0.25) < 0.05)
    used, cells = np.unique(whole.cells[~slit], return_inverse=True)
    mesh = Cells(whole.points[used], cells.reshape(-1, whole.cells.shape[1]), kind, 1, {})
    facets, _ = outer_facets(mesh)
    middle = mesh.points[facets].mean(axis=1)
    tip = (middle[:, 2] > 0.5 - 1e-9) & (middle[:, 0] > 1.6)
    mesh = replace(mesh, facets={"back": facets[middle[:, 0] < 1e-9], "tip": facets[tip]})
    held = replace(mesh, facets=mesh.facets | {"held": facets[tip | (middle[:, 0] < 1e-9)]})
    return with_skin(held, "held")


def closing(mesh: Cells, law: Touching | None) -> Body:
    """The letter, whose upper tip goes down by 0.4 mm."""
    down = Prescribed("tip", "tip", (2,), Affine(parts.NO_GRADIENT, (0.0, 0.0, -0.4)))
    ends = (*parts.clamped("back"), down)
    return Body(mesh, parts.neo_hooke(0.01, 0.1), ends, (0.0, 0.5, 1.0), touching=(law,) if law else ())


def assembled(mesh: Cells, law: Touching, element: str) -> tuple[TouchingForces, meshes.Displacement]:
    local = meshes.distribute(MPI.COMM_SELF, mesh)
    regions = dict(zip(mesh.facets, meshes.local_facets(local, mesh.facets.values()), strict=True))
    displacement = meshes.Displacement(meshes.unknowns(local, element))
    body = Body(mesh, (), (), (0.0, 1.0), touching=(law,))
    return TouchingForces(body, SimpleNamespace(regions=regions), displacement, Spent()), displacement


@pytest.mark.parametrize("element", ["P2/P1", "Q2/Q1"])
def test_two_parts_as_one_that_touches_itself_have_the_same_forces(element) -> None:
    kind = "tetrahedron" if element[0] == "P" else "hexahedron"
    low, high = shapes.box((2, 2, 1), (1.0, 1.0, 0.5), kind), shapes.box((1, 2, 1), (1.1, 1.2, 0.5), kind)
    mesh = shapes.joined({"low": low, "high": replace(high, points=high.points + [-0.05, -0.1, 0.56])})
    both = np.concatenate([mesh.facets["low_z1"], mesh.facets["high_z0"]])
    mesh = replace(mesh, facets=mesh.facets | {"both": both})
    found = []
    for law in (Touching("low_z1", "high_z0", 2.0, 0.05, 0.3), Touching("both", "both", 2.0, 0.05, 0.3)):
        contact, displacement = assembled(mesh, law, element)
        dofs = displacement.dofs
        contact.unknowns.x.array[dofs] = 0.02 * np.random.default_rng(1).normal(size=dofs.shape)
        upper = displacement.space.tabulate_dof_coordinates()[:, 2] > 0.53
        contact.unknowns.x.array[dofs[upper]] -= [0.0, 0.0, 0.07]
        residual = np.zeros(len(contact.unknowns.x.array))
        contact.add_residual(residual, None)
        found.append((residual, contact.tangent(), contact.scalars()))
    (one, slope, facts), (other, slope_too, others) = found
    assert np.abs(one).sum() > 1e-3
    assert other == pytest.approx(one, abs=1e-15)
    assert abs(slope - slope_too).max() < 1e-12 * abs(slope).max()
    assert others == pytest.approx(facts)


@pytest.mark.slow
def test_at_rest_no_body_feels_itself_however_thin_it_becomes() -> None:
    # A sheet and a block, each squeezed to a tenth in ten steps and sheared so that its sides overhang by 80 degrees; and the
    # letter, whose slit is wider than the smoothing.
    for mesh in (
        shapes.box((4, 4, 1), (1.0, 1.0, 0.05), "hexahedron"),
        shapes.box((3, 3, 3), (1.0, 1.0, 1.0), "tetrahedron"),
    ):
        contact, displacement = assembled(with_skin(mesh), ITSELF, "Q1/P0" if mesh.kind == "hexahedron" else "P1/P1")
        places = displacement.space.tabulate_dof_coordinates()
        squeezed = places * [1.0, 1.0, 0.1] + 0.2 * np.sin(3 * places[:, [2, 2, 0]]) * [1, 1, 0]
        for share in np.linspace(0, 1, 11):
            contact.unknowns.x.array[displacement.dofs] = share * (squeezed - places)
            contact.settle()
            assert contact.scalars()["touching_points"] == 0
    contact, _ = assembled(letter_c("tetrahedron"), ITSELF, "P2/P1")
    assert contact.scalars()["touching_points"] == 0
    contact, _ = assembled(letter_c("tetrahedron"), replace(ITSELF, smoothing=0.11), "P2/P1")
    assert contact.scalars()["touching_points"] > 100


@pytest.mark.parametrize("gap", [0.0, 0.03, 0.06])
def test_what_lies_close_at_rest_presses_as_all_does_once_it_has_come_apart(gap) -> None:
    """The smoothing is 0.05 mm. Deeper points press at once, those that open by 0.01 mm at 0.01 mm less, and those that open
    farther as if they had been apart at rest: k times the depth.
    """
    low, high = (
        shapes.box((2, 2, 1), (1.0, 1.0, 0.5), "hexahedron"),
        shapes.box((1, 1, 1), (0.8, 0.8, 0.5), "hexahedron"),
    )
    mesh = shapes.joined({"low": low, "high": replace(high, points=high.points + [0.1, 0.1, 0.5 + gap])})
    both = np.concatenate([mesh.facets["low_z1"], mesh.facets["high_z0"]])
    law = Touching("both", "both", 1.0, 0.05)
    contact, displacement = assembled(replace(mesh, facets=mesh.facets | {"both": both}), law, "Q1/P0")
    places = displacement.space.tabulate_dof_coordinates()
    upper = displacement.dofs[np.isin(np.round(places[:, 0], 9), [0.1, 0.9])]
    pressures = []
    for opened in (0.0, 0.01, 0.2):
        for height in (opened, -0.1 - gap):  # the gap is then -0.1 mm
            contact.unknowns.x.array[upper] = [0.0, 0.0, height]
            contact.settle() if height == opened else contact.look()
        pressures.append(contact.scalars()["touching_pressure"])
    closed = [0.1 - max(0.05 - gap - up, 0.0) for up in (0.0, 0.01, 0.2)]
    wanted = [law.pressure(np.array([-depth]))[0][0] for depth in closed]
    assert pressures == pytest.approx(wanted, abs=1e-12)


@pytest.mark.slow
def test_arms_that_close_do_not_cross_and_forces_balance(fem_lab) -> None:
    mesh, settings = letter_c("hexahedron"), {"first_step": 0.25, "residual": 1e-10}
    run, crossed = (fem_lab.solve(closing(mesh, law), "Q1/P0", **settings).last for law in (ITSELF, None))
    assert overlap_at(mesh, ITSELF, crossed.points) > 0.01
    assert overlap_at(mesh, ITSELF, run.points) <= 0
    assert run.scalars["touching_points"] > 30
    assert run.forces["tip"] + run.forces["back"] == pytest.approx([0, 0, 0], abs=1e-9)
    moments = run.moments["tip"] + run.moments["back"]
    assert moments == pytest.approx([0, 0, 0], abs=1e-9)
    assert set(run.forces) == {"tip", "back"}  # none on itself in all


@pytest.mark.slow
def test_nothing_goes_through_itself_within_a_step(fem_lab) -> None:
    body = closing(letter_c("hexahedron"), ITSELF)
    down = replace(body.prescribed[-1], path=Affine(parts.NO_GRADIENT, (0.0, 0.0, -1.2)))
    lower = Prescribed("lower", "lower", (2,), Affine(parts.NO_GRADIENT, (0.0, 0.0, 0.0)))
    facets, _ = outer_facets(body.mesh)
    middle = body.mesh.points[facets].mean(axis=1)
    below = facets[(middle[:, 2] < 1e-9) & (middle[:, 0] > 1.6)]
    mesh = with_skin(replace(body.mesh, facets=body.mesh.facets | {"lower": below}), "held")
    body = replace(body, mesh=mesh, prescribed=(*body.prescribed[:-1], down, lower), frames=(0.0, 1.0))
    outcome = fem_lab.solve(body, "Q1/P0", first_step=1.0, smallest_step=0.6, residual=1e-10).outcome
    assert outcome.status != "converged"


def folded() -> MuscleProblem:
    """A strip of 60 x 6 x 4 mm, one end of which is turned over onto the other."""
    over = [{"frame": 0, "angle": "0 deg"}, {"frame": 20, "angle": "200 deg"}]
    turn = {"axis": [0, -1, 0], "centre": "30, 0, 4.5 mm", "keyframes": over}
    table = {
        "title": "a strip",
        "healthy": "it does not cross itself",
        "bound": [{"quantity": "volume", "at_most": 5}],
        "block": {"size": "60, 6, 4 mm", "cells": [10, 1, 1]},
        "hold": [{"face": "x0"}, {"face": "x1", "motion": turn}],
        "frames": {"first": 0, "last": 20, "every": 5},
    }
    acting = (*blocks.MATERIAL, effects.make("touching", stiffness="20 kPa/mm", smoothing="0.2 mm"))
    return blocks.problem(parse(Hard, table | {"name": "strip", "place": "strip", "effect": acting}, "strip"))


@pytest.mark.slow
def test_a_muscle_does_not_cross_itself_in_silence() -> None:
    # Beyond half a turn the ends themselves, which bones hold, go through each other: nothing can prevent it.
    problem, frames = folded(), []
    with pytest.raises(InputError, match="ranks: got 2, want 1, as several muscles and muscles that touch themselves"):
        fenicsx.solve(problem, fenicsx.Settings(ranks=2), frames.append)
    outcome = fenicsx.solve(problem, fenicsx.Settings(first_step=5.0, smallest_step=1.0), frames.append)
    assert [frame.number for frame in frames] == [0, 5, 10, 15]
    assert outcome.status == "diverged"
    free, crossing = replace(problem, effects=blocks.MATERIAL), []
    assert fenicsx.solve(free, fenicsx.Settings(first_step=5.0), crossing.append).status == "converged"
    assert len(self_crossings(problem.surface.moved_to(crossing[-1].surface)))
    assert not len(self_crossings(problem.surface.moved_to(frames[-1].surface)))
