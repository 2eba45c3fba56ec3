"""Tension at rest: the given mesh is the muscle in the body, in equilibrium with stretched fibres."""

from collections.abc import Iterable, Sequence
from typing import Any, ClassVar

from pydantic import Field

from fem_reference.effects import Effect, Prestrain, State, moduli


class InSitu(Prestrain):
    """The energies depend on ``F Fp``, ``Fp = l f f^T + l^(-1/2) (1 - f f^T)``, l the ``stretch`` along the fibre f. A stress at
    rest balances all effects at the first frame, an activation included, so that ``F = 1`` is in equilibrium there.

    The energy of this stress per unit rest volume is ``2 mu dev(e) : E + p0 (J - 1)``, ``E = (F^T F - 1) / 2``, with fixed fields
    ``e`` and ``p0``, so the stress rotates with the body. ``e`` and ``p0`` are the strain and pressure of an isotropic body under
    the forces at rest, with the shear and bulk modulus at rest of the scene's effects. This stress has the least energy of all that
    balance these forces. The isotropic body is supported by the springs of attachments, which are extended at rest, and by the
    bones. Bones press where the muscle touches them or is within ``support`` of them (``contact``), through the tissue in between.

    ``stretch``: without unit, above 1 if fibres are taut at rest; 1 if only an activation acts at rest.
    Source: Maas, Erdemir, Halloran and Weiss 2016, doi 10.1016/j.jmbbm.2016.04.012, who find a prestrain in equilibrium with this
    stretch by iteration; here its incompatible part is a constant stress, found by one linear problem.
    """

    needs: ClassVar[tuple[str, ...]] = ("fibre",)
    example: ClassVar[dict[str, Any]] = {"stretch": 1.1}
    stretch: float = Field(gt=0)

    def elastic(self, state: State) -> Sequence[Sequence[Any]]:
        return state.stretched(self.stretch)


def among(acting: Iterable[object]) -> InSitu | None:
    """The tension at rest among the effects of a scene, None if there is none."""
    return next((effect for effect in acting if isinstance(effect, InSitu)), None)


def moduli_of(effects: Sequence[Effect]) -> tuple[float, float]:
    """The shear and bulk modulus [MPa] at rest of ``effects``; without a bulk modulus, ten times the shear modulus."""
    found = moduli(effects)
    return found.shear, found.bulk or 10 * found.shear


def balancing(state: State, slopes: Sequence[Sequence[Any]], pressure: Any, shear: Any) -> Any:
    """The energy per unit rest volume [MPa] of the stress at rest at ``state``, whose F is the total deformation gradient; ``e`` is
    the symmetric part of ``slopes`` (3, 3), mu the modulus ``shear`` [MPa] and p0 the ``pressure`` [MPa].
    """
    C, mean = state.C, sum(slopes[i][i] for i in range(3)) / 3
    strained = sum((slopes[i][k] + slopes[k][i]) / 2 * (C[i][k] - (i == k)) for i in range(3) for k in range(3))
    return shear * (strained - mean * (state.I1 - 3)) + pressure * (state.J - 1)
