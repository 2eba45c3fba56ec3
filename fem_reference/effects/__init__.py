"""What acts on a body: one file per effect, named as in scene files. A problem sums its effects and adds nothing else.

Contract (tests/test_effects.py): an effect is a frozen record of its parameters with units, and an energy per rest volume
[MPa] written once, with operators only, so that a solver can differentiate it symbolically and a test can evaluate it in numpy.
An effect that brings an unknown of its own names it in ``unknowns``.
"""

import importlib
import pkgutil
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


def names() -> list[str]:
    """The effects there are, as scene files name them."""
    return sorted(module.name for module in pkgutil.iter_modules(__path__))


def find(name: str) -> type[Effect]:
    """The record of the effect ``name``; KeyError where there is none."""
    if name not in names():
        raise KeyError(name)
    module = importlib.import_module(f"{__name__}.{name}")
    (record,) = (
        entry
        for entry in vars(module).values()
        if isinstance(entry, type) and issubclass(entry, Effect) and entry.__module__ == module.__name__
    )
    return record
