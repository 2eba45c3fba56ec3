"""Tension at rest: the given mesh is the muscle as it is in the body, in equilibrium with stretched fibres."""

from collections.abc import Iterable, Sequence
from typing import Any, ClassVar

from pydantic import Field

from fem_reference.effects import Effect, Prestrain, State, moduli


class InSitu(Prestrain):
    """The energies depend on ``F Fp`` with ``Fp = l f f^T + l^(-1/2) (1 - f f^T)``, where l is the ``stretch`` along the fibre f. A
    stress at rest balances all effects at the first frame, including any activation, so that ``F = 1`` is in equilibrium there.

    The energy of this stress per unit rest volume is ``2 mu dev(e) : E + p0 (J - 1)`` with ``E = (F^T F - 1) / 2`` and fixed fields
    ``e`` and ``p0``, so that the stress rotates with the body. ``e`` and ``p0`` are the strain and the pressure of an isotropic
    body under the forces at rest; the shear and bulk moduli of this body are the moduli at rest of the scene's effects. Of all
    stresses that balance these forces, this stress has the least energy. The isotropic body is supported by the springs of
    attachments, which are extended at rest, and by the bones. A bone presses on the muscle where the two touch. With ``support``
    (a key of ``contact``) it also presses where the gap is at most ``support``, because the tissue in the gap transmits pressure.

    ``stretch``: dimensionless; above 1 if fibres are taut at rest, 1 if only an activation acts at rest. Source: Maas, Erdemir,
    Halloran and Weiss 2016, doi 10.1016/j.jmbbm.2016.04.012, who iterate to a prestrain that is in equilibrium with this stretch.
    Here the incompatible part of the prestrain is replaced by a constant stress, which is the solution of one linear problem.
    """

    needs: ClassVar[tuple[str, ...]] = ("fibre",)
    example: ClassVar[dict[str, Any]] = {"stretch": 1.1}
    stretch: float = Field(gt=0)

    def elastic(self, state: State) -> Sequence[Sequence[Any]]:
        return state.stretched(self.stretch)


def among(acting: Iterable[object]) -> InSitu | None:
    """The first of the effects ``acting`` that is tension at rest (``in_situ``); None if there is none."""
    return next((effect for effect in acting if isinstance(effect, InSitu)), None)


def moduli_of(effects: Sequence[Effect]) -> tuple[float, float]:
    """The shear modulus and the bulk modulus [MPa] at rest due to ``effects``. If the bulk modulus is 0, ten times the shear
    modulus is returned instead.
    """
    found = moduli(effects)
    return found.shear, found.bulk or 10 * found.shear


def balancing(state: State, slopes: Sequence[Sequence[Any]], pressure: Any, shear: Any) -> Any:
    """The energy per unit rest volume [MPa] of the stress at rest, at a ``state`` whose F is the total deformation gradient.

    ``slopes`` (3, 3): a matrix whose symmetric part is ``e``; ``pressure``: p0 [MPa]; ``shear``: mu [MPa], as in ``InSitu``.
    """
    C, mean = state.C, sum(slopes[i][i] for i in range(3)) / 3
    strained = sum((slopes[i][k] + slopes[k][i]) / 2 * (C[i][k] - (i == k)) for i in range(3) for k in range(3))
    return shear * (strained - mean * (state.I1 - 3)) + pressure * (state.J - 1)
