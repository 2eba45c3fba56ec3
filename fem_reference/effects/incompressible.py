"""Near-incompressibility with a pressure unknown (mixed formulation)."""

from typing import Any, ClassVar

from fem_reference.effects import State, VolumeLaw


class Incompressible(VolumeLaw):
    """``p (J - 1) - p^2 / (2 K)``: the perturbed Lagrangian whose stationary point in p is ``p = K (J - 1)``.

    ``bulk``: the bulk modulus K [MPa]. Source: Sussman and Bathe 1987, doi 10.1016/0045-7949(87)90265-3, with U = K/2 (J - 1)^2.

    Valid for J near 1, here from 1/2 to 2. The slope ``dU / d(log J) = K J (J - 1)`` has its minimum at 1/2. Below 1/2 the
    resistance to further shrinking decreases, and U remains below K/2 down to J = 0. Isochoric laws can therefore make a body
    shrink to almost nothing (``verification/squeeze.py`` has an example). Above 1 the law has no such limit. The value 2 is as far
    from 1 as 1/2 on a logarithmic scale, and far above any volume ratio of water-filled tissue.
    """

    unknowns: ClassVar[tuple[str, ...]] = ("pressure",)

    def energy(self, state: State) -> Any:
        return state.pressure * (state.J - 1) - state.pressure**2 / (2 * self.bulk)
