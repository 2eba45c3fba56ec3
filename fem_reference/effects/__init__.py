"""Effects: one file each, named as in scene files. A problem sums its effects and adds nothing else.

Contract (tests/contracts/test_every_effect.py): an effect is a frozen record of its parameters, and one expression written once,
with operators and the few functions of ``Functions`` only, so that a solver can take it symbolically and a test can evaluate it
in numpy. What acts in a body is an ``Effect`` of one of three kinds: an ``Energy`` per rest volume, a ``Load`` on a part of its
surface (a traction, where no energy exists), or a ``Prestrain``, which changes the deformation that the energies see. A
``FieldEffect`` acts on a scalar field psi and has a weak form.

A solver may hand symbols in place of an effect's parameters (so that a compiled form serves every value of them): an expression
never branches on a parameter and computes with it by operators and ``state.functions`` only.
"""

import importlib
import pkgutil
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, ClassVar, NamedTuple

import numpy as np
from pydantic import Field, field_validator

from fem_reference.foundations import outside
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.indicators import Estimates, Indicator
from fem_reference.foundations.limits import Limit
from fem_reference.foundations.material_point import State as State
from fem_reference.foundations.records import Record, parse
from fem_reference.foundations.units import unit_of, written

__path__ += outside.folders()


class Moduli(NamedTuple):
    """Stiffness at rest [MPa]: ``shear`` (of what has fibres, across them), ``bulk``, and the stress by which that of ``fibres`` is
    given; 0 of what has none.
    """

    shear: float = 0.0
    bulk: float = 0.0
    fibres: float = 0.0


class RampPoint(Record):
    """A share of an effect that acts at a frame number: up to a thousand times what its parameters say."""

    frame: float
    amount: float = Field(ge=0, le=1000)

    def __str__(self) -> str:
        return f"{self.amount:g} at frame {self.frame:g}"


class Effect(Record):
    """A frozen record of parameters of what acts in a body.

    ``unknowns``: names of the fields that it brings; ``needs``: what it asks of the rest state, ``"fibre"``, of the frames,
    ``"interval"``: the time from a frame number to the next, or of a step, ``"momentum"``: velocities and where these lead;
    ``outer``: True where it acts from outside the body, so that its forces are not in balance by themselves; ``example``: of its
    parameters as scene files write them, beside those of its kind.
    """

    unknowns: ClassVar[tuple[str, ...]] = ()
    needs: ClassVar[tuple[str, ...]] = ()
    outer: ClassVar[bool] = False
    example: ClassVar[dict[str, Any]] = {}

    def amount(self, frame: float) -> float:  # noqa: ARG002
        """The share of it that acts at a frame: all of it, unless it has a ramp."""
        return 1.0

    def limits(self) -> tuple[Limit, ...]:
        """The ranges that it is meant for; none unless its docstring gives one."""
        return ()

    def moduli(self) -> Moduli:
        """The stiffness that it gives the body at rest."""
        return Moduli()

    def indicator(self, scene: Estimates) -> Indicator | None:  # noqa: ARG002
        """The evidence that a scene needs it, known before it is solved; None of what is part of the material: always."""
        return None

    @property
    def title(self) -> str:
        """Its name beside the other effects of a scene."""
        return type(self).__name__

    @property
    def parameters(self) -> list[tuple[str, Any, str]]:
        """Name, value and unit of each parameter."""
        return [(name, getattr(self, name), unit_of(entry.metadata)) for name, entry in type(self).model_fields.items()]


class Ramped(Effect):
    """An effect with a ramp: ``ramp`` says how much of it acts, linearly between its knots, constant beyond them."""

    example: ClassVar[dict[str, Any]] = {"ramp": [{"frame": 0, "amount": 0.0}, {"frame": 10, "amount": 1.0}]}
    ramp: tuple[RampPoint, ...] = Field(min_length=1)

    @field_validator("ramp")
    @classmethod
    def _check_ramp(cls, ramp: tuple[RampPoint, ...]) -> tuple[RampPoint, ...]:
        if any(late.frame <= early.frame for early, late in pairwise(ramp)):
            raise ValueError("knots whose frames are each later than the one before")
        return ramp

    def amount(self, frame: float) -> float:
        """The share of it that acts at a frame."""
        frames, amounts = zip(*((knot.frame, knot.amount) for knot in self.ramp), strict=True)
        return float(np.interp(frame, frames, amounts))


class Energy(Effect):
    """An effect with an energy per rest volume; ``stored``: whether it can be had back."""

    stored: ClassVar[bool] = True

    def energy(self, state: State) -> Any:
        """Energy per rest volume [MPa] at ``state``."""
        raise NotImplementedError(f"{type(self).__name__} has no energy")


class Load(Effect):
    """A load on a part of the surface; ``on`` names it."""

    outer: ClassVar[bool] = True
    example: ClassVar[dict[str, Any]] = {"on": "top"}
    on: str

    @property
    def title(self) -> str:
        """Its name beside the other effects of a scene, other loads of its kind among them."""
        return f"{type(self).__name__} on {self.on}"

    def traction(self, state: State, normal: Sequence[Any]) -> Sequence[Any]:
        """Force per rest area [MPa], (3,), where ``normal`` (3,) is the outward unit normal at rest."""
        raise NotImplementedError(f"{type(self).__name__} has no traction")


