"""Effects: each has a file of its own, by whose name scene files refer to it. A problem is the sum of its effects and nothing else.

Contract (tests/contracts/test_every_effect.py): an effect is a frozen record of its parameters with one expression, written only
with operators and the functions of ``Functions``. A solver can therefore use the expression symbolically, and a test can evaluate
it in numpy. An ``Effect`` acts on a body. It is an ``Energy`` per unit rest volume; a ``Load`` on a part of the surface (a
traction, or an energy per unit rest area); a ``Prestrain``, which changes the deformation on which the energies depend; or an
``Interaction``, which is formulated by a problem. A ``FieldEffect`` acts on a scalar field psi and has a weak form.

A solver may replace the parameters of an effect by symbols, so that one compiled form serves for all values. An expression must
therefore never branch on a parameter, and must apply only operators and ``state.functions`` to parameters.
"""

import importlib
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
from pydantic import Field, field_validator

from fem_reference.foundations import modules, outside
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.indicators import Estimates, Indicator
from fem_reference.foundations.limits import Limit, Range
from fem_reference.foundations.loads import RampPoint, Shape, Wrench
from fem_reference.foundations.material_point import REST, fibre_tension
from fem_reference.foundations.material_point import FieldState as FieldState
from fem_reference.foundations.material_point import Moduli as Moduli
from fem_reference.foundations.material_point import Place as Place
from fem_reference.foundations.material_point import State as State
from fem_reference.foundations.mesh import Bools, Floats
from fem_reference.foundations.records import Record, increasing, parse
from fem_reference.foundations.units import PositivePressure, unit_of, written

__path__ += outside.folders()


class Effect(Record):
    """A frozen record of the parameters of an effect on a body.

    ``unknowns``: the names of the fields that the effect adds. ``needs``: its requirements, among ``"fibre"`` (fibre directions at
    rest), ``"interval"`` (the time between frame numbers) and ``"momentum"`` (velocities, and displacements predicted for a load
    step). ``outer``: True if the effect acts from outside the body, so that its forces need not sum to zero. ``example``: example
    values of its parameters as in scene files, without those of the base classes. ``published``: the ranges of parameters in the
    literature on muscle, by name.
    """

    unknowns: ClassVar[tuple[str, ...]] = ()
    needs: ClassVar[tuple[str, ...]] = ()
    outer: ClassVar[bool] = False
    example: ClassVar[dict[str, Any]] = {}
    published: ClassVar[dict[str, Range]] = {}

    def amount(self, frame: float) -> float:  # noqa: ARG002
        """The amount of the effect at a frame: 1 unless the effect has a ramp."""
        return 1.0

    def limits(self) -> tuple[Limit, ...]:
        """The ranges in which the effect is valid; empty if its docstring states none."""
        return ()

    def moduli(self) -> Moduli:
        """The contribution of the effect to the stiffness of the body at rest."""
        return Moduli()

    def resultant(self, shape: Shape) -> Wrench | None:  # noqa: ARG002
        """The force and moment of the effect on an entire body of this ``shape``, for an amount of 1. None if they are unknown, or
        if they depend on more than the shape, for example on the velocities within a load step.
        """
        return None if self.outer else Wrench(np.zeros(3), np.zeros(3))

    def indicator(self, scene: Estimates) -> Indicator | None:  # noqa: ARG002
        """An estimate, before solving, of the influence of the effect; None if it is part of the material and always needed."""
        return None

    @property
    def title(self) -> str:
        """The class name, with part of the surface and region if stated, as a scene may have several effects of one class."""
        on = getattr(self, "on", "")
        return (
            type(self).__name__ + (f" on {on}" if on else "") + (f" in {region}" if (region := region_of(self)) else "")
        )

    @property
    def parameters(self) -> list[tuple[str, Any, str]]:
        """The name, value and unit of each parameter except the region."""
        fields = type(self).model_fields.items()
        return [(name, getattr(self, name), unit_of(entry.metadata)) for name, entry in fields if name != "region"]


class Ramped(Effect):
    """An effect with a ``ramp``: its amount varies over the frames, linearly between knots, and is constant beyond them."""

    example: ClassVar[dict[str, Any]] = {"ramp": [{"frame": 0, "amount": 0.0}, {"frame": 10, "amount": 1.0}]}
    ramp: tuple[RampPoint, ...] = Field(min_length=1)

    @field_validator("ramp")
    @classmethod
    def _check_ramp(cls, ramp: tuple[RampPoint, ...]) -> tuple[RampPoint, ...]:
        increasing([knot.frame for knot in ramp], "knots in the order of their frames, each frame once")
        return ramp

    def amount(self, frame: float) -> float:
        frames, amounts = zip(*((knot.frame, knot.amount) for knot in self.ramp), strict=True)
        return float(np.interp(frame, frames, amounts))


