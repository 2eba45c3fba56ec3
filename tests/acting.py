"""Effects of all kinds with parameters, states to meet them in, and what they do there."""

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from fem_reference import effects
from fem_reference.effects import Effect, Energy, Interaction, Load, Ramped, State
from fem_reference.foundations.records import parse
from fem_reference.foundations.units import unit_of

RAMP = [{"frame": 0, "amount": 0.0}, {"frame": 10, "amount": 1.0}, {"frame": 30, "amount": 0.5}]
_EXAMPLES: dict[str, dict[str, Any]] = {
    "neo_hooke": {"mu": "10 kPa"},
    "mooney_rivlin": {"c1": "10 kPa", "c2": "4 kPa"},
    "incompressible": {"bulk": "10 MPa"},
    "incompressible_penalty": {"bulk": "10 MPa"},
    "fibre_passive": {"stress": "300 kPa", "p1": 0.05, "p2": 6.6, "optimal_stretch": 1.1, "linear_from": 1.4},
    "fibre_passive_febio": {"c3": "10 kPa", "c4": 12.0, "c5": "3 MPa", "linear_from": 1.3},
    "fibre_active": {"stress": "300 kPa", "optimal_stretch": 1.1, "ramp": RAMP},
    "active_tension": {"tension": "60 kPa", "ramp": RAMP},
    "holzapfel_ogden": {"k1": "20 kPa", "k2": 1.5, "angle": "30 deg", "normal": [0.2, 0.5, 2.0]},
    "guccione": {"c": "2 kPa", "bf": 8.0, "bt": 2.0, "bfs": 4.0},
    "gravity": {"density": "1060 kg/m3", "acceleration": "0, 0, -9.81 m/s^2", "ramp": RAMP},
    "pressure": {"on": "top", "pressure": "8 kPa", "ramp": RAMP},
    "traction": {"on": "top", "force": "0, 6.25, 1 kPa", "ramp": RAMP},
    "contact": {"stiffness": "500 kPa/mm", "smoothing": "0.3 mm", "bones": ["femur"]},
    "prestretch": {"stretch": 1.1, "ramp": RAMP},
    "damping": {"coefficient": "2 Pa s/mm^2"},
    "viscosity": {"eta": "300 kPa s"},
    "inertia": {"density": "1060 kg/m3", "spectral_radius": 0.8},
}


def _example(name: str) -> dict[str, Any]:
    """The parameters of an effect of which nobody has given an example: 3 of the unit of each, 1.3 where it has none."""
    known = {"ramp": RAMP, "on": "top"}
    units = {key: unit_of(field.metadata) for key, field in effects.find(name).model_fields.items()}
    return {key: known.get(key, f"3 {unit}" if unit else 1.3) for key, unit in units.items()}


PARAMETERS = {name: _EXAMPLES.get(name) or _example(name) for name in effects.names()}
OTHER: dict[str, Any] = {
    "p1": 0.06,
    "p2": 6.0,
    "optimal_stretch": 1.05,
    "linear_from": 1.15,
    "c4": 11.0,
    "k2": 1.0,
    "angle": "40 deg",
    "normal": [2.0, 0.5, 0.2],
    "bf": 7.0,
    "bt": 3.0,
    "bfs": 5.0,
    "density": "1000 kg/m3",
    "acceleration": "0, 1, -9.81 m/s^2",
    "force": "1, 6.25, 1 kPa",
    "stretch": 1.2,
    "coefficient": "7 MPa s/mm^2",
    "eta": "7 MPa s",
    "spectral_radius": 0.5,
    "ramp": [{"frame": 0, "amount": 0.2}],
    "on": "bottom",
}  # of other parameters it is 7 MPa
POSITIVE = ["mu", "bulk", "stress", "c3", "c5", "tension", "k1", "c", "density", "coefficient", "eta"]
KINDS = {
    "MPa": "pressure",
    "rad": "an angle",
    "tonne/mm^3": "a density",
    "mm/s^2": "acceleration",
    "MPa*s/mm^2": "a damping",
    "MPa*s": "a viscosity",
}
# What acts by an expression at a point of the body; an interaction does not.
EXPRESSED = [name for name in PARAMETERS if not issubclass(effects.find(name), Interaction)]
ENERGIES = [name for name in PARAMETERS if issubclass(effects.find(name), Energy)]
ELASTIC = [name for name in ENERGIES if effects.find(name).stored and name != "gravity"]
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
        return effect.traction(at, (0.6, 0.0, 0.8))
    return effect.energy(at) if isinstance(effect, Energy) else effect.elastic(at)
