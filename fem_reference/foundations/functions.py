"""The functions that expressions may call: in numpy, and as a protocol for symbols and numbers with derivatives."""

from typing import Any, Protocol

import numpy as np


class Functions(Protocol):
    """Functions that an expression may call besides operators, in numpy or symbolically."""

    def exp(self, x: Any) -> Any:
        """The exponential of x."""

    def log(self, x: Any) -> Any:
        """The natural logarithm of x > 0."""

    def sqrt(self, x: Any) -> Any:
        """The square root of x > 0."""

    def cos(self, x: Any) -> Any:
        """The cosine of x [rad]."""

    def sin(self, x: Any) -> Any:
        """The sine of x [rad]."""

    def above(self, x: Any, limit: Any, then: Any, otherwise: Any) -> Any:
        """``then`` where ``x > limit``, else ``otherwise``; both are evaluated everywhere and must be finite."""


class Numpy:
    """``Functions`` of numbers and arrays."""

    exp = staticmethod(np.exp)
    log = staticmethod(np.log)
    sqrt = staticmethod(np.sqrt)
    cos = staticmethod(np.cos)
    sin = staticmethod(np.sin)

    @staticmethod
    def above(x: Any, limit: Any, then: Any, otherwise: Any) -> Any:
        """``then`` where ``x > limit``, else ``otherwise``."""
        return np.where(x > limit, then, otherwise)
