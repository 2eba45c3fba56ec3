"""The effect contract: rotating costs nothing, parameters are felt and have their units, the rest state is stress free, and
expressions take symbols. What the laws say is in test_effect_laws.py.
"""

import operator
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from acting import (
    ALONG,
    ELASTIC,
    ENERGIES,
    EXPRESSED,
    FIBRE,
    FIELD_PARAMETERS,
    KINDS,
    PARAMETERS,
    RAMP,
    RAMPED,
    TURN,
    deformations,
    is_positive,
    make,
    other,
    outcome,
    state,
    uniaxial,
)

from fem_reference import effects
from fem_reference.effects import Energy, FieldEffect, FieldState, Load, Place, Prestrain, State
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.material_point import NUMPY
from fem_reference.foundations.records import parse

HERE = Place((0.3, 0.7), vars(np), 0.25)
PSI, TEST = FieldState(1.1, (0.2, -0.4), 3.0), FieldState(0.6, (0.9, 0.5))


# The contract


@pytest.mark.parametrize("name", [*PARAMETERS, *FIELD_PARAMETERS])
def test_an_effect_states_an_example_of_all_that_it_needs(name: str) -> None:
    stated, fields = effects.example(name), effects.find(name).model_fields
    assert parse(effects.find(name), stated, name)
    assert {key for key, field in fields.items() if field.is_required()} <= {*stated} <= {*fields}


@pytest.mark.parametrize("name", PARAMETERS)
def test_published_ranges_are_of_parameters_that_can_be_read_and_have_a_source(name: str) -> None:
    for key, one in effects.find(name).published.items():
        low, high = (getattr(make(name, **{key: end}), key) for end in (one.low, one.high))
        assert low < high
        assert re.search(r"\b(19|20)\d\d\b", one.source), "the year of a publication"


@pytest.mark.parametrize("name", ELASTIC)
def test_an_effect_states_its_moduli_at_rest(name: str) -> None:
    """By central differences of its energy: of a shear across the fibres, and of the volume."""
    effect, step = make(name), 1e-4
    stated = effect.moduli()

    def energies(F: Callable[[float], np.ndarray], bulk: float = 0.0) -> list[float]:
        """Beside that at rest; a pressure unknown is K (J - 1)."""
        points = [(F(x), bulk * (np.linalg.det(F(x)) - 1)) for x in (-step, 0, step)]
        found = [float(effect.energy(State(at, pressure=p, fibre=(0, 0, 1.0), amount=0.0))) for at, p in points]
        return [found[0] - found[1], found[2] - found[1]]

    sheared = energies(lambda x: np.eye(3) + x * np.outer([1, 0, 0], [0, 1, 0]))
    slack = min(sheared) == 0  # fibres to one side
    assert stated.shear == pytest.approx(0 if slack else sum(sheared) / step**2, rel=1e-4, abs=1e-6)
    grown = energies(lambda x: (1 + x) ** (1 / 3) * np.eye(3), stated.bulk)
    assert stated.bulk == pytest.approx(sum(grown) / step**2, rel=1e-3, abs=1e-5)
    assert min(stated) >= 0


def test_moduli_of_several_effects_add_up() -> None:
    acting = [make("neo_hooke"), make("mooney_rivlin"), make("incompressible"), make("gravity")]
    assert effects.moduli(acting) == pytest.approx((0.01 + 0.028, 10, 0))


@pytest.mark.parametrize("name", ELASTIC)
def test_rotating_the_body_costs_nothing(name: str) -> None:
    # Exponents up to 30 multiply the rounding of C.
    effect = make(name)
    energies = [effect.energy(state(F)) for F in deformations()]
    assert np.ptp(energies) > 0
    assert [effect.energy(state(TURN @ F)) for F in deformations()] == pytest.approx(energies, rel=1e-11, abs=1e-16)


@pytest.mark.parametrize("name", ENERGIES)
def test_the_rest_state_has_no_energy(name: str) -> None:
    at = State(F=np.eye(3), pressure=0.0, fibre=FIBRE)
    assert make(name).energy(at) == pytest.approx(0, abs=1e-15)


@pytest.mark.parametrize("name", ELASTIC)
def test_the_rest_state_has_no_stress(name: str) -> None:
    # Central differences about F = 1, where the pressure is zero; a law with a kink there errs by step times the modulus, which is
    # of the order of 0.1 MPa. A stress that stayed at rest would be of the order of a parameter, 1e-2 MPa.
    effect, step = make(name), 1e-7
    amount = 0.0 if name in RAMPED else 1.0
    for change in step * np.eye(9).reshape(9, 3, 3):
        after, before = (effect.energy(state(np.eye(3) + sign * change, 0.0, amount=amount)) for sign in (1, -1))
        assert abs(after - before) / (2 * step) < 1e-7


