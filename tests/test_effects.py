"""The effect contract: rotating costs nothing, the parameter is felt, the rest state is stress free, units are declared."""

import numpy as np
import pytest

from fem_reference import effects
from fem_reference.effects import Effect, FieldEffect, FieldState, Place, State
from fem_reference.errors import InputError
from fem_reference.records import parse

PARAMETERS = {
    "neo_hooke": {"mu": "10 kPa"},
    "incompressible": {"bulk": "10 MPa"},
}

FIELD_PARAMETERS = {
    "diffusion": {"coefficient": 2.0},
    "advection": {"velocity": [1.0, -3.0]},
    "reaction": {"rate": 0.5},
    "source": {"strength": "x*y", "where": "everywhere"},
}
CHANGED = {"coefficient": 3.0, "velocity": [1.0, 2.0], "rate": 0.0, "strength": "x", "where": "y above average"}
HERE = Place((0.3, 0.7), vars(np), 0.25)
PSI, TEST = FieldState(1.1, (0.2, -0.4), 3.0), FieldState(0.6, (0.9, 0.5))


def state(F: np.ndarray, pressure: float = 0.3) -> State:
    return State(I1=np.trace(F.T @ F), J=np.linalg.det(F), pressure=pressure)


def make(name: str) -> Effect:
    return parse(effects.find(name), PARAMETERS[name], name)


def deformations() -> list[np.ndarray]:
    rng = np.random.default_rng(20)
    return [np.eye(3) + 0.4 * rng.uniform(-1, 1, (3, 3)) for _ in range(20)]


def test_every_effect_is_under_test() -> None:
    assert sorted(PARAMETERS) == effects.names()
    assert sorted(FIELD_PARAMETERS) == effects.names(FieldEffect)


@pytest.mark.parametrize("name", PARAMETERS)
def test_rotating_the_body_costs_nothing(name: str) -> None:
    effect = make(name)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)  # a proper rotation
    for F in deformations():
        assert effect.energy(state(turn @ F)) == pytest.approx(effect.energy(state(F)), rel=1e-12)


@pytest.mark.parametrize("name", PARAMETERS)
def test_rest_state_has_no_energy_and_no_stress(name: str) -> None:
    # Central differences about F = 1, where the pressure is zero; their error is of order step^2 times the modulus.
    effect, step = make(name), 1e-5
    assert effect.energy(state(np.eye(3), 0.0)) == 0
    for i in range(3):
        for j in range(3):
            push = np.zeros((3, 3))
            push[i, j] = step
            slope = (effect.energy(state(np.eye(3) + push, 0.0)) - effect.energy(state(np.eye(3) - push, 0.0))) / (
                2 * step
            )
            assert abs(slope) < 1e-9


@pytest.mark.parametrize("name", PARAMETERS)
def test_every_parameter_is_felt_and_has_a_unit(name: str) -> None:
    effect = make(name)
    F = deformations()[0]
    for key in type(effect).model_fields:
        changed = parse(type(effect), PARAMETERS[name] | {key: "7 MPa"}, name)
        assert changed.energy(state(F)) != effect.energy(state(F))
        with pytest.raises(InputError, match=rf'{name}.{key}: got "1 mm", want a pressure'):
            parse(type(effect), PARAMETERS[name] | {key: "1 mm"}, name)
        with pytest.raises(InputError, match="want more than zero"):
            parse(type(effect), PARAMETERS[name] | {key: "-1 kPa"}, name)


def test_neo_hooke_uniaxial_incompressible() -> None:
    # Closed form: stretch s, sides s^-1/2, energy mu/2 (s^2 + 2/s - 3).
    s = 1.7
    F = np.diag([s, s**-0.5, s**-0.5])
    assert make("neo_hooke").energy(state(F)) == pytest.approx(0.01 / 2 * (s**2 + 2 / s - 3), rel=1e-13)


