"""Runs of scalar problems and how they are stored: ``run.json`` and ``field.vtu``, which opens in ParaView."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fem_reference.foundations.mesh import Floats
from fem_reference.io import files
from fem_reference.problems.scalar import FieldProblem
from fem_reference.runs.store import Outcome


@dataclass(frozen=True, eq=False)
class Solution:
    """``values`` (N,) of the field at the nodes (the vertices, then for order 2 the middles of ``mesh.edges``), and how it ended.

    ``components`` (n, d): the vector that the values are the norm of, where a solver computes one. After a failure the values are
    not-a-number. ``form``: the weak form that was solved, None where it is the problem's own.
    """

    values: Floats
    outcome: Outcome
    components: Floats | None = None
    form: str | None = None


@dataclass(frozen=True, eq=False)
class FieldRun:
    """A solution of a ``problem`` with its ``name``, ``solver`` and ``origin``."""

    name: str
    solver: str
    problem: FieldProblem
    solution: Solution
    origin: dict[str, Any] = field(default_factory=dict)
    folder: Path | None = None

    @property
    def form(self) -> str:
        """Which weak form was solved: galerkin, supg, or what the solver says."""
        return self.solution.form or ("galerkin" if self.problem.tau is None else "supg")

    @property
    def vertex_values(self) -> Floats:
        """The field at the vertices (n,)."""
        return self.solution.values[: len(self.problem.mesh.points)]


def write(run: FieldRun, folder: Path) -> None:
    """Store a run: the mesh with point data ``psi`` (and ``components``) first, then what is to be said of it."""
    folder.mkdir(parents=True, exist_ok=True)
    mesh = run.problem.mesh
    data = {"psi": run.vertex_values}
    if run.solution.components is not None:
        data["components"] = run.solution.components
    files.write_field(folder / "field.vtu", mesh.points, mesh.cells, data)
    outcome = run.solution.outcome
    state = {
        "name": run.name,
        "solver": run.solver,
        "status": outcome.status,
        "message": outcome.message,
        "cost": outcome.cost,
        "nodes": len(run.solution.values),
        "mesh_peclet": run.problem.peclet,
        "form": run.form,
        "origin": run.origin,
    }
    files.write_text(folder / "run.json", json.dumps(state, indent=1, allow_nan=False))
