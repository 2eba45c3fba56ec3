"""Best fits of laws to measurements of cubes of muscle, to show how well each law can match them. No shipped case uses a fit."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from fem_reference.assessment.credibility import Fitted
from fem_reference.assessment.experiments import find
from fem_reference.assessment.muscle_cubes import FIBRES, LOOCKE, QUANTITIES, SHIPPED, Material, Quantity, with_collagen
from fem_reference.effects import make
from fem_reference.foundations.mesh import Floats

Parameters = Mapping[str, tuple[float, tuple[float, float] | None]]
_STEP = 1e-4  # the step of finite differences in a parameter's logarithm, far above the error of root finding, 1e-8
_MOST = 100  # the maximum number of evaluations of a fit; these fits converge within 30
_SHEAR = SHIPPED[0].parameters[0][1]


@dataclass(frozen=True)
class _Ended:
    """The result of a fit: its parameters, whether it converged, and its number of evaluations."""

    parameters: tuple[float, ...]
    converged: bool
    evaluations: int


def shipped_law() -> Fitted:
    """Fit the shipped law to the measurements of Van Loocke et al. Only the shear modulus of the matrix is fitted, because ratios
    of stresses do not change if fibres and matrix are scaled together.
    """
    to = [one for one in QUANTITIES if one.experiment == LOOCKE and not one.is_order]
    ended = _fitted(lambda values: _shipped(*values), to, (_SHEAR,))
    (shear,) = ended.parameters
    prior = find("bosboom_2001", "ogden_mu", "")
    assert prior.sd is not None  # this fact has a standard deviation
    published = ((prior.value - prior.sd) / 1000, (prior.value + prior.sd) / 1000)  # MPa
    return _of("fibres in tension only", {"shear modulus [MPa]": (shear, published)}, _shipped(shear), to, ended)


def collagen_law(most: int = _MOST) -> Fitted:
    """Fit the law with collagen across the fibres to all quantities except rankings, which have no derivative. ``most``: the
    maximum number of evaluations. Only the stress of the fibres has a published range: we know of no published ``k1`` and ``k2``.
    """
    to = [one for one in QUANTITIES if not one.is_order]
    ended = _fitted(lambda values: with_collagen(*values), to, (FIBRES["stress"] / 2, 0.1, 10.0), most)
    fibres, k1, k2 = ended.parameters
    ends = type(SHIPPED[2]).published["stress"]
    low, high = (
        float(make("fibre_passive", **(FIBRES | {"stress": end})).parameters[0][1]) for end in (ends.low, ends.high)
    )
    parameters = {"stress of the fibres [MPa]": (fibres, (low, high)), "k1 [MPa]": (k1, None), "k2": (k2, None)}
    return _of("with collagen across the fibres", parameters, with_collagen(fibres, k1, k2), to, ended)


def _of(law: str, parameters: Parameters, material: Material, to: Sequence[Quantity], ended: _Ended) -> Fitted:
    values = {one.name: one.of(material) for one in QUANTITIES}
    return Fitted(law, parameters, values, tuple(one.name for one in to), ended.converged, ended.evaluations)


def _shipped(shear: float) -> Material:
    return (make("neo_hooke", mu=shear), *SHIPPED[1:])


def _fitted(
    material: Callable[[Sequence[float]], Material], to: Sequence[Quantity], start: Sequence[float], most: int = _MOST
) -> _Ended:
    """The positive parameters with which ``material`` fits the quantities ``to`` best, found by iteration from ``start``."""

    def misses(logs: Floats) -> list[float]:
        made = material([float(one) for one in np.exp(logs)])
        return [(one.of(made) - one.truth) / one.within for one in to]

    found = least_squares(misses, np.log(start), diff_step=_STEP, max_nfev=most, xtol=1e-6, ftol=1e-6)
    return _Ended(tuple(float(one) for one in np.exp(found.x)), bool(found.success), int(found.nfev))