class Energy(Effect):
    """An effect with an energy per unit rest volume. ``stored``: True if the energy is recoverable. ``region`` (the key ``in``):
    the region of the body in which the effect acts, weighted by the share of each point; empty if the effect acts everywhere.
    """

    stored: ClassVar[bool] = True
    region: str = Field(default="", alias="in", exclude_if=lambda region: not region)

    @field_validator("region")
    @classmethod
    def _check_region(cls, region: str) -> str:
        if "momentum" in cls.needs:
            raise ValueError("no region, as the entire body has inertia")
        return region

    def energy(self, state: State) -> Any:
        """Energy per unit rest volume [MPa] at ``state``, for a point that is fully in the region."""
        raise NotImplementedError(f"{type(self).__name__} has no energy")

    def weighted(self, state: State) -> Any:
        """Energy per unit rest volume [MPa] at ``state``, multiplied by the share of the point in the region."""
        return state.share(self.region) * self.energy(state) if self.region else self.energy(state)


def region_of(effect: Record) -> str:
    """The region in which an ``effect`` acts, in the form that ``State.share`` accepts; empty if it acts everywhere."""
    return str(getattr(effect, "region", ""))


def regions_named(effects: Iterable[Record]) -> list[str]:
    """The names, each once, of the regions inside which or outside which ``effects`` act."""
    named = filter(None, map(region_of, effects))
    return list(dict.fromkeys(region.removeprefix(REST) for region in named))


class VolumeLaw(Energy):
    """An energy that depends only on the volume, with the bulk modulus ``bulk`` [MPa]. Valid for V/V0 from 1/2 to 2."""

    example: ClassVar[dict[str, Any]] = {"bulk": "10 MPa"}
    bulk: PositivePressure

    def limits(self) -> tuple[Limit, ...]:
        return (Limit("V/V0", 0.5, 2.0),)

    def moduli(self) -> Moduli:
        return Moduli(bulk=self.bulk)


class LameLaw(Energy):
    """An isotropic energy. ``mu``, ``lame``: the Lame parameters at rest [MPa]."""

    example: ClassVar[dict[str, Any]] = {"mu": "10 kPa", "lame": "90 kPa"}
    mu: PositivePressure
    lame: PositivePressure

    def moduli(self) -> Moduli:
        return Moduli(shear=self.mu, bulk=self.lame + 2 / 3 * self.mu)


class PassiveFibres(Energy):
    """An energy of fibres that resist stretch."""

    needs: ClassVar[tuple[str, ...]] = ("fibre",)

    def indicator(self, scene: Estimates) -> Indicator:
        """The tension of the fibres at the maximum expected stretch, relative to the stiffness of the matrix."""
        greatest = scene.stretch[1]
        pull = fibre_tension(self.energy, greatest)
        return fibre_indicator(scene, pull, scene.shorten(pull, 0.1 * (greatest - 1)))


class Load(Effect):
    """A load on the part ``on`` of the surface: an energy per unit rest area if ``stored`` is True, otherwise a traction."""

    outer: ClassVar[bool] = True
    stored: ClassVar[bool] = False
    example: ClassVar[dict[str, Any]] = {"on": "top"}
    on: str

    def along(self, normals: Floats) -> Bools:
        """Mask (f, 3) of the axes along which the load may act on facets; ``normals`` (f, 3): absolute components of normals."""
        return np.ones(normals.shape, bool)

    def traction(self, state: State, normal: Sequence[Any]) -> Sequence[Any]:
        """Force per unit rest area [MPa], (3,), for the outward unit normal ``normal`` (3,) at rest."""
        raise NotImplementedError(f"{type(self).__name__} has no traction")

    def potential(self, state: State, normal: Sequence[Any]) -> Any:
        """Energy per unit rest area [N/mm] for the outward unit normal ``normal`` (3,) at rest."""
        raise NotImplementedError(f"{type(self).__name__} has no energy")


class Interaction(Effect):
    """An effect between a body and the bones or muscles around it. Its equations are part of a problem."""


