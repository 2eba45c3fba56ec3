"""Statistics of a state that a run stores as scalars of a frame: means and quantiles of stresses over the volume; the volume."""

import numpy as np

from fem_reference.foundations.mesh import Floats, TetMesh, tet_volumes
from fem_reference.runs.results import Results
from fem_reference.runs.states import NodalState

# Statistics by kind of stress; no maximum, which grows without bound at the rim of an attachment as tetrahedra get smaller.
STATISTICS = {"along_fibres": ("mean", "p95"), "von_mises": ("mean", "p95"), "pressure": ("mean", "p05", "p95")}
_MOST = 8192  # the most tetrahedra that are evaluated, evenly spread
# Barycentric coordinates of four points with equal weights: exact to degree 2 (Hammer and Stroud 1956).
_NEAR = (5 - 5**0.5) / 20
_POINTS = np.full((4, 4), _NEAR) + (1 - 4 * _NEAR) * np.eye(4)
# Points and weights of a rule that is exact to degree 3 (Keast 1986, table 1).
_CUBIC, _WEIGHTS = np.vstack([np.full((4, 4), 1 / 6) + np.eye(4) / 3, np.full(4, 1 / 4)]), np.array([*[0.45] * 4, -0.8])


def stress_scalars(results: Results, frame: float) -> dict[str, float]:
    """The mean and quantiles [MPa] over the volume at rest by name. ``stress_von_mises_p95``, for example, is not exceeded in 95 %
    of the volume. At four points of each tetrahedron the Cauchy stress gives its component along the fibres, if these are known,
    the von Mises stress, and the pressure ``-tr sigma / 3``, above 0 in compression. NaN if a tetrahedron is inside out.
    """
    mesh = results.mesh
    tets = np.unique(np.linspace(0, len(mesh.tets) - 1, _MOST).astype(int))
    own = {"along_fibres": "fibre_stress"} if results.fibre is not None else {}
    wanted = (*own.values(), "von_mises", "cauchy_stress")
    found = results.evaluate_in(np.repeat(tets, len(_POINTS)), np.tile(_POINTS, (len(tets), 1)), frame, wanted)
    values = {name: found[key] for name, key in own.items()} | {"von_mises": found["von_mises"]}
    values["pressure"] = -np.trace(found["cauchy_stress"], axis1=1, axis2=2) / 3
    volumes = np.repeat(tet_volumes(mesh.points, mesh.tets[tets]), len(_POINTS))
    return {
        f"stress_{name}_{statistic}": _of(statistic, each, volumes)
        for name, each in values.items()
        for statistic in STATISTICS[name]
    }


def volume_ratio(mesh: TetMesh, state: NodalState) -> float:
    """The volume of a mesh in a ``state``, relative to rest; exact, as det F of a quadratic displacement is of degree 3."""
    tets, count = np.arange(len(mesh.tets)), len(_CUBIC)
    places = np.repeat(tets, count), np.tile(_CUBIC, (len(tets), 1))
    found = Results(mesh, (), {0: state}).evaluate_in(*places, 0, ("det_F",))["det_F"]
    volumes = tet_volumes(mesh.points, mesh.tets)
    return float(volumes @ found.reshape(-1, count) @ _WEIGHTS / volumes.sum())


def _of(statistic: str, values: Floats, volumes: Floats) -> float:
    """The mean or a quantile, such as ``p95``, of ``values`` (n,) in ``volumes`` (n,)."""
    if not np.isfinite(values).all():
        return float("nan")
    if statistic == "mean":
        return float(volumes @ values / volumes.sum())
    return float(np.quantile(values, int(statistic[1:]) / 100, weights=volumes, method="inverted_cdf"))
