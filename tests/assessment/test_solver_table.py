"""Table 5.1 of the report, and the results of solvers over frames and scenes."""

import numpy as np

from fem_reference.assessment import solver_table
from fem_reference.assessment.solver_table import Overall, Scenario, SolverKind, SolverResult, Table
from fem_reference.metrics import Measure
from fem_reference.runs.store import Outcome

KIND = SolverKind(name="PBD", form="Surface model", speed="++", precision="?", literature="[62]")


def result(case: str, *values: float, seconds: float | None = 0.01) -> SolverResult:
    measures = (Measure("surface_deviation", "rms", "mm", np.array(values)),)
    numbers = tuple(10 * i for i in range(len(values)))
    return SolverResult("PBD", "pbd", "pbd", case, Outcome("converged", ""), seconds, measures, numbers, "")


def test_the_worst_frame_of_each_scene_counts_and_their_median() -> None:
    scenarios = tuple(Scenario(name, name, size, 50.0, Outcome("converged", "")) for name, size in (("a", 9), ("b", 5)))
    found = (result("a", 1.0, -7.0, 3.0), result("b", 2.0, 2.5, seconds=None))
    made = Table((KIND,), scenarios, found, {}, {}, ())
    assert found[0].worst("surface_deviation", "rms") == (-7.0, 10)
    assert found[0].worst("volume", "deviation") is None
    assert made.over("PBD", "pbd", "surface_deviation", "rms") == Overall(4.75, -7.0, "a", 2)
    assert made.over("PBD", "nobody", "surface_deviation", "rms") is None
    assert made.speed("PBD", "pbd") == (scenarios[0], 0.01)
    assert (made.names("PBD"), made.of("PBD", "b")) == (["pbd"], [found[1]])
    assert made.rankings("a") == ()  # without error bars nobody is ranked


def test_the_rows_are_those_of_the_report() -> None:
    # Table 5.1: algorithm, form, speed, precision.
    assert [(row.name, row.form, row.speed, row.precision) for row in solver_table.solver_kinds()] == [
        ("Hill-type", "Single line", "+++", "---"),
        ("Via-points", "Polyline", "++", "--"),
        ("Wrap. obst.", "Complex curve", "+", "-"),
        ("FEM", "Volumetric model", "---", "+++"),
        ("MSS", "Volumetric model", "++", "-"),
        ("ARAP", "Surface model", "++", "?"),
        ("PBD", "Surface model", "++", "?"),
        ("Implicit RBF", "Implicit surface", "", ""),  # ours: its goal in section 7.1
        ("VIPER", "Bundle of rods", "", ""),  # ours: a decomposition of section 6.1.2
    ]
    assert solver_table.report_speeds()["gluteus_medius"].per_second == 57.12  # Table 6.1
