"""What effects do: stress is the slope of the energy and follows the law as published; loads, ramps and prestrain."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from acting import (
    ALONG,
    ELASTIC,
    FIBRE,
    PARAMETERS,
    RAMPED,
    SLACK,
    TURN,
    deformations,
    make,
    outcome,
    slope,
    state,
    uniaxial,
)
from scipy.spatial.transform import Rotation
from scipy.special import expi

from fem_reference.effects import State, in_situ, total_energy

# The laws: dW/dl of F = diag(l, l^-1/2, l^-1/2) with the fibre along x, written out from the papers. Central differences with a
# step of 1e-5 err by 1e-10 of the third derivative, which is below 1e4 times the slope here.


def blemker_passive(l: float) -> float:  # noqa: E741
    l = l / 1.1  # noqa: E741
    p3 = 0.05 * 6.6 * np.exp(6.6 * 0.4)
    p4 = 0.05 * (np.exp(6.6 * 0.4) - 1) - p3 * 1.4
    f = 0.0 if l <= 1 else 0.05 * (np.exp(6.6 * (l - 1)) - 1) if l <= 1.4 else p3 * l + p4
    return 0.3 / 1.1 * f


def febio_passive(l: float) -> float:  # noqa: E741
    c6 = 0.01 * (np.exp(12 * 0.3) - 1) - 3 * 1.3
    return (0.0 if l <= 1 else 0.01 * (np.exp(12 * (l - 1)) - 1) if l <= 1.3 else 3 * l + c6) / l


def blemker_active(l: float) -> float:  # noqa: E741
    l = l / 1.1  # noqa: E741
    if not 0.4 < l < 1.6:
        return 0.0
    g = 9 * (l - 0.4) ** 2 if l <= 0.6 else 1 - 4 * (1 - l) ** 2 if l < 1.4 else 9 * (l - 1.6) ** 2
    return 0.3 / 1.1 * g


def guccione(l: float) -> float:  # noqa: E741
    Eff, Ess = (l**2 - 1) / 2, (1 / l - 1) / 2
    Q = 8 * Eff**2 + 2 * 2 * Ess**2
    return 0.002 / 2 * np.exp(Q) * (2 * 8 * Eff * l - 4 * 2 * Ess / (2 * l**2))


def holzapfel(l: float) -> float:  # noqa: E741
    cosine, sine = 0.75, 0.25  # squared, of 30 degrees
    square, rate = cosine * l**2 + sine / l, 2 * cosine * l - sine / l**2
    return 2 * 0.02 * (square - 1) * np.exp(1.5 * (square - 1) ** 2) * rate if square > 1 else 0.0


def collagen(l: float) -> float:  # noqa: E741
    square, rate = 1 / l, -1 / l**2  # of all directions across alike; eight of them are half a root of 1e-13 apart
    return 2 * 0.02 / 2 * (square - 1) * np.exp(1.5 * (square - 1) ** 2) * rate if square > 1 else 0.0


def st_venant(l: float) -> float:  # noqa: E741
    along, across = (l**2 - 1) / 2, (1 / l - 1) / 2
    return 2 * 0.01 * (along * l - across / l**2) + 0.09 * (along + 2 * across) * (l - 1 / l**2)


LAWS: dict[str, Callable[[float], float]] = {
    "neo_hooke": lambda s: 0.01 * (s - s**-2),
    "mooney_rivlin": lambda s: 2 * (s - s**-2) * (0.01 + 0.004 / s),
    "fibre_passive": blemker_passive,
    "fibre_passive_febio": febio_passive,
    "fibre_active": blemker_active,
    "active_tension": lambda s: 0.06 * s,
    "holzapfel_ogden": holzapfel,
    "guccione": guccione,
    "collagen_across": collagen,
    "st_venant_kirchhoff": st_venant,
    "stable_neo_hooke": lambda s: 0.01 * (s - s**-2),
    "corotated": lambda s: 0.02 * (s - 1 - s**-2 + s**-1.5),
    "squared_invariants": lambda s: 0.02 * (s**2 + 2 / s - 3) * (s - s**-2),
}
STRETCHES = (0.3, 0.5, 0.7, 0.9, 1.05, 1.2, 1.37, 1.5, 1.6, 1.7, 1.8)


def test_every_law_is_written_out() -> None:
    assert {*LAWS, "incompressible", "incompressible_penalty"} == set(ELASTIC)


@pytest.mark.parametrize("name", LAWS)
def test_stress_is_the_slope_of_the_energy(name: str) -> None:
    effect, law = make(name), LAWS[name]
    for stretch in STRETCHES:
        assert slope(effect, stretch) == pytest.approx(law(stretch), rel=1e-6, abs=1e-10)


@pytest.mark.parametrize(
    ("name", "joints"),
    [("fibre_passive", (1.1, 1.54)), ("fibre_passive_febio", (1.0, 1.3)), ("fibre_active", (0.44, 0.66, 1.54, 1.76))],
)
def test_laws_are_continuous_where_their_pieces_meet(name: str, joints: tuple[float, ...]) -> None:
    # Slopes 4e-5 apart differ by that much of the second derivative, which is below 5 MPa.
    for joint in joints:
        effect = make(name)
        assert slope(effect, joint + 2e-5) == pytest.approx(slope(effect, joint - 2e-5), abs=2e-4)


def test_the_passive_line_goes_on_without_a_kink() -> None:
    # Blemker's f' is continuous at linear_from: equal second differences on both sides, to the order of the step.
    effect = make("fibre_passive")
    below, above = ((slope(effect, at + 1e-3) - slope(effect, at)) / 1e-3 for at in (1.54 - 1.1e-3, 1.54 + 1e-4))
    assert below == pytest.approx(above, rel=0.01)


@pytest.mark.parametrize("name", SLACK)
def test_compressed_fibres_carry_nothing(name: str) -> None:
    effect = make(name)
    for stretch in (0.2, 0.5, 0.99):
        # Wide enough that a fibre at an angle is slack as well.
        assert effect.energy(state(np.diag([stretch, 1, 1]) * 2.0, fibre=ALONG)) == 0


def test_activated_fibres_pull_at_every_length_that_has_overlap() -> None:
    effect = make("fibre_active")
    assert all(slope(effect, 1.1 * stretch) > 0 for stretch in np.linspace(0.41, 1.59, 60))
    assert slope(effect, 1.1 * 0.39) == slope(effect, 1.1 * 1.61) == 0
    assert slope(effect, 1.1) == pytest.approx(0.3 / 1.1, rel=1e-8)  # the peak, at optimal length


@pytest.mark.parametrize("name", ["fibre_active", "active_tension", "gravity"])
def test_energies_are_in_proportion_to_the_amount(name: str) -> None:
    effect, F = make(name), deformations()[3]
    one = effect.energy(state(F))
    assert one != 0
    assert [effect.energy(state(F, amount=a)) for a in (0.0, 0.25)] == pytest.approx([0.0, 0.25 * one], rel=1e-14)


@pytest.mark.parametrize(("c4", "linear_from"), [(61.44, 1.06), (60.0, 1.1), (12.0, 1.5), (6.0, 2.0), (1.0, 1.4)])
def test_the_toe_of_febio_is_integrated_to_twelve_digits(c4: float, linear_from: float) -> None:
    # The integral of (exp(c4 (x - 1)) - 1) / x is exp(-c4) Ei(c4 x) - log(x); Ei itself has rounding of 3e-14 here.
    effect = make("fibre_passive_febio", c3="1 MPa", c4=c4, linear_from=linear_from)
    for stretch in np.linspace(1, linear_from, 12):
        exact = np.exp(-c4) * (expi(c4 * stretch) - expi(c4)) - np.log(stretch)
        assert effect.energy(state(uniaxial(stretch), fibre=ALONG)) == pytest.approx(exact, abs=1e-12)


@pytest.mark.parametrize(
    "name",
    [
        "fibre_passive",
        "fibre_passive_febio",
        "fibre_active",
        "active_tension",
        "holzapfel_ogden",
        "guccione",
        "collagen_across",
    ],
)
def test_fibre_laws_are_blind_to_volume(name: str) -> None:
    effect, F = make(name), uniaxial(1.3)
    assert effect.energy(state(1.1 * F, fibre=ALONG)) == pytest.approx(effect.energy(state(F, fibre=ALONG)), rel=1e-12)


def test_guccione_in_axes_of_its_own() -> None:
    # E in the axes f, s, n, whichever s and n are.
    effect = make("guccione")
    for spin in (0.0, 1.0):
        axes = np.linalg.qr(np.column_stack([FIBRE, [np.cos(spin), np.sin(spin), 0.3], [0.1, 0.2, 1.0]]))[0]
        for F in deformations():
            E = axes.T @ (np.linalg.det(F) ** (-2 / 3) * F.T @ F - np.eye(3)) @ axes / 2
            Q = 8 * E[0, 0] ** 2 + 2 * (E[1, 1] ** 2 + E[2, 2] ** 2 + 2 * E[1, 2] ** 2)
            Q += 2 * 4 * (E[0, 1] ** 2 + E[0, 2] ** 2)
            assert effect.energy(state(F)) == pytest.approx(0.001 * (np.exp(Q) - 1), rel=1e-11)


def test_holzapfel_families_are_the_fibre_turned_about_the_normal() -> None:
    normal = np.array([0.2, 0.5, 2.0])
    normal -= (normal @ FIBRE) * FIBRE
    normal /= np.linalg.norm(normal)
    for F in deformations():
        energy = 0.0
        for angle in (np.pi / 6, -np.pi / 6):
            family = Rotation.from_rotvec(angle * normal).apply(FIBRE)
            square = np.linalg.det(F) ** (-2 / 3) * np.sum((F @ family) ** 2)
            energy += 0.02 / 3 * (np.exp(1.5 * max(square - 1, 0) ** 2) - 1)
        assert make("holzapfel_ogden").energy(state(F)) == pytest.approx(energy, rel=1e-11, abs=1e-17)


def test_collagen_is_the_mean_over_the_directions_across_the_fibre() -> None:
    """Of 3600 directions. The energy of each has a jump in its second derivative where it goes slack, so that eight err by some
    1/8^3 of it.
    """
    first = np.cross(FIBRE, [1.0, 0.0, 0.0]) / np.linalg.norm(np.cross(FIBRE, [1.0, 0.0, 0.0]))
    angles = np.linspace(0, np.pi, 3600, endpoint=False)[:, None]
    directions = np.cos(angles) * first + np.sin(angles) * np.cross(FIBRE, first)
    for F in deformations():
        squares = np.linalg.det(F) ** (-2 / 3) * np.sum((directions @ F.T) ** 2, axis=1)
        energies = 0.02 / 3 * (np.exp(1.5 * np.maximum(squares - 1, 0) ** 2) - 1)
        assert make("collagen_across").energy(state(F)) == pytest.approx(energies.mean(), rel=0.05, abs=1e-6)


def test_incompressible_pressure_is_bulk_times_volume_change() -> None:
    # The stationary point of p (J - 1) - p^2 / 2K in p is p = K (J - 1), where the energy is K/2 (J - 1)^2, that of the penalty.
    effect, J = make("incompressible"), 1.02
    p = 10 * (J - 1)
    F = np.diag([J, 1, 1])
    energies = [effect.energy(state(F, p + dp)) for dp in (-1e-4, 0.0, 1e-4)]
    assert energies[1] == pytest.approx(10 / 2 * (J - 1) ** 2, rel=1e-12)
    assert energies[1] > max(energies[0], energies[2])
    assert make("incompressible_penalty").energy(state(F)) == pytest.approx(energies[1], rel=1e-12)


# Loads, ramps, prestrain


def test_damping_is_a_drag_against_the_displacement_of_a_step() -> None:
    # Minus the slope in the displacement is the force: coefficient times displacement over time, against (0.1, -0.3, 0) mm.
    effect, at, slopes = make("damping"), state(np.eye(3)), []
    for change in 1e-3 * np.eye(3):
        ends = (replace(at, displacement=np.array(at.displacement) + sign * change) for sign in (1, -1))
        after, before = (effect.energy(end) for end in ends)
        slopes.append((before - after) / 2e-3)
    assert slopes == pytest.approx(
        [-2e-6 * 4 * 0.1, 2e-6 * 4 * 0.3, 0], rel=1e-9, abs=1e-18
    )  # exact for a square but for rounding
    assert effect.energy(replace(at, rate=0.0)) == 0
    assert (effect.stored, make("gravity").stored) == (False, True)


def test_gravity_is_weight_times_height() -> None:
    # 1.06e-9 tonne/mm3 times 9810 mm/s2, raised by 0.5 mm; it does not see the shape.
    for F in deformations():
        assert make("gravity").energy(state(F)) == pytest.approx(1.06e-9 * 9810 * 0.5, rel=1e-14)
    assert make("gravity").energy(State(F=np.eye(3), displacement=(0, 0, -1))) < 0


def test_a_pressure_turns_with_the_body_and_a_traction_does_not() -> None:
    normal = np.array([0.6, 0.0, 0.8])
    for F in deformations():
        before, after = (make("pressure").traction(state(G), normal) for G in (F, TURN @ F))
        assert after == pytest.approx(TURN @ before, rel=1e-12, abs=1e-17)
        assert make("traction").traction(state(F), normal) == pytest.approx([0.0, 0.00625, 0.001], rel=1e-14)


@pytest.mark.parametrize("name", ["pressure", "traction"])
def test_loads_are_in_proportion_to_the_amount(name: str) -> None:
    one, half = (np.array(outcome(make(name), state(deformations()[0], amount=amount))) for amount in (1.0, 0.5))
    assert half == pytest.approx(one / 2, rel=1e-14)


def test_a_pressure_around_a_cube_has_no_resultant_and_works_on_its_volume() -> None:
    # On a unit cube at rest about the origin the face with normal N has its centre at N/2, and moves by dF N/2.
    effect, normals = make("pressure"), [*np.eye(3), *-np.eye(3)]
    for F in deformations():
        tractions = [np.array(effect.traction(state(F), normal)) for normal in normals]
        assert sum(tractions) == pytest.approx(np.zeros(3), abs=1e-17)
        dF = 1e-6 * TURN
        work = sum(t @ (dF @ normal) / 2 for t, normal in zip(tractions, normals, strict=True))
        dV = (np.linalg.det(F + dF) - np.linalg.det(F - dF)) / 2
        assert work == pytest.approx(-0.008 * dV, rel=1e-6)


def test_a_membrane_is_a_sheet_in_plane_stress_and_turns_with_the_body() -> None:
    """Whatever the stretch along its normal. A strip that is free across has ``h mu/2 (l^2 + 2/l - 3)``, as a bar."""
    membrane, normal = make("membrane"), np.array([2.0, -1.0, 2.0]) / 3
    along, across = np.array([1.0, 2.0, 0.0]) / np.sqrt(5), np.cross(normal, [1.0, 2.0, 0.0]) / np.sqrt(5)
    for stretch, thick in ((1.3, 0.5), (0.8, 2.0)):
        F = (
            stretch * np.outer(along, along)
            + stretch**-0.5 * np.outer(across, across)
            + thick * np.outer(normal, normal)
        )
        F += 0.4 * np.outer(along, normal)  # sheared below the sheet
        wanted = 0.5 * 10 / 2 * (stretch**2 + 2 / stretch - 3)
        assert membrane.potential(State(F=F), normal) == pytest.approx(wanted, rel=1e-12)
        assert membrane.potential(State(F=TURN @ F), normal) == pytest.approx(wanted, rel=1e-12)
    assert membrane.potential(State(F=np.eye(3)), normal) == pytest.approx(0, abs=1e-14)
    half = make("membrane", **{"in": "fascia"})
    assert half.potential(State(F=F, regions={"fascia": 0.5}), normal) == pytest.approx(wanted / 2, rel=1e-12)
    assert (membrane.title, half.title) == ("Membrane on top", "Membrane on top in fascia")


@pytest.mark.parametrize("name", RAMPED)
def test_ramps_are_linear_between_knots_and_constant_beyond(name: str) -> None:
    amounts = [make(name).amount(frame) for frame in (-5, 0, 2.5, 10, 20, 30, 99)]
    assert amounts == pytest.approx([0, 0, 0.25, 1, 0.75, 0.5, 0.5], rel=1e-14)
    assert make(name, ramp=[{"frame": 7, "amount": 0.4}]).amount(0) == 0.4


@pytest.mark.parametrize("name", [name for name in PARAMETERS if name not in RAMPED])
def test_what_has_no_ramp_acts_wholly(name: str) -> None:
    assert make(name).amount(3.0) == 1.0


def test_prestretch_keeps_the_volume_and_turns_with_the_body() -> None:
    effect = make("prestretch")
    for F in deformations():
        elastic = np.array(effect.elastic(state(F)))
        assert np.linalg.det(elastic) == pytest.approx(np.linalg.det(F), rel=1e-13)
        assert elastic @ FIBRE == pytest.approx(1.1 * F @ FIBRE, rel=1e-13)
        assert np.array(effect.elastic(state(TURN @ F))) == pytest.approx(TURN @ elastic, rel=1e-12, abs=1e-15)
        assert np.array(effect.elastic(state(F, amount=0.0))) == pytest.approx(F, rel=1e-14)


def test_energies_see_what_prestretch_leaves_wherever_it_stands() -> None:
    # A neo-Hookean body at rest is stretched by 1 + amount (1.1 - 1), whose energy is mu/2 (s^2 + 2/s - 3).
    prestretch, matrix = make("prestretch"), make("neo_hooke")
    for amount, stretch in ((1.0, 1.1), (0.5, 1.05)):
        for acting in ([(prestretch, amount), (matrix, 1.0)], [(matrix, 1.0), (prestretch, amount)]):
            energy = total_energy(acting, state(np.eye(3)))
            assert energy == pytest.approx(0.01 / 2 * (stretch**2 + 2 / stretch - 3), rel=1e-12)
    undone = np.linalg.inv(np.array(prestretch.elastic(state(np.eye(3)))))
    assert total_energy([(prestretch, 1.0), (matrix, 1.0)], state(undone)) == pytest.approx(0, abs=1e-17)


def test_the_total_energy_is_the_sum_with_each_amount_and_no_load() -> None:
    acting = [(make("neo_hooke"), 1.0), (make("fibre_active"), 0.3), (make("gravity"), 0.7), (make("pressure"), 1.0)]
    F = deformations()[1]
    parts = [effect.energy(state(F, amount=amount)) for effect, amount in acting[:3]]
    assert total_energy(acting, state(F)) == pytest.approx(sum(parts), rel=1e-14)


def test_a_stress_at_rest_is_the_one_wanted_and_turns_with_the_body() -> None:
    """``2 mu dev(e) + p0`` at F = 1, by central differences; its energy there is none, and is the same after a rotation."""
    rng = np.random.default_rng(3)
    slopes, mu, pressure, step = rng.uniform(-1, 1, (3, 3)), 0.3, 0.7, 1e-6

    def energy(F: np.ndarray) -> float:
        return float(in_situ.balancing(State(F), slopes, pressure, mu))

    strain = (slopes + slopes.T) / 2
    wanted = 2 * mu * (strain - np.trace(strain) / 3 * np.eye(3)) + pressure * np.eye(3)
    changes = step * np.eye(9).reshape(3, 3, 3, 3)
    found = [[(energy(np.eye(3) + h) - energy(np.eye(3) - h)) / (2 * step) for h in row] for row in changes]
    assert np.array(found) == pytest.approx(wanted, abs=1e-9)
    assert energy(np.eye(3)) == pytest.approx(0, abs=1e-15)
    for F in deformations():
        assert energy(TURN @ F) == pytest.approx(energy(F), abs=1e-14)


def test_the_isotropic_body_of_a_stress_at_rest_has_a_bulk_modulus() -> None:
    assert in_situ.moduli_of((make("neo_hooke"), make("incompressible"))) == pytest.approx((0.01, 10))
    assert in_situ.moduli_of((make("neo_hooke"),)) == pytest.approx((0.01, 0.1))


def test_a_bone_that_may_support_at_rest_has_a_stress_though_it_is_never_reached() -> None:
    """Of the stiffness, 0.5 MPa/mm, times the depth below the distance at which it is felt."""
    scene = SimpleNamespace(near={"femur": SimpleNamespace(gap=2.0, depth=0.0, frame=0.0)})
    found = [make("contact", **support).indicator(scene) for support in ({}, {"support": "3 mm"})]
    assert [one.stress for one in found] == pytest.approx([0.0, 0.5 * (3.0 + 0.3 - 2.0)])


def test_corotated_stretches_are_those_of_the_polar_decomposition() -> None:
    # Four Newton steps leave 4e-11 of the sum of the stretches.
    generator = np.random.default_rng(5)
    for _ in range(200):
        U, V = (Rotation.random(rng=generator).as_matrix() for _ in range(2))
        stretches = np.exp(generator.uniform(np.log(0.3), np.log(3), 3))
        F = U @ np.diag(stretches) @ V.T
        want = 0.01 * np.sum((F - U @ V.T) ** 2) + 0.045 * (np.prod(stretches) - 1) ** 2
        assert make("corotated").energy(State(F)) == pytest.approx(want, rel=1e-9, abs=1e-11)