@pytest.mark.parametrize("name", EXPRESSED)
def test_every_parameter_is_felt_and_has_its_unit(name: str) -> None:
    effect, near = make(name), np.eye(3) + 0.05 * deformations()[0]
    both = [uniaxial(stretch) @ near for stretch in (1.6, 0.7)]  # fibres pull in one, what is across them in the other
    for key, _, unit in effect.parameters:
        changed = make(name, **{key: other(type(effect), key, PARAMETERS[name][key])})
        printed = [
            ([np.array(outcome(one, state(F, fibre=ALONG))).tolist() for F in both], one.title, one.amount(5))
            for one in (effect, changed)
        ]
        assert printed[0] != printed[1], key
        if unit:
            with pytest.raises(InputError, match=rf'{name}\.{key}: got "1 s", want .*{KINDS[unit]}'):
                make(name, **{key: "1 s"})
        if is_positive(type(effect), key):
            with pytest.raises(InputError, match="want more than zero"):
                make(name, **{key: "-" + PARAMETERS[name][key]})


@pytest.mark.parametrize(
    ("name", "key", "value", "want"),
    [
        ("fibre_passive", "p1", 0.0, r"p1: got 0\.0, want greater than 0"),
        ("fibre_passive", "p2", -1.0, "p2: got -1.0, want greater than 0"),
        ("fibre_passive", "optimal_stretch", 0.0, "optimal_stretch: got 0.0, want greater than 0"),
        ("fibre_passive", "linear_from", 1.0, "linear_from: got 1.0, want greater than 1"),
        ("fibre_passive_febio", "c4", 0.0, "c4: got 0.0, want greater than 0"),
        ("fibre_passive_febio", "linear_from", 0.9, "linear_from: got 0.9, want greater than 1"),
        ("fibre_active", "optimal_stretch", -1.0, "optimal_stretch: got -1.0, want greater than 0"),
        ("holzapfel_ogden", "k2", 0.0, "k2: got 0.0, want greater than 0"),
        ("holzapfel_ogden", "normal", [0, 0, 0], r"normal: got \[0, 0, 0\], want a normal that is not zero"),
        (
            "holzapfel_ogden",
            "normal",
            [0, 1e10, 0],
            "want a normal that is not zero, with a length from 1e-9 to 1e9",
        ),
        ("guccione", "bf", 0.0, "bf: got 0.0, want greater than 0"),
        ("guccione", "bt", 0.0, "bt: got 0.0, want greater than 0"),
        ("guccione", "bfs", 0.0, "bfs: got 0.0, want greater than 0"),
        ("prestretch", "stretch", 0.0, "stretch: got 0.0, want greater than 0"),
        (
            "prestretch",
            "ramp",
            [{"frame": 0, "amount": -5.0}],
            r"ramp\[0\].amount: got -5.0, want greater than or equal",
        ),
        ("gravity", "ramp", [{"frame": 0, "amount": 1e300}], r"amount: got 1e\+300, want less than or equal to 1000"),
        ("mooney_rivlin", "c2", "-10 kPa", r"want c1 \+ c2 above zero"),
        ("pressure", "ramp", [], r"ramp: got \[\], want .* at least 1 item"),
        (
            "pressure",
            "ramp",
            [*RAMP, {"frame": 30, "amount": 1.0}],
            r"ramp: .*want knots in the order of their frames",
        ),
        ("pressure", "ramp", [{"frame": 0}], r"ramp\[0\]\.amount: got nothing, want this key"),
    ],
)
def test_values_that_mean_nothing_are_refused(name: str, key: str, value: object, want: str) -> None:
    with pytest.raises(InputError, match=want):
        make(name, **{key: value})


def test_a_prestretch_keeps_its_fibres_longer_than_nothing() -> None:
    with pytest.raises(InputError, match=r"want a ramp whose stretches 1 \+ amount"):
        make("prestretch", stretch=0.5, ramp=[{"frame": 0, "amount": 10.0}])


@dataclass(frozen=True)
class Symbol:
    """A number that only operators and ``SymbolFunctions`` can use: it cannot be compared, branched on or made a float."""

    value: float

    def __bool__(self) -> bool:
        raise TypeError("a symbol has no truth value")

    __neg__ = lambda self: Symbol(-self.value)  # noqa: E731


def plain(x: Any) -> Any:
    return x.value if isinstance(x, Symbol) else x


def lifted(function: Callable[..., Any]) -> Callable[..., Symbol]:
    return lambda *arguments: Symbol(function(*map(plain, arguments)))


