"""The reference's scalar fields: as the independent assembly has them, and a status where there are none."""

import importlib
import importlib.util
import sys

import fields
import numpy as np
import pytest

from fem_reference.foundations.errors import MissingSoftware
from fem_reference.problems.scalar import FieldProblem, build
from fem_reference.solvers import fenicsx
from fem_reference.solvers.fenicsx import FieldSettings, field

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx")),
        reason="FEniCSx is not installed",
    ),
]


def resonant(tmp_path) -> FieldProblem:
    """-psi'' = rate psi on three nodes of [0, 1], fixed on the left, at the rate of the mode sin(pi x / 2), which can then be
    added.

    Of linear elements of length h the mode sin(k x) has the rate 6 / h^2 (1 - cos kh) / (2 + cos kh).
    """
    cosine = np.cos(np.pi / 4)
    scene = fields.scene(
        tmp_path,
        domain={"nodes": [0.0, 0.5, 1.0]},
        effect=[
            {"name": "diffusion", "coefficient": 1.0},
            {"name": "reaction", "rate": float(-24 * (1 - cosine) / (2 + cosine))},
        ],
        boundary=[{"on": "left", "value": 1.0}],
    )
    return build(scene)


def solved_by(program: str, settings: FieldSettings, tmp_path, monkeypatch):
    """What becomes of three nodes where the process that solves runs another ``program``."""
    monkeypatch.setattr(field, "present", lambda: None)
    session = importlib.import_module(
        "fem_reference.solvers.fenicsx.session"
    )  # the package has a function of this name
    monkeypatch.setattr(session, "command", lambda *_: [sys.executable, "-c", program])
    return fenicsx.solve_field(resonant(tmp_path), settings)


def test_a_process_that_dies_is_a_status(tmp_path, monkeypatch) -> None:
    solution = solved_by("import sys; sys.exit('no memory')", FieldSettings(), tmp_path, monkeypatch)
    assert solution.outcome.status == "crashed"
    assert "exit status 1 (no memory); 0 fields are kept" in solution.outcome.message
    assert solution.values[0].shape == (3,)
    assert np.isnan(solution.values).all()


def test_a_time_limit_is_a_status(tmp_path, monkeypatch) -> None:
    limit = FieldSettings.model_validate({"time_limit": "0.5 s"})
    solution = solved_by("while True: pass", limit, tmp_path, monkeypatch)
    assert solution.outcome.status == "timed out"
    assert np.isnan(solution.values).all()


def test_missing_software_is_named(tmp_path, monkeypatch) -> None:
    problem = resonant(tmp_path)
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    for wants in (fenicsx.require, lambda settings: fenicsx.solve_field(problem, settings)):
        with pytest.raises(MissingSoftware, match=r"pip install 'fem_reference\[fenicsx\]'"):
            wants(FieldSettings())
