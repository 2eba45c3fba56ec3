"""Benchmarks: the speed of the reference and of the fast solvers, by asv; ``python -m benchmarks.peers``: beside FElupe and SfePy.

docs/speed.md has the commands and what was measured.
"""

from collections.abc import Callable, Iterable


def over[F: Callable[..., object]](**parameters: Iterable[object]) -> Callable[[F], F]:
    """Mark a benchmark as one that asv makes for all combinations of named ``parameters``."""

    def mark(function: F) -> F:
        vars(function).update(params=tuple(map(list, parameters.values())), param_names=tuple(parameters))
        return function

    return mark
