"""What acts: one file per effect, named as in scene files. A problem sums its effects and adds nothing else.

Contract (tests/test_effects.py): an effect is a frozen record of its parameters, and one expression written once, with
operators only, so that a solver can take it symbolically and a test can evaluate it in numpy. An ``Effect`` acts in a body and
has an energy per rest volume [MPa]; one that brings an unknown of its own names it in ``unknowns``. A ``FieldEffect`` acts on a
scalar field psi and has a weak form.
"""

import importlib
import pkgutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from fem_reference.records import Record


@dataclass(frozen=True)
class State:
    """What an energy may depend on at a point; each entry a number, an array over points or a symbolic expression.

    ``I1``: trace of ``C = F^T F``; ``J``: det F; ``pressure``: the mixed pressure unknown [MPa], None where no effect brings it.
    """

    I1: Any
    J: Any
    pressure: Any = None


class Effect(Record):
    """A frozen record of parameters with an energy per rest volume."""

    unknowns: ClassVar[tuple[str, ...]] = ()

    def energy(self, state: State) -> Any:
        """Energy per rest volume [MPa] at ``state``."""
        raise NotImplementedError(f"{type(self).__name__} has no energy")


@dataclass(frozen=True)
class FieldState:
    """A scalar function at a point: its ``value``, ``gradient`` (one entry a coordinate) and, of an unknown, ``laplacian``."""

    value: Any
    gradient: Sequence[Any]
    laplacian: Any = 0.0


@dataclass(frozen=True)
class Place:
    """Where a field effect acts: the ``position`` (x, y, z as far as there are), the ``functions`` that formulas may call, and
    ``upper``, the share of the element that lies above the mean y of the vertices.
    """

    position: Sequence[Any]
    functions: Mapping[str, Any]
    upper: Any


class FieldEffect(Record):
    """A frozen record of parameters with a term of ``-div(k grad psi) + v . grad psi + c psi - f = 0`` (report eq. 4.4, whose
    A, B, C and D f are -k, v, c and f).
    """

    def weak(self, psi: FieldState, test: FieldState, place: Place) -> Any:
        """The term times ``test``, integrated by parts where it has second derivatives; linear in ``test``, affine in ``psi``."""
        raise NotImplementedError(f"{type(self).__name__} has no weak form")

    def strong(self, psi: FieldState, place: Place) -> Any:
        """The term itself, as a residual-based stabilisation needs it."""
        raise NotImplementedError(f"{type(self).__name__} has no strong form")


def names(kind: type[Record] = Effect) -> list[str]:
    """The effects of a ``kind`` that there are, as scene files name them."""
    found = sorted(module.name for module in pkgutil.iter_modules(__path__))
    return [name for name in found if issubclass(find(name), kind)]


def find(name: str) -> type[Record]:
    """The record of the effect ``name``; KeyError where there is none."""
    if name not in {module.name for module in pkgutil.iter_modules(__path__)}:
        raise KeyError(name)
    module = importlib.import_module(f"{__name__}.{name}")
    (record,) = (
        entry
        for entry in vars(module).values()
        if isinstance(entry, type) and issubclass(entry, Effect | FieldEffect) and entry.__module__ == module.__name__
    )
    return record
