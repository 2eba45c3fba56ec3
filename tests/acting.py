"""Effects of all kinds with parameters, states to meet them in, and what they do there."""

import re
from typing import Any, get_args

import numpy as np
from pydantic import BeforeValidator
from scipy.spatial.transform import Rotation

from fem_reference import effects
from fem_reference.effects import Effect, Energy, FieldEffect, Interaction, Load, Ramped, State
from fem_reference.foundations.records import Record, parse
from fem_reference.foundations.units import positive

RAMP = [{"frame": 0, "amount": 0.0}, {"frame": 10, "amount": 1.0}, {"frame": 30, "amount": 0.5}]


def _stated(name: str) -> dict[str, Any]:
    """The example that an effect states, its ramp with a part that falls."""
    stated = effects.example(name)
    return stated | ({"ramp": RAMP} if "ramp" in stated else {})


PARAMETERS = {name: _stated(name) for name in effects.names()}
FIELD_PARAMETERS = {name: _stated(name) for name in effects.names(FieldEffect)}


def other(kind: type[Record], key: str, value: Any) -> Any:
    """Another value of a parameter: numbers less by a tenth, lists the other way round, another word, another formula."""
    words = get_args(kind.model_fields[key].annotation)
    if key == "ramp":
        return [{"frame": 0, "amount": 0.2}]
    if isinstance(value, list):
        return value[::-1]
    if isinstance(value, float):
        return 0.9 * value
    if value in words:
        return next(word for word in words if word != value)
    less = re.sub(r"-?\d+\.?\d*(?=[, ])", lambda number: f"{0.9 * float(number[0]):g}", value)
    return less if less != value else f"2*{value}"


def is_positive(kind: type[Record], key: str) -> bool:
    """True of a quantity with a unit that is above zero."""
    readers = [
        getattr(one.func, "func", None) for one in kind.model_fields[key].metadata if isinstance(one, BeforeValidator)
    ]
    return positive in readers


KINDS = {
    "MPa": "pressure",
    "mm": "a length",
    "rad": "an angle",
    "tonne/mm^3": "a density",
    "mm/s^2": "acceleration",
    "MPa*s/mm^2": "a damping",
    "MPa*s": "a viscosity",
}
# What acts by an expression at a point of the body; an interaction does not.
EXPRESSED = [name for name in PARAMETERS if not issubclass(effects.find(name), Interaction)]
ENERGIES = [name for name in PARAMETERS if issubclass(effects.find(name), Energy)]
ELASTIC = [name for name in ENERGIES if effects.find(name).stored and not effects.find(name).outer]
RAMPED = [name for name in PARAMETERS if issubclass(effects.find(name), Ramped)]
SLACK = ["fibre_passive", "fibre_passive_febio", "holzapfel_ogden"]


TURN = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
FIBRE = np.array([2.0, 3.0, 6.0]) / 7
ALONG = np.array([1.0, 0.0, 0.0])
BEFORE = ((1.2, 0.1, 0.0), (-0.2, 0.8, 0.3), (0.1, 0.0, 1.1))


def state(F: np.ndarray, pressure: float = 0.3, fibre: np.ndarray = FIBRE, amount: float = 1.0) -> State:
    moved = {
        "displacement": (0.3, -0.2, 0.5),
        "before": (0.2, 0.1, 0.5),
        "predicted": (0.1, 0.1, 0.4),
        "F_before": BEFORE,
        "rate": 4.0,
    }
    return State(F=F, pressure=pressure, fibre=fibre, amount=amount, **moved)


def make(name: str, **changes: Any) -> Any:
    return parse(effects.find(name), PARAMETERS[name] | changes, name)


def deformations() -> list[np.ndarray]:
    """Twenty, some of which stretch the fibre and some of which shorten it."""
    rng = np.random.default_rng(20)
    return [np.eye(3) + 0.4 * rng.uniform(-1, 1, (3, 3)) for _ in range(20)]


def uniaxial(stretch: float) -> np.ndarray:
    return np.diag([stretch, stretch**-0.5, stretch**-0.5])


def slope(effect: Energy, stretch: float, step: float = 1e-5) -> float:
    """The derivative of the energy with the stretch along the fibre, at constant volume, by central differences."""
    after, before = (effect.energy(state(uniaxial(stretch + sign * step), 0.0, ALONG)) for sign in (1, -1))
    return (after - before) / (2 * step)


def outcome(effect: Effect, at: State) -> Any:
    """What an effect does: its energy, its traction, or what is elastic."""
    if isinstance(effect, Load):
        return (effect.potential if effect.stored else effect.traction)(at, (0.6, 0.0, 0.8))
    return effect.energy(at) if isinstance(effect, Energy) else effect.elastic(at)
