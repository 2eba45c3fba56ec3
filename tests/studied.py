"""Points of error and cost that were measured on several cases."""

from fem_reference.assessment.fronts import Point

ERROR, COST = "surface_deviation.rms", "seconds_per_frame"


def point(
    error: float, cost: float, solver: str = "pbd", case: str = "hip", value: str = "", status: str = "converged"
) -> Point:
    found = {"errors": {ERROR: error}, "costs": {COST: cost}}
    return Point(case, solver, solver, "sweeps" if value else "", value, {"sweeps": value}, status, "", **found)
