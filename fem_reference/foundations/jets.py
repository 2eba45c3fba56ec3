"""Numbers with their first and second derivatives (jets), which differentiate an expression exactly, without finite differences."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem_reference.foundations.material_point import Functions
from fem_reference.foundations.mesh import Floats


@dataclass(frozen=True, eq=False)
class Jet:
    """A function of n variables at points (...,), with its derivatives.

    ``value`` (...,); ``slope`` (n, ...): the first derivatives; ``curvature`` (n, n, ...): the second derivatives, or None if they
    are not needed, which saves nine tenths of the work. A slope or curvature that is the same at all points has length 1 along the
    axes of the points. An array combined with a jet has as many axes as the points of the jet, or none.
    """

    value: Any
    slope: Any
    curvature: Any = None

    __array_ufunc__ = None  # numpy then leaves "array + jet" and the like to the methods of the jet

    def chained(self, value: Any, first: Any, second: Any) -> "Jet":
        """Apply a function to the jet. ``value``, ``first``, ``second``: the function and its derivatives at ``self.value``."""
        if self.curvature is None:
            return Jet(value, first * self.slope, None)
        outer = self.slope[:, None] * self.slope[None]
        return Jet(value, first * self.slope, first * self.curvature + second * outer)

    def __neg__(self) -> "Jet":
        return self * -1.0

    def __add__(self, other: Any) -> "Jet":
        if isinstance(other, Jet):
            curvature = None if self.curvature is None else self.curvature + other.curvature
            return Jet(self.value + other.value, self.slope + other.slope, curvature)
        return Jet(self.value + other, self.slope, self.curvature)

    def __sub__(self, other: Any) -> "Jet":
        return self.__add__(-other)

    def __rsub__(self, other: Any) -> "Jet":
        return (-self).__add__(other)

    def __mul__(self, other: Any) -> "Jet":
        if not isinstance(other, Jet):
            curvature = None if self.curvature is None else self.curvature * other
            return Jet(self.value * other, self.slope * other, curvature)
        value, slope = self.value * other.value, self.value * other.slope + other.value * self.slope
        if self.curvature is None:
            return Jet(value, slope, None)
        mixed = self.slope[:, None] * other.slope[None]
        curvature = self.value * other.curvature + other.value * self.curvature + mixed + np.swapaxes(mixed, 0, 1)
        return Jet(value, slope, curvature)

    def __pow__(self, exponent: float) -> "Jet":
        first = exponent * self.value ** (exponent - 1) if exponent else 0.0
        second = exponent * (exponent - 1) * self.value ** (exponent - 2) if exponent not in (0, 1) else 0.0
        return self.chained(self.value**exponent, first, second)

    def __truediv__(self, other: Any) -> "Jet":
        return self.__mul__(other**-1.0)

    def __rtruediv__(self, other: Any) -> "Jet":
        return (self**-1.0).__mul__(other)

    __radd__, __rmul__ = __add__, __mul__


def variables(values: Floats, *, curved: bool = True) -> list[Jet]:
    """Create the n variables as jets with the ``values`` (n, ...) at the points. The jets have no curvature unless ``curved``."""
    count, along = len(values), (1,) * (values.ndim - 1)
    slopes, flat = np.eye(count).reshape(count, count, *along), np.zeros((count, count, *along)) if curved else None
    return [Jet(value, slope, flat) for value, slope in zip(values, slopes, strict=True)]


def constant(value: Any, like: Jet) -> Jet:
    """Create a jet of a constant ``value`` in the variables of the jet ``like``."""
    curvature = None if like.curvature is None else np.zeros_like(like.curvature)
    return Jet(value + np.zeros_like(like.value), np.zeros_like(like.slope), curvature)


def _differentiated(function: Callable[[Any], tuple[Any, Any, Any]]) -> Callable[[Any], Any]:
    """Extend ``function``, which returns a value and its first and second derivatives, to jets, numbers and arrays."""

    def of(x: Any) -> Any:
        return x.chained(*function(x.value)) if isinstance(x, Jet) else function(np.asarray(x, float))[0]

    return of


def _above(x: Any, limit: Any, then: Any, otherwise: Any) -> Any:
    """Select ``then`` where ``x > limit`` and ``otherwise`` elsewhere; the derivatives come from the selected branch."""
    chosen = getattr(x, "value", x) > getattr(limit, "value", limit)
    like = next((branch for branch in (then, otherwise) if isinstance(branch, Jet)), None)
    if like is None:
        return np.where(chosen, then, otherwise)
    one, other = (branch if isinstance(branch, Jet) else constant(branch, like) for branch in (then, otherwise))
    parts = ("value", "slope") if one.curvature is None else ("value", "slope", "curvature")
    return Jet(*(np.where(chosen, getattr(one, part), getattr(other, part)) for part in parts))


# Functions that accept jets, numbers and arrays.
JET_FUNCTIONS = Functions(
    exp=_differentiated(lambda v: (e := np.exp(v), e, e)),
    log=_differentiated(lambda v: (np.log(v), 1 / v, -1 / v**2)),
    sqrt=_differentiated(lambda v: (root := np.sqrt(v), 0.5 / root, -0.25 / (v * root))),
    cos=_differentiated(lambda v: (cosine := np.cos(v), -np.sin(v), -cosine)),
    sin=_differentiated(lambda v: (sine := np.sin(v), np.cos(v), -sine)),
    above=_above,
)
