"""Statistics of a state that are stored as scalars of a frame: means and quantiles of stress over the volume, and the volume."""

import numpy as np

from fem_reference.foundations.mesh import Floats, TetMesh, tet_volumes
from fem_reference.runs.results import Results
from fem_reference.runs.states import NodalState

# Statistics by kind of stress. There is no maximum, as it grows without bound at the border of an attachment under refinement.
STATISTICS = {"along_fibres": ("mean", "p95"), "von_mises": ("mean", "p95"), "pressure": ("mean", "p05", "p95")}
_MOST = 8192  # the maximum number of tetrahedra that are evaluated, evenly spread over the mesh
# The barycentric coordinates of a rule of four points with equal weights, which is exact to degree 2 (Hammer and Stroud 1956).
_NEAR = (5 - 5**0.5) / 20
_POINTS = np.full((4, 4), _NEAR) + (1 - 4 * _NEAR) * np.eye(4)
# The points and weights of a rule that is exact to degree 3 (Keast 1986, table 1).
_CUBIC, _WEIGHTS = np.vstack([np.full((4, 4), 1 / 6) + np.eye(4) / 3, np.full(4, 1 / 4)]), np.array([*[0.45] * 4, -0.8])


def stress_scalars(results: Results, frame: float) -> dict[str, float]:
    """Means and quantiles [MPa] of stresses over the volume at rest, by name; NaN if a tetrahedron is inverted.

    For example, 95 % of the volume has a von Mises stress of at most ``stress_von_mises_p95``. The stresses are evaluated at four
    points in each tetrahedron: the von Mises stress, the pressure ``-tr sigma / 3``, which is positive in compression, and, if
    fibre directions are known, the component of the Cauchy stress along the fibres.
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
    """The volume of a mesh in a ``state`` divided by that at rest; exact, as det F of a quadratic displacement has degree 3."""
    tets, count = np.arange(len(mesh.tets)), len(_CUBIC)
    places = np.repeat(tets, count), np.tile(_CUBIC, (len(tets), 1))
    found = Results(mesh, (), {0: state}).evaluate_in(*places, 0, ("det_F",))["det_F"]
    volumes = tet_volumes(mesh.points, mesh.tets)
    return float(volumes @ found.reshape(-1, count) @ _WEIGHTS / volumes.sum())


def _of(statistic: str, values: Floats, volumes: Floats) -> float:
    """The mean, or a quantile such as ``p95``, of ``values`` (n,) with ``volumes`` (n,) as weights."""
    if not np.isfinite(values).all():
        return float("nan")
    if statistic == "mean":
        return float(volumes @ values / volumes.sum())
    return float(np.quantile(values, int(statistic[1:]) / 100, weights=volumes, method="inverted_cdf"))