def test_incompressible_pressure_is_bulk_times_volume_change() -> None:
    # The stationary point of p (J - 1) - p^2 / 2K in p is p = K (J - 1), where the energy is K/2 (J - 1)^2.
    effect, J = make("incompressible"), 1.02
    p = 10 * (J - 1)
    F = np.diag([J, 1, 1])
    energies = [effect.energy(state(F, p + dp)) for dp in (-1e-4, 0.0, 1e-4)]
    assert energies[1] == pytest.approx(10 / 2 * (J - 1) ** 2, rel=1e-12)
    assert energies[1] > max(energies[0], energies[2])


def test_an_effect_without_energy_says_so() -> None:
    with pytest.raises(NotImplementedError, match="Effect has no energy"):
        Effect().energy(state(np.eye(3)))


def test_unknown_effect() -> None:
    with pytest.raises(KeyError, match="magic"):
        effects.find("magic")


def field(name: str, **changes) -> FieldEffect:
    return parse(effects.find(name), FIELD_PARAMETERS[name] | changes, name)


@pytest.mark.parametrize("name", FIELD_PARAMETERS)
def test_weak_forms_are_linear_in_the_test_and_affine_in_the_field(name: str) -> None:
    effect = field(name)

    def mixed(one: FieldState, two: FieldState, share: float) -> FieldState:
        gradient = tuple(share * a + (1 - share) * b for a, b in zip(one.gradient, two.gradient, strict=True))
        values = (share * getattr(one, key) + (1 - share) * getattr(two, key) for key in ("value", "laplacian"))
        value, laplacian = values
        return FieldState(value, gradient, laplacian)

    other, nothing = FieldState(-0.7, (1.5, 0.3), -2.0), FieldState(0.0, (0.0, 0.0), 0.0)
    for share in (0.3, 2.0):
        between = share * effect.weak(PSI, TEST, HERE) + (1 - share) * effect.weak(other, TEST, HERE)
        assert effect.weak(mixed(PSI, other, share), TEST, HERE) == pytest.approx(between, rel=1e-12)
        assert effect.weak(PSI, mixed(TEST, nothing, share), HERE) == pytest.approx(
            share * effect.weak(PSI, TEST, HERE)
        )


@pytest.mark.parametrize("name", FIELD_PARAMETERS)
def test_every_field_parameter_is_felt_and_strict(name: str) -> None:
    for key in FIELD_PARAMETERS[name]:
        changed = field(name, **{key: CHANGED[key]})
        assert changed.weak(PSI, TEST, HERE) != field(name).weak(PSI, TEST, HERE)
        assert changed.strong(PSI, HERE) != field(name).strong(PSI, HERE)
        with pytest.raises(InputError, match=rf"{name}\.{key}: got True"):
            field(name, **{key: True})


def test_field_effects_are_the_terms_of_the_equation() -> None:
    # -k lap psi + v . grad psi + c psi - f, term by term, by hand.
    strong = {name: field(name).strong(PSI, HERE) for name in FIELD_PARAMETERS}
    assert strong == pytest.approx({"diffusion": -6.0, "advection": 1.4, "reaction": 0.55, "source": -0.21})
    # Integrated by parts: k grad psi . grad test; all others times the test.
    assert field("diffusion").weak(PSI, TEST, HERE) == pytest.approx(2 * (0.2 * 0.9 - 0.4 * 0.5))
    for name in ("advection", "reaction", "source"):
        assert field(name).weak(PSI, TEST, HERE) == pytest.approx(0.6 * strong[name])
    upper = field("source", where="y above average")
    assert upper.strong(PSI, HERE) == pytest.approx(0.25 * strong["source"])


def test_a_diffusion_that_is_not_positive() -> None:
    with pytest.raises(InputError, match=r"diffusion\.coefficient: got 0\.0, want greater than 0"):
        field("diffusion", coefficient=0.0)


def test_a_field_effect_without_a_form_says_so() -> None:
    for call in (lambda: FieldEffect().weak(PSI, TEST, HERE), lambda: FieldEffect().strong(PSI, HERE)):
        with pytest.raises(NotImplementedError, match=r"FieldEffect has no (weak|strong) form"):
            call()
