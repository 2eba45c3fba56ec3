"""Stresses by the energies of effects, differentiated by ``jets``, independently of any solver."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fem_reference.effects import Effect, Energy, Prestrain, State, elastic_state, total_energy
from fem_reference.foundations.jets import Jet, JetFunctions, variables
from fem_reference.foundations.mesh import Floats, Ints, TetMesh, edge_vectors, tet_volumes

Acting = Sequence[tuple[Effect, float]]

# The tetrahedra that are sampled, evenly spread, and the places evaluated at once, so that their jets fit in a cache.
_MOST, AT_ONCE = 2048, 1024
_SMALLEST = 0.05  # det F of tetrahedra that are looked at: between their corners what is curved may turn inside out


def first_piola(acting: Acting, state: State, count: int) -> Floats:
    """``dW/dF`` (count, 3, 3) [MPa], W the sum of the energies per rest volume of what is ``acting``, (effect, amount) each, at a
    ``state`` whose F are the jets.
    """
    energy = total_energy(acting, state)
    slope = energy.slope if isinstance(energy, Jet) else np.zeros((9, 1))
    return np.asarray(np.broadcast_to(slope.reshape(9, -1), (9, count)).T.reshape(count, 3, 3))


def kirchhoff(acting: Acting, F: Floats, fibre: Floats | None) -> Floats:
    """The Kirchhoff stress ``dW/dF F^T`` (n, 3, 3) [MPa] of what is ``acting`` at deformation gradients ``F`` (n, 3, 3) with
    fibres along ``fibre`` (n, 3), without the pressure of the mixed form and without what time makes.
    """
    found = np.zeros(F.shape)
    for start in range(0, len(F), AT_ONCE):
        some = slice(start, start + AT_ONCE)
        jets = variables(F[some].reshape(-1, 9).T)
        along = None if fibre is None else list(fibre[some].T)
        state = State([jets[0:3], jets[3:6], jets[6:9]], pressure=0.0, fibre=along, functions=JetFunctions())
        with np.errstate(all="ignore"):  # what is no number is needed
            found[some] = first_piola(acting, state, len(F[some])) @ np.swapaxes(F[some], 1, 2)
    return found


@dataclass(frozen=True)
class StressSizes:
    """Sizes of stresses [MPa] in a state, root mean square over the volume: of what ``acts``, without its share of pressure, and
    what each of others would add to that, ``added``; and the smallest and the greatest ``stretch`` of fibres. NaN where no
    tetrahedron has a positive volume.
    """

    acts: float
    added: tuple[float, ...]
    stretch: tuple[float, float]


class StressSamples:
    """Tetrahedra of a ``mesh``, with the unit vectors ``fibre`` (m, 3) along their fibres: stresses of states of their points."""

    def __init__(self, mesh: TetMesh, fibre: Floats | None) -> None:
        chosen = np.unique(np.linspace(0, len(mesh.tets) - 1, _MOST).astype(int))
        self.tets: Ints = mesh.tets[chosen]
        self.inverse = np.linalg.inv(edge_vectors(mesh.points[self.tets]))
        self.volumes = tet_volumes(mesh.points, self.tets)
        self.fibre = None if fibre is None else fibre[chosen]

    def sizes(self, positions: Floats, acting: Acting, others: Acting) -> "StressSizes":
        """The sizes for what is ``acting``, and for each of the ``others`` on top, where the points are at ``positions`` (n, 3)."""
        F = edge_vectors(positions[self.tets]) @ self.inverse
        good = np.linalg.det(F) > _SMALLEST
        if not good.any():
            return StressSizes(np.nan, (np.nan,) * len(others), (np.nan, np.nan))
        F, volumes, fibre = F[good], self.volumes[good], None if self.fibre is None else self.fibre[good]
        now = kirchhoff(acting, F, fibre)
        added = [_added(acting, one, now, lambda terms: kirchhoff(terms, F, fibre)) for one in others]
        shear = now - np.trace(now, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
        return StressSizes(
            _mean(shear, volumes), tuple(_mean(one, volumes) for one in added), _stretches(acting, F, fibre, volumes)
        )


def _added(acting: Acting, one: tuple[Effect, float], now: Floats, stress: Callable[[Acting], Floats]) -> Floats:
    """The change by an effect of the stress ``now`` (n, 3, 3) of what is ``acting``: an energy its own, in what is prestretched."""
    if isinstance(one[0], Energy):
        return stress([*(other for other in acting if isinstance(other[0], Prestrain)), one])
    return stress([*acting, one]) - now if isinstance(one[0], Prestrain) else np.zeros(now.shape)


def _stretches(acting: Acting, F: Floats, fibre: Floats | None, volumes: Floats) -> tuple[float, float]:
    """The smallest and the greatest stretch of fibres that energies see, but for a hundredth of the volume each."""
    if fibre is None:
        return 1.0, 1.0
    state = elastic_state(acting, State([list(row) for row in np.moveaxis(F, 0, -1)], fibre=list(fibre.T)))
    low, high = np.quantile(state.fibre_stretch, (0.01, 0.99), weights=volumes, method="inverted_cdf")
    return float(low), float(high)


def _mean(stress: Floats, volumes: Floats) -> float:
    """The root mean square of the Frobenius norm."""
    return float(np.sqrt(((stress**2).sum(axis=(1, 2)) * volumes).sum() / volumes.sum()))
