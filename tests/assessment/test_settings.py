"""Settings that are the same on several cases: tetrahedra by their size in that of each case, and not in mm."""

from fem_reference.assessment.cost_study import CaseStudy
from fem_reference.assessment.fronts import Point
from fem_reference.assessment.settings import is_elsewhere, setting, tetrahedra


def point(**choice) -> Point:
    return Point("bar", "fenicsx", "fenicsx", "knob", "value", {"solver": "fenicsx"} | choice, "converged", "")


def study(tet_size: float, refinements: float) -> CaseStudy:
    features = {"tet_size": tet_size, "refinements": refinements}
    return CaseStudy("bar", "A bar", "its reference", (), {}, {}, (), 100, 1.0, features)


def on(size: float, refinements: int) -> Point:
    return point(scene={"muscle.tet_size": f"{size} mm", "muscle.refinements": refinements})


def test_tetrahedra_count_by_their_size_in_that_of_the_case() -> None:
    assert tetrahedra(on(12.0, 0), study(6.0, 1.0)) == (2.0, 1.0)
    assert setting(on(12.0, 0), study(6.0, 1.0)) == setting(on(8.0, 1), study(4.0, 2.0))
    assert setting(on(12.0, 0), study(6.0, 1.0)) != setting(on(12.0, 0), study(4.0, 1.0))


def test_values_of_a_scene_are_its_own_but_for_its_mesh() -> None:
    assert is_elsewhere(point(iterations=4))
    assert is_elsewhere(on(8.0, 1))
    assert is_elsewhere(point(scene={"triangles": "4 times"}))
    own = point(scene={"effect[0].mu": "10 kPa"})
    assert not is_elsewhere(own)
    assert setting(own, study(6.0, 1.0)) == "bar: knob = value"


def test_settings_are_named_in_one_order() -> None:
    one, other = point(iterations=4, first=1.0), point(first=1.0, iterations=4)
    assert setting(one, study(6.0, 1.0)) == setting(other, study(4.0, 1.0)) == "fenicsx: first = 1.0, iterations = 4"
    assert setting(point(scene={"triangles": "4 times"}), study(6.0, 1.0)).startswith(
        "fenicsx: 4 times as many triangles"
    )
