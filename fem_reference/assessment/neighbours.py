"""Penetration of muscles into each other: a check of the solved tetrahedra, and a measure for the surfaces of any run."""

from collections.abc import Callable, Iterator, Mapping
from itertools import combinations

import numpy as np

from fem_reference.assessment.run_checks import ROUNDING, Nodes, RunCheck, RunChecks, worst
from fem_reference.foundations.mesh import Floats, Surface, TetMesh, boundary, place_of
from fem_reference.geometry.interpenetration import penetration, skin_of
from fem_reference.geometry.quadratic import EDGES, Displaced
from fem_reference.geometry.skins import edge_lengths, quartered
from fem_reference.problems.joining import called
from fem_reference.problems.muscles import MusclesProblem
from fem_reference.problems.touching import pressure_name
from fem_reference.runs.store import Run

# The allowed gap between the curved facets of pressed tetrahedra and the flat triangles between their corners, as a fraction of an
# edge. Such gaps decrease with the square of the size of the triangles.
_BULGE = 0.05
# The triangles that replace each curved facet, in barycentric coordinates of the facet.
_PIECES = quartered(quartered(np.eye(3)[None])).reshape(-1, 3)
Displacement = Callable[[int], Floats | None]


def between(problem: MusclesProblem, run: Run, nodes: Nodes, states: Displacement = lambda _: None) -> RunChecks:
    """Check that no muscle is inside another, if contact acts or was omitted because it is not needed.

    Penetration due to the compliance of contact and the bulge of facets is allowed. ``nodes``: the positions of the corners of
    the tetrahedra by frame number; the check fails if they are not stored. ``states``: the displacement (m, 10, 3) [mm] by frame
    number. If it is known and muscles press on each other, the curved facets are checked, each as 16 triangles.
    """
    if not problem.apart:
        return ()
    checks, none = list[RunCheck](), np.zeros(len(run.numbers))
    alone = run.scalars.get("touching_pressure", none) if len(problem.pairs) == 1 else none
    for pair in combinations(problem.spans, 2):
        own = pressure_name(*(called(span.name, "free") for span in pair))
        touch = (pair[0].name, pair[1].name) in problem.pairs
        pressures = run.scalars.get(own, alone) if touch else none
        pressures = np.where(np.isfinite(pressures), pressures, 0.0)
        skins = [skin_of(problem.problems[span.name].mesh) for span in pair]
        edge = max(float(edge_lengths(one.points[one.triangles]).max()) for one in skins)
        law = problem.law
        name = f"penetration of {pair[0].name} and {pair[1].name} into each other"
        for i, number in enumerate(run.numbers):
            give = 0.0 if law is None else float(pressures[i]) / law.stiffness + law.smoothing
            bulge = _BULGE * edge if pressures[i] > 0 else 0.0
            allowed = ROUNDING * edge + give + bulge
            if (now := nodes(number)) is None:
                checks.append(RunCheck(f"{name} (no tetrahedra are stored)", np.nan, allowed, "mm", number))
                continue
            surfaces = [one.moved_to(now[span.points]) for one, span in zip(skins, pair, strict=True)]
            known = states(number) if bulge else None
            if known is not None and known.shape[1] == 10:
                surfaces = [_curved(problem.problems[span.name].mesh, known[span.cells]) for span in pair]
                allowed -= 15 / 16 * bulge
            depth, place = penetration(*surfaces)
            checks.append(RunCheck(name, depth, allowed, "mm", number, place_of(place)))
    return worst(checks)


def _curved(mesh: TetMesh, displacement: Floats) -> Surface:
    """The boundary of a ``mesh`` with a quadratic ``displacement`` (m, 10, 3) [mm], as 16 triangles for each facet."""
    facets, cells = boundary(mesh.tets)
    corners = np.eye(4)[(facets[:, :, None] == mesh.tets[cells][:, None]).argmax(axis=2)]
    at = np.einsum("sc,fcb->fsb", _PIECES, corners)  # in barycentric coordinates of the tetrahedron
    shapes = np.concatenate([at * (2 * at - 1), 4 * at[..., EDGES].prod(axis=-1)], axis=-1)
    points = shapes @ Displaced(mesh, displacement).nodes[cells]
    return Surface(points.reshape(-1, 3), np.arange(points.size // 3).reshape(-1, 3))


def depths(runs: Mapping[str, Run]) -> Iterator[tuple[str, str, Floats]]:
    """Both names and the depth of overlap (f,) [mm] for each pair of muscles in ``runs``; NaN in frames with unknown positions."""
    for one, other in combinations(runs, 2):
        found = list[float]()
        for a, b in zip(runs[one].positions, runs[other].positions, strict=True):
            known = np.isfinite(a).all() and np.isfinite(b).all()
            surfaces = (runs[one].surface.moved_to(a), runs[other].surface.moved_to(b)) if known else None
            found.append(penetration(*surfaces)[0] if surfaces else np.nan)
        yield one, other, np.array(found)
