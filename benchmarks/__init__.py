"""Benchmarks of the reference and the fast solvers by asv; ``python -m benchmarks.peers`` compares with FElupe and SfePy.

docs/speed.md states the commands and the results.
"""

from collections.abc import Callable, Iterable


def over[F: Callable[..., object]](unit: str, /, **parameters: Iterable[object]) -> Callable[[F], F]:
    """Mark a benchmark in a ``unit``, which asv runs for all combinations of the named ``parameters``."""

    def mark(function: F) -> F:
        names, values = tuple(parameters), tuple(map(list, parameters.values()))
        vars(function).update(unit=unit, params=values, param_names=names)
        return function

    return mark
