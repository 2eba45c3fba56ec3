"""Settings of solvers, identified across cases whose tetrahedra differ in size."""

from fem_reference.assessment.cost_study import CaseStudy
from fem_reference.assessment.fronts import TETRAHEDRA, Point


def setting(point: Point, study: CaseStudy) -> str:
    """A key that identifies a setting across cases; tetrahedra count by their size relative to the case's own reference."""
    scene = point.choice.get("scene", {})
    if not is_elsewhere(point):
        return f"{study.case}: {point.label}"
    if "triangles" in scene:
        return f"{point.solver}: {scene['triangles']} as many triangles, {_settings(point)}"
    if scene:
        factor, fewer = tetrahedra(point, study)
        return f"{point.solver}: tetrahedra {factor:.3g}, {fewer:g} refinements fewer, {_settings(point)}"
    return f"{point.solver}: {_settings(point)}"


def is_elsewhere(point: Point) -> bool:
    """True where a setting can be used on another case: only mesh keys of a scene are transferable."""
    return not set(point.choice.get("scene", {})) - {*TETRAHEDRA, "triangles"}


def tetrahedra(point: Point, study: CaseStudy) -> tuple[float, float]:
    """The size of a point's tetrahedra relative to the case's own before refinement, and its difference in refinements."""
    scene = point.choice["scene"]
    size = float(str(scene["muscle.tet_size"]).removesuffix(" mm"))
    return size / study.features["tet_size"], study.features["refinements"] - scene["muscle.refinements"]


def _settings(point: Point) -> str:
    own = {name: value for name, value in point.choice.items() if name not in ("scene", "solver", "name")}
    return ", ".join(f"{name} = {value}" for name, value in sorted(own.items(), key=str))