for _name in ("add", "sub", "mul", "truediv", "pow"):
    _function = getattr(operator, _name)
    setattr(Symbol, f"__{_name}__", lifted(_function))
    setattr(Symbol, f"__r{_name}__", lifted(lambda a, b, function=_function: function(b, a)))


class SymbolFunctions:
    """``Functions`` of symbols and numbers."""

    exp, log, sqrt, cos, sin, above = (
        staticmethod(lifted(getattr(NUMPY, name))) for name in ("exp", "log", "sqrt", "cos", "sin", "above")
    )


def symbols(value: Any) -> Any:
    if isinstance(value, float):
        return Symbol(value)
    return tuple(symbols(entry) for entry in value) if isinstance(value, tuple | list | np.ndarray) else value


@pytest.mark.parametrize("name", EXPRESSED)
def test_expressions_take_symbols(name: str) -> None:
    effect = make(name)
    symbolic = effect.model_copy(update={key: symbols(value) for key, value, _ in effect.parameters if key != "ramp"})
    for F in deformations():
        at = replace(state(F, amount=0.5), F=F.tolist(), fibre=FIBRE.tolist())
        keys = ("F", "displacement", "pressure", "fibre", "amount", "before", "predicted", "F_before", "rate")
        parts = {key: symbols(getattr(at, key)) for key in keys}
        found = outcome(symbolic, State(**parts, functions=SymbolFunctions()))
        got = np.vectorize(lambda entry: float(plain(entry)))(np.array(found, object))
        np.testing.assert_allclose(got, np.array(outcome(effect, at)), rtol=1e-13, atol=1e-18)


def test_invariants_of_a_state() -> None:
    for F in deformations():
        C, J, at = F.T @ F, np.linalg.det(F), state(F)
        assert np.array(at.C) == pytest.approx(C, rel=1e-13)
        assert np.array(at.cofactors) == pytest.approx(J * np.linalg.inv(F).T, rel=1e-12)
        found = [at.J, at.I1, at.I2, at.fibre_stretch]
        second = (np.trace(C) ** 2 - np.trace(C @ C)) / 2
        assert found == pytest.approx([J, np.trace(C), second, J ** (-1 / 3) * np.linalg.norm(F @ FIBRE)], rel=1e-12)


def test_between() -> None:
    assert [float(state(np.eye(3)).between(1.0, 2.0, x)) for x in (0.5, 1.0, 1.3, 2.0, 9.0)] == [
        1.0,
        1.0,
        1.3,
        2.0,
        2.0,
    ]


def test_effects_state_what_they_are() -> None:
    gravity, pressure = make("gravity"), make("pressure")
    assert (gravity.title, pressure.title) == ("Gravity", "Pressure on top")
    assert gravity.parameters[1:] == [
        ("density", pytest.approx(1.06e-9), "tonne/mm^3"),
        ("acceleration", pytest.approx((0, 0, -9810)), "mm/s^2"),
    ]
    assert [str(knot) for knot in gravity.ramp[:2]] == ["0 at frame 0", "1 at frame 10"]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Energy().energy(state(np.eye(3))), "Energy has no energy"),
        (lambda: Load(on="top").traction(state(np.eye(3)), (0, 0, 1)), "Load has no traction"),
        (lambda: Load(on="top").potential(state(np.eye(3)), (0, 0, 1)), "Load has no energy"),
        (lambda: Prestrain().elastic(state(np.eye(3))), "Prestrain has no elastic deformation"),
    ],
)
def test_an_effect_without_an_expression_says_so(call: Callable[[], object], message: str) -> None:
    with pytest.raises(NotImplementedError, match=message):
        call()


def test_unknown_effect() -> None:
    with pytest.raises(KeyError, match="magic"):
        effects.find("magic")


# Scalar fields


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

    second, nothing = FieldState(-0.7, (1.5, 0.3), -2.0), FieldState(0.0, (0.0, 0.0), 0.0)
    for share in (0.3, 2.0):
        between = share * effect.weak(PSI, TEST, HERE) + (1 - share) * effect.weak(second, TEST, HERE)
        assert effect.weak(mixed(PSI, second, share), TEST, HERE) == pytest.approx(between, rel=1e-12)
        assert effect.weak(PSI, mixed(TEST, nothing, share), HERE) == pytest.approx(
            share * effect.weak(PSI, TEST, HERE)
        )


@pytest.mark.parametrize("name", FIELD_PARAMETERS)
def test_every_field_parameter_is_felt_and_strict(name: str) -> None:
    for key in FIELD_PARAMETERS[name]:
        changed = field(name, **{key: other(effects.find(name), key, FIELD_PARAMETERS[name][key])})
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