class Interaction(Effect):
    """An effect between a body and the rigid bodies around it, which a problem makes of a scene."""


class Prestrain(Effect):
    """An effect that changes what is elastic of the deformation."""

    def elastic(self, state: State) -> Sequence[Sequence[Any]]:
        """The deformation gradient (3, 3) that the energies see."""
        raise NotImplementedError(f"{type(self).__name__} has no elastic deformation")


def elastic_state(acting: Sequence[tuple[Effect, Any]], state: State) -> State:
    """``state`` with the F that the energies of ``acting`` see: the elastic one, where there is a prestrain."""
    for effect, amount in acting:
        if isinstance(effect, Prestrain):
            now, before = (effect.elastic(replace(state, F=F, amount=amount)) for F in (state.F, state.F_before))
            state = replace(state, F=now, F_before=before)
    return state


def total_energy(acting: Sequence[tuple[Effect, Any]], state: State) -> Any:
    """The sum of the energies per rest volume [MPa] of ``acting``, (effect, amount) each, at ``state``, whose F is the whole
    deformation gradient. A prestrain changes F before the step as it does F now: its own ramp moves nothing.
    """
    state = elastic_state(acting, state)
    energies = [(effect, amount) for effect, amount in acting if isinstance(effect, Energy)]
    return sum(effect.energy(replace(state, amount=amount)) for effect, amount in energies)


def fibre_tension(effect: Energy, stretch: float, step: float = 1e-6) -> float:
    """The force per rest area [MPa] along fibres of a ``stretch`` whose volume stays, by central differences of the energy."""

    def energy(along: float) -> float:
        across = along**-0.5
        F = ((along, 0.0, 0.0), (0.0, across, 0.0), (0.0, 0.0, across))
        return float(effect.energy(State(F=F, pressure=0.0, fibre=(1.0, 0.0, 0.0))))

    return (energy(stretch + step) - energy(stretch - step)) / (2 * step)


@dataclass(frozen=True)
class FieldState:
    """A scalar function at a point: its ``value``, ``gradient`` (one entry a coordinate) and, of an unknown, ``laplacian``."""

    value: Any
    gradient: Sequence[Any]
    laplacian: Any = 0.0


@dataclass(frozen=True)
class Place:
    """A point that a field effect acts at: the ``position`` (x, y, z as far as there are), the ``functions`` of formulas, and
    ``upper``, the share of the element that lies above the mean y of the vertices.
    """

    position: Sequence[Any]
    functions: Mapping[str, Any]
    upper: Any


class FieldEffect(Record):
    """A frozen record of parameters with a term of ``-div(k grad psi) + v . grad psi + c psi - f = 0`` (report eq. 4.4, whose
    A, B, C and D f are -k, v, c and f). ``example``: of its parameters as scene files write them.
    """

    example: ClassVar[dict[str, Any]] = {}

    def weak(self, psi: FieldState, test: FieldState, place: Place) -> Any:
        """The term times ``test``, integrated by parts where it has second derivatives; linear in ``test``, affine in ``psi``."""
        raise NotImplementedError(f"{type(self).__name__} has no weak form")

    def strong(self, psi: FieldState, place: Place) -> Any:
        """The term itself, as a residual-based stabilisation needs it."""
        raise NotImplementedError(f"{type(self).__name__} has no strong form")


def names(kind: type[Record] = Effect) -> list[str]:
    """The effects of a ``kind`` that there are, as scene files name them."""
    return sorted(module.name for module in pkgutil.iter_modules(__path__) if issubclass(_record(module.name), kind))


def find(name: str) -> type[Record]:
    """The record of the effect ``name``; KeyError where there is none."""
    if name not in {module.name for module in pkgutil.iter_modules(__path__)}:
        raise KeyError(name)
    return _record(name)


def example(name: str) -> dict[str, Any]:
    """An example of the parameters of the effect ``name``, with those of all of its kind."""
    stated = [vars(kind).get("example", {}) for kind in reversed(find(name).__mro__)]
    return {key: value for one in stated for key, value in one.items()}


def moduli(acting: Iterable[Record]) -> Moduli:
    """The stiffness at rest of the effects ``acting`` together."""
    found = [effect.moduli() for effect in acting if isinstance(effect, Effect)]
    return Moduli(*map(sum, zip(*found, strict=True)))


def _record(name: str) -> type[Record]:
    """The record in the file of the effect ``name``, which is there."""
    return outside.only_record(importlib.import_module(f"{__name__}.{name}"), __path__, (Effect, FieldEffect))


def make(name: str, **parameters: Any) -> "Effect":
    """The effect ``name``, its parameters as in scene files or numbers in mm, N, MPa, s, tonne; InputError where one is wrong.

    >>> make("neo_hooke", mu="10 kPa").mu, make("neo_hooke", mu=0.01).mu
    (0.01, 0.01)
    """
    if not isinstance(name, str) or name not in names():
        raise InputError("effect", f'"{name}"', f"one of {', '.join(names())}")
    record = find(name)
    units = {key: unit_of(field.metadata) for key, field in record.model_fields.items()}
    made = parse(record, {key: written(value, units.get(key, "")) for key, value in parameters.items()}, name)
    assert isinstance(made, Effect)
    return made