class Prestrain(Effect):
    """An effect that changes the elastic part of the deformation."""

    def elastic(self, state: State) -> Sequence[Sequence[Any]]:
        """The elastic deformation gradient (3, 3), on which the energies depend."""
        raise NotImplementedError(f"{type(self).__name__} has no elastic deformation")


def elastic_state(acting: Sequence[tuple[Effect, Any]], state: State) -> State:
    """The ``state`` with the F on which the energies depend: the elastic part of the given F if ``acting``, pairs (effect, amount),
    has a prestrain.
    """
    for effect, amount in acting:
        if isinstance(effect, Prestrain):
            now, before = (effect.elastic(replace(state, F=F, amount=amount)) for F in (state.F, state.F_before))
            state = replace(state, F=now, F_before=before)
    return state


def total_energy(acting: Sequence[tuple[Effect, Any]], state: State) -> Any:
    """The sum of the energies per unit rest volume [MPa] of ``acting``, pairs (effect, amount), at a ``state`` whose F is the total
    deformation gradient. A prestrain changes the F before the step and the present F alike, so its ramp causes no rate of strain.
    """
    state = elastic_state(acting, state)
    return sum(law.weighted(replace(state, amount=amount)) for law, amount in acting if isinstance(law, Energy))


def fibre_indicator(scene: Estimates, pull: float, distance: float) -> Indicator:
    """The indicator of fibres whose tension ``pull`` [MPa] moves the surface of the muscle by a ``distance`` [mm]."""
    return Indicator("ratio of fibre tension to shear modulus", pull / scene.shear, distance, pull)


class FieldEffect(Record):
    """A frozen record of the parameters of a term in ``-div(k grad psi) + v . grad psi + c psi - f = 0``: eq. 4.4 of the report
    DCSE/TR-2022-03, whose A, B, C and D f are -k, v, c and f. ``example``: example values of its parameters, as in scene files.
    """

    example: ClassVar[dict[str, Any]] = {}

    def weak(self, psi: FieldState, test: FieldState, place: Place) -> Any:
        """The term times ``test``, integrated by parts if it has second derivatives: linear in ``test`` and affine in ``psi``."""
        return self.strong(psi, place) * test.value

    def strong(self, psi: FieldState, place: Place) -> Any:
        """The term in its strong form, which residual-based stabilisation needs."""
        raise NotImplementedError(f"{type(self).__name__} has no strong form")


def names(kind: type[Record] = Effect) -> list[str]:
    """The names, in scene files, of all effects of a ``kind``."""
    return [name for name in modules.names(__path__) if issubclass(_record(name), kind)]


def find(name: str) -> type[Record]:
    """The class of the effect ``name``. Raises KeyError if there is no such effect."""
    if name not in modules.names(__path__):
        raise KeyError(name)
    return _record(name)


def name_of(effect: Record | type[Record]) -> str:
    """The name of an ``effect`` or of a class of effects in scene files, which is the name of its Python file."""
    return effect.__module__.rpartition(".")[2]


def example(name: str) -> dict[str, Any]:
    """Example values of the parameters of the effect ``name``, including the parameters of its base classes."""
    stated = [vars(kind).get("example", {}) for kind in reversed(find(name).__mro__)]
    return {key: value for one in stated for key, value in one.items()}


def moduli(acting: Iterable[Record]) -> Moduli:
    """The stiffness at rest due to all effects in ``acting`` together."""
    found = [effect.moduli() for effect in acting if isinstance(effect, Effect)]
    return Moduli(*map(sum, zip(*found, strict=True)))


def _record(name: str) -> type[Record]:
    """The class in the file of the existing effect ``name``."""
    return outside.only_record(importlib.import_module(f"{__name__}.{name}"), tuple(__path__), (Effect, FieldEffect))


def make(name: str, **parameters: Any) -> "Effect":
    """Make the effect ``name``. Raises InputError if the name or a parameter is invalid.

    ``parameters``: as in scene files, with units in the text, or as numbers in mm, N, MPa, s, rad and tonne.

    >>> make("neo_hooke", mu="10 kPa").mu, make("neo_hooke", mu=0.01).mu
    (0.01, 0.01)
    """
    if not isinstance(name, str) or name not in names():
        raise InputError("effect", f'"{name}"', f"one of {', '.join(names())}")
    units = {key: unit_of(field.metadata) for key, field in find(name).model_fields.items()}
    made = parse(find(name), {key: written(value, units.get(key, "")) for key, value in parameters.items()}, name)
    assert isinstance(made, Effect)
    return made
