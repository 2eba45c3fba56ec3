"""Bodies joined to one: each keeps its own effects, also where two are at the same place, and their order does not matter."""

from dataclasses import replace

import numpy as np
import pytest

from fem_reference.effects import make
from fem_reference.foundations.errors import InputError
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.joining import join
from fem_reference.problems.paths import Affine
from fem_reference.problems.touching import Touching
from fem_reference.verification import parts

PATH = -0.02


def block(mu: float, *, high: bool = False, shift: float = 0.0, counts=(1, 1, 1)) -> Body:
    """A cube of 1 mm between mirrors, clamped below or, if ``high``, pressed down at its top; other faces are free to slide."""
    mesh = shapes.box(counts, (1.0, 1.0, 1.0), "tetrahedron")
    mesh = replace(mesh, points=mesh.points + [0, 0, shift])
    sides = [one for axis, name in enumerate(("x0", "y0")) for one in parts.clamped(name, components=(axis,))]
    down = Prescribed("top", "z1", (2,), Affine(parts.NO_GRADIENT, (0.0, 0.0, PATH)))
    ends = [down] if high else list(parts.clamped("z0", components=(2,)))
    effects = (make("neo_hooke", mu=mu), make("incompressible_penalty", bulk=0.1))
    return Body(mesh, effects, (*sides, *ends), (0.0, 1.0))


def pressed(mu: float) -> Body:
    """A cube that is clamped below and pressed at its top."""
    return replace(block(mu), prescribed=(*block(mu).prescribed, block(mu, high=True).prescribed[-1]))


def test_effects_that_differ_act_in_the_cells_of_their_body_alone() -> None:
    both = join({"one": pressed(0.01), "other": pressed(0.02)})
    assert [(effect.title, effect.region) for effect in both.effects] == [
        ("NeoHooke in one", "one"),
        ("IncompressiblePenalty", ""),
        ("NeoHooke in other", "other"),
    ]
    middles, cells = both.mesh.points[both.mesh.cells].mean(axis=1), np.arange(12)
    shares = both.shares(middles, cells)  # both are at the same place
    assert shares["one"].tolist() == [1.0] * 6 + [0.0] * 6
    assert shares["other"].tolist() == [0.0] * 6 + [1.0] * 6
    assert {entry.name for entry in both.prescribed} >= {"one top", "other top"}
    with pytest.raises(InputError, match=r"unknowns that differ \(one: none; other: pressure\)"):
        join({"one": pressed(0.01), "other": replace(pressed(0.02), effects=parts.neo_hooke(0.02, 0.1))})


@pytest.mark.slow
def test_two_bodies_at_one_place_are_as_each_alone_in_any_order(fem_lab) -> None:
    bodies = {"soft": pressed(0.01), "stiff": pressed(0.03)}
    alone = {name: fem_lab.solve(body, "P2").last.forces["top"] for name, body in bodies.items()}
    assert alone["stiff"][2] / alone["soft"][2] > 2  # what a mix-up would show
    for order in (bodies, dict(reversed(bodies.items()))):
        forces = fem_lab.solve(join(order), "P2").last.forces
        for name, force in alone.items():
            assert forces[f"{name} top"] == pytest.approx(force, rel=1e-7, abs=1e-12)  # the residual of Newton's method


@pytest.mark.slow
def test_two_halves_that_touch_are_as_one_body(fem_lab) -> None:
    whole = shapes.box((1, 1, 2), (1.0, 1.0, 2.0), "tetrahedron")
    one = replace(pressed(0.01), mesh=whole)
    law = Touching("low z1", "high z0", 20.0, 1e-4)
    halves = join({"low": block(0.01), "high": block(0.01, high=True, shift=1.0, counts=(2, 1, 1))}, (law,))
    found, known = (fem_lab.solve(body, "P2", first_step=0.5, residual=1e-12).last for body in (halves, one))
    # Young's modulus 0.029 MPa over 2 mm, in series with 20 MPa/mm; the smoothing is a two hundredth of the path.
    assert found.forces["high top"][2] == pytest.approx(known.forces["top"][2], rel=0.01)
    assert found.forces["low z1 on high z0"] == pytest.approx(-found.forces["high z0 on low z1"], abs=1e-12)
    assert found.forces["low z1 on high z0"][2] == pytest.approx(-found.forces["high top"][2], rel=1e-7)


@pytest.mark.slow
def test_an_overlap_at_rest_is_removed_before_the_first_frame(fem_lab) -> None:
    law = Touching("low z1", "high z0", 20.0, 1e-3, relaxed=(-10.0, 0.0))
    low, high = block(0.01), block(0.01, high=True, shift=0.95, counts=(2, 1, 1))
    with pytest.raises(ArithmeticError, match=r"overlap by 0\.05 mm"):
        _ = fem_lab.solve(join({"low": low, "high": high}, (replace(law, relaxed=None),)), "P2").last
    body = join({"low": low, "high": high}, (law,))
    assert body.frames == (-10.0, 0.0, 1.0)
    assert body.first == 0.0
    run = fem_lab.solve(body, "P2", first_step=0.5)
    forces = [abs(state.forces["low z1 on high z0"][2]) for state in run.states]
    # Nothing at first; then two cubes as one of 1.95 mm in 2 mm, which the path adds to.
    assert forces[0] == pytest.approx(0, abs=1e-9)
    assert forces[1] / forces[2] == pytest.approx(0.05 / 0.07, rel=0.03)
    assert max(state.scalars["touching_depth"] for state in run.states[1:]) < 2e-3  # pressure over stiffness
