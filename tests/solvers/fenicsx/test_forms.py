"""What does not act yet is not in the equations, and what is solved is the same: contact without pressure, activation of zero."""

import numpy as np
import pytest
from tense import in_situ, muscle

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from fem_reference.effects import make
from fem_reference.geometry.rigid_bodies import Box
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, ByCell
from fem_reference.problems.contact import ContactBone, ContactLaw
from fem_reference.solvers.fenicsx import BodySettings
from fem_reference.solvers.fenicsx.body import AssembledBody
from fem_reference.solvers.fenicsx.contact import ContactForces
from fem_reference.verification import parts

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore:(cmap|dofmap) is deprecated")]

FRAMES = (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)


def down_and_up(frame: float) -> np.ndarray:
    """0.1 mm a frame, there and back."""
    pose = np.eye(4)
    pose[2, 3] = -0.1 * min(frame, 6 - frame)
    return pose


def solved_states() -> tuple[list[np.ndarray], list[bool]]:
    """A plate comes down on a cube of 1 mm and leaves it: by frame the unknowns, and whether contact was in the equations."""
    plate = ContactBone("plate", Box((0.5, 0.5, 1.25), (4.0, 4.0, 0.2), 0.0), down_and_up)
    law = ContactLaw("z1", 1.0, 0.01)
    mesh = shapes.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron")
    body = Body(mesh, parts.neo_hooke(0.01, 10.0), parts.SYMMETRY, FRAMES, contact=law, bones=(plate,))
    built = AssembledBody(body, BodySettings(element="P2/P1", first_step=1.0, residual=1e-12, reuse=False))
    states, there = [], []
    for frame in FRAMES[1:]:
        assert built.attempt(frame).converged
        states.append(np.array(built.unknowns.x.array))
        there.append(built.system.contact is not None)
    return states, there


def test_until_something_is_pressed_contact_is_not_in_the_equations(monkeypatch: pytest.MonkeyPatch) -> None:
    late, there = solved_states()
    monkeypatch.setattr(ContactForces, "presses", lambda *_: True)
    always, everywhere = solved_states()
    assert there == [False, True, True, True, True, False]  # from 0.15 mm on; at frame 5 it still begins pressed
    assert all(everywhere)
    for one, other in zip(late, always, strict=True):
        assert one == pytest.approx(other, abs=1e-9)
    assert np.abs(late[2]).max() > 0.1
    assert late[0] == pytest.approx(0, abs=1e-12)
    assert late[-1] == pytest.approx(0, abs=1e-12)


def activated(ramp: list[tuple[float, float]] | None) -> tuple[list[np.ndarray], list[object]]:
    """A cube whose fibres pull along x by a ``ramp`` of (frame, amount), or that has no such effect: by frame the unknowns and the
    expressions that were summed.
    """
    effects = parts.neo_hooke(0.01, 10.0)
    if ramp is not None:
        knots = [{"frame": frame, "amount": amount} for frame, amount in ramp]
        effects += (make("active_tension", tension=0.002, ramp=knots),)
    mesh = shapes.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron")
    fibre = ByCell(np.tile([1.0, 0.0, 0.0], (len(mesh.cells), 1)))
    plate = ContactBone("plate", Box((0.5, 0.5, 1.05), (4.0, 4.0, 0.2), 0.0), down_and_up)
    law = ContactLaw("z1", 1.0, 0.01)
    body = Body(mesh, effects, parts.SYMMETRY, FRAMES, fibre, contact=law, bones=(plate,))
    built = AssembledBody(body, BodySettings(element="P2/P1", first_step=1.0, residual=1e-12, reuse=False))
    states, summed = [], []
    for frame in FRAMES[1:]:
        assert built.attempt(frame).converged
        states.append(np.array(built.unknowns.x.array))
        summed.append(built.system.cells.form.derivatives)
    return states, summed


def test_an_activation_that_is_zero_over_frames_is_not_summed_there() -> None:
    late, summed = activated([(0, 0.0), (2, 0.0), (3, 1.0), (4, 0.0)])
    never, _ = activated(None)
    assert summed[0] is summed[1] is summed[4] is summed[5]
    assert summed[2] is not summed[0]
    assert summed[3] is summed[0], "zero from here on"
    for frame in (0, 1, 3, 4, 5):
        assert late[frame] == pytest.approx(never[frame], abs=1e-9)
    assert np.abs(late[2] - never[2]).max() > 1e-3
    _, always = activated([(0, 0.0), (6, 1.0)])
    assert len({id(one) for one in always}) == 1


def test_after_a_failure_the_isotropic_body_is_not_summed() -> None:
    built = AssembledBody(muscle(in_situ(1.0)), BodySettings(element="P2/P1"))
    form = built.system.cells.form
    own = form.derivatives

    def failed() -> None:
        with form.isotropic():
            assert form.derivatives is not own
            raise ArithmeticError("a linear problem that is singular")

    with pytest.raises(ArithmeticError, match="singular"):
        failed()
    assert form.derivatives is own


def test_a_border_on_faces_of_cells_parts_the_cells() -> None:
    """Some of the quadrature points are vertices, on the border: each is in the region that its cell is in. Half of a cube has
    twice the shear modulus, at a shear of its whole: ``mu/2 g^2`` per volume.
    """
    laws = tuple(make("neo_hooke", mu=mu, **{"in": at}) for mu, at in ((0.01, "not half"), (0.02, "half")))
    mesh, half = (
        shapes.box((2, 2, 2), (1.0, 1.0, 1.0), "tetrahedron"),
        {"half": lambda points: 1.0 * (points[:, 2] <= 0.5)},
    )
    body = Body(mesh, laws, (), (0.0, 1.0), regions=half)
    built = AssembledBody(body, BodySettings(element="P2", first_step=1.0))
    built.start(lambda points: points + 0.1 * points[:, [2, 2, 2]] * [1.0, 0.0, 0.0])
    assert built.energy() == pytest.approx((0.01 + 0.02) / 2 * 0.1**2 / 2, rel=1e-12)


def test_the_energy_of_a_membrane_is_that_of_its_part_of_a_face() -> None:
    """A cube stretched to l along x at constant volume; the membrane has a share of y of the face z1: half of its area."""
    sheet, stretch = make("membrane", on="z1", thickness=0.1, mu=2.0, **{"in": "fascia"}), 1.2
    mesh, soft = shapes.box((2, 2, 2), (1.0, 1.0, 1.0), "tetrahedron"), make("neo_hooke", mu=0.01)
    body = Body(mesh, (soft, sheet), (), (0.0, 1.0), regions={"fascia": lambda points: points[:, 1]})
    built = AssembledBody(body, BodySettings(element="P2", first_step=1.0))
    built.start(lambda points: points * [stretch, stretch**-0.5, stretch**-0.5])
    density = (stretch**2 + 2 / stretch - 3) / 2
    assert built.energy() == pytest.approx((0.01 + 0.1 * 2 / 2) * density, rel=1e-12)
    assert built.linear.symmetric  # so that its negative modes are counted
