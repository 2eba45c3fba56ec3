"""Benchmarks: the speed of the reference and of the fast solvers, by asv; ``python -m benchmarks.peers``: beside FElupe and SfePy.

docs/speed.md has the commands and what was measured.
"""

from collections.abc import Callable, Iterable


def over[F: Callable[..., object]](unit: str, /, **parameters: Iterable[object]) -> Callable[[F], F]:
    """Mark a benchmark in a ``unit`` as one that asv makes for all combinations of named ``parameters``."""

    def mark(function: F) -> F:
        names, values = tuple(parameters), tuple(map(list, parameters.values()))
        vars(function).update(unit=unit, params=values, param_names=names)
        return function

    return mark
