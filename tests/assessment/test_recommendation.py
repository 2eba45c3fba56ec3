"""Recommendations: measured where the case was studied, else from the cases most like it, with margins found by leaving each
out.
"""

import json
from dataclasses import replace

import pytest

from fem_reference.assessment.cost_study import CaseStudy, facts, load
from fem_reference.assessment.fronts import Point
from fem_reference.assessment.recommendation import recommend
from fem_reference.foundations.errors import InputError

RMS, TIME, PERCENT = "surface_deviation.rms", "seconds_per_frame", "fibre_length.rms_percent"
SETTINGS = (
    (1, 0.2, 0.001),
    (3, 0.1, 0.003),
    (10, 0.02, 0.01),
)  # sweeps, error over motion, time of a frame of 1000 triangles


def features(motion: float, triangles: float = 1000) -> dict[str, float]:
    return {
        "size": 200.0,
        "triangles": triangles,
        "motion": motion,
        "contact": 1.0,
        "bulk_to_shear": 1000.0,
        "fibres_to_shear": 30.0,
        "tet_size": 10.0,
        "refinements": 1.0,
    }


def study(case: str, motion: float, triangles: float = 1000, bar: float = 0.0) -> CaseStudy:
    """A case on which errors are those shares of its motion and times in proportion to its triangles."""
    points = tuple(
        Point(
            case,
            "pbd",
            "pbd",
            "sweeps",
            str(sweeps),
            {"solver": "pbd", "sweeps": sweeps},
            "converged",
            "",
            {RMS: share * motion},
            {TIME: time * triangles / 1000},
        )
        for sweeps, share, time in SETTINGS
    )
    known = {RMS: bar}
    return CaseStudy(
        case, case, "made up", points, {RMS: "mm"}, known, (), int(triangles), motion, features(motion, triangles)
    )


def test_the_values_of_a_scene_are_recommended_on_no_other_case() -> None:
    known = study("a", 50)
    softer = replace(known.points[-1], choice={"solver": "pbd", "scene": {"effect[1].stiffness": "1 MPa/mm"}})
    better = replace(softer, errors={RMS: 0.001}, knob="contact stiffness")
    known = replace(known, points=(*known.points, better))
    assert recommend(features(50), "a", [known], RMS, {"error": 0.5}).best.point is better
    assert recommend(features(50), "new", [known], RMS, {"time": 1.0}).best.point is known.points[2]
    assert recommend(features(50), "new", [known], RMS, {"error": 0.5}).best is None


STUDIES = [study("a", 50), study("b", 80, 3000), study("c", 120, 2000)]


def test_the_cheapest_that_meets_the_error_is_taken_on_a_studied_case() -> None:
    found = recommend(features(50), "a", STUDIES, RMS, {"error": 6.0})
    assert found.best is not None
    assert found.best.point.choice["sweeps"] == 3
    assert found.best.error == pytest.approx(5.0)
    assert found.of == ("a",)


def test_what_is_not_known_of_the_truth_counts_as_error() -> None:
    found = recommend(features(50), "a", [study("a", 50, bar=2.0)], RMS, {"error": 6.0})
    assert found.best is not None
    assert found.best.point.choice["sweeps"] == 10


def test_the_truth_itself_is_recommended_where_it_alone_is_good_enough() -> None:
    about = ("a", "fenicsx", "reference", "", "", {"solver": "fenicsx"}, "converged", "")
    known = study("a", 50, bar=0.5)
    known = replace(known, points=(*known.points, Point(*about, {}, {TIME: 2.0})))
    found = recommend(features(50), "a", [known], RMS, {"error": 0.6})
    assert found.best is not None
    assert (found.best.point.label, found.best.error) == ("reference, as it is", 0.5)
    assert recommend(features(50), "a", [known], RMS, {"error": 0.4}).best is None


def test_a_case_that_was_changed_since_is_not_taken_for_measured() -> None:
    found = recommend(features(60), "a", [study("a", 50)], RMS, {"error": 1e9})
    assert not found.measured
    assert found.margins.error == 2.0
    assert recommend(features(50), "a", [study("a", 50)], RMS, {"error": 1e9}).measured


def test_the_nearest_within_the_time_is_taken() -> None:
    found = recommend(features(50), "a", STUDIES, RMS, {"time": 0.004})
    assert found.best is not None
    assert found.best.point.choice["sweeps"] == 3


def test_another_case_is_expected_to_scale_with_motion_and_triangles() -> None:
    # Errors follow the motion and times the triangles exactly, so that no margin is needed: 0.1 * 60 mm in 0.003 * 4 s.
    found = recommend(features(60, 4000), "new", STUDIES, RMS, {"error": 6.5})
    assert found.best is not None
    assert found.margins.error == pytest.approx(1.0)
    assert (found.best.error, found.best.time) == pytest.approx((6.0, 0.012))


def test_a_case_that_errs_more_than_the_others_widens_the_margin() -> None:
    worse = study("d", 50)
    doubled = tuple(Point(**(vars(one) | {"errors": {RMS: 2 * one.errors[RMS]}})) for one in worse.points)
    found = recommend(
        features(60), "new", [*STUDIES, CaseStudy(**(vars(worse) | {"points": doubled}))], RMS, {"error": 1e9}
    )
    assert found.margins.error == pytest.approx(2.0, rel=0.1)


def changed(one: CaseStudy, *, errors: float = 1.0, times: float = 1.0) -> CaseStudy:
    """The study with so many times the errors and times."""
    points = tuple(
        replace(point, errors={RMS: errors * point.errors[RMS]}, costs={TIME: times * point.costs[TIME]})
        for point in one.points
    )
    return replace(one, points=points)


def test_a_case_that_errs_less_than_the_others_widens_no_margin() -> None:
    # Left out, it has half of what the others let expect; of these each has exactly that, as the worst of the others counts.
    for better in (changed(study("d", 50), errors=0.5), changed(study("d", 50), times=0.5)):
        found = recommend(features(60), "new", [*STUDIES, better], RMS, {"error": 1e9})
        assert (found.margins.error, found.margins.time) == pytest.approx((1.0, 1.0))


def test_a_case_that_takes_longer_than_the_others_widens_the_margin_of_time() -> None:
    found = recommend(features(60), "new", [*STUDIES, changed(study("d", 50), times=3.0)], RMS, {"error": 1e9})
    assert (found.margins.error, found.margins.time) == pytest.approx((1.0, 3.0), rel=0.1)


@pytest.mark.parametrize(
    ("metric", "factor"),
    [("fibre_length.rms_percent", 1), ("volume.deviation", 1), ("fibre_length.rms", 2), ("surface_deviation.max", 2)],
)
def test_shares_are_as_they_are_on_another_case_and_lengths_go_with_the_motion(metric: str, factor: int) -> None:
    points = tuple(replace(one, errors={metric: 3.0}) for one in STUDIES[0].points)
    known = [replace(STUDIES[0], points=points, units={metric: "mm"}, bars={}) for _ in range(2)]
    known = [replace(one, case=name) for one, name in zip(known, "ab", strict=True)]
    # The cases move 50 mm, and the new one twice as far; those two agree, so that no margin is added.
    found = recommend(features(100), "new", known, metric, {"error": 1e9})
    assert found.margins.error == 1.0
    assert found.best.error == pytest.approx(3.0 * factor)


def test_none_is_recommended_where_none_meets_what_is_asked() -> None:
    assert recommend(features(50), "a", STUDIES, RMS, {"error": 0.01}).best is None
    assert recommend(features(50), "new", STUDIES, RMS, {"time": 1e-9}).best is None


def test_a_study_is_the_same_when_read_back(tmp_path) -> None:
    path = tmp_path / "study.json"
    path.write_text(json.dumps(facts(STUDIES[0], {"machine": "here"})))
    assert list(map(vars, load(path))) == [vars(STUDIES[0])]


@pytest.mark.parametrize(
    "text", ["", "{}", "[]", '{"format": 2}', '{"format": 1, "points": 3, "origin": 0, "claims": []}']
)
def test_a_file_that_is_no_study_is_refused_by_name(tmp_path, text) -> None:
    path = tmp_path / "study.json"
    path.write_text(text)
    with pytest.raises(InputError, match=r"study\.json"):
        load(path)


def test_tetrahedra_that_err_more_elsewhere_widen_the_margin() -> None:
    # Twice as large as each case has them, of which the sizes differ; on the last case they err three times as much.
    def with_tets(one: CaseStudy, size: float, error: float) -> CaseStudy:
        choice = {"solver": "fenicsx", "scene": {"muscle.tet_size": f"{2 * size:g} mm", "muscle.refinements": 1}}
        errors, costs = {RMS: error * one.travel}, {TIME: 1e-3 * one.triangles}
        fem = Point(one.case, "fenicsx", "reference", "tetrahedra", "", choice, "converged", "", errors, costs)
        return replace(one, points=(fem,), features=one.features | {"tet_size": size})

    studies = [with_tets(*each) for each in zip(STUDIES, (10.0, 6.0, 4.0), (0.01, 0.01, 0.03), strict=True)]
    assert recommend(features(60), "new", studies, RMS, {"error": 1e9}).margins.error == pytest.approx(3.0, rel=0.1)


def test_tetrahedra_are_recommended_in_the_size_of_the_case_itself() -> None:
    # Twice as large as a studied case has them, which is 10 mm; the new case has 6 mm.
    def with_tets(one: CaseStudy) -> CaseStudy:
        coarse = {"solver": "fenicsx", "scene": {"muscle.tet_size": "20 mm", "muscle.refinements": 0}}
        errors, costs = {RMS: 0.1}, {TIME: 1.0}
        fem = Point(one.case, "fenicsx", "reference", "tetrahedra", "20 mm", coarse, "converged", "", errors, costs)
        return CaseStudy(**(vars(one) | {"points": (*one.points, fem)}))

    fine = features(60) | {"tet_size": 6.0, "refinements": 2.0}
    found = recommend(fine, "new", [with_tets(one) for one in STUDIES], RMS, {"error": 1.0})
    assert found.best is not None
    assert found.best.point.choice["scene"] == {"muscle.tet_size": "12 mm", "muscle.refinements": 1}
    # Without refinements there are none to leave out: the tetrahedra are as large as those would have been.
    found = recommend(fine | {"refinements": 0.0}, "new", [with_tets(one) for one in STUDIES], RMS, {"error": 1.0})
    assert found.best is not None
    assert found.best.point.choice["scene"] == {"muscle.tet_size": "24 mm", "muscle.refinements": 0}


def own_study(known: dict[str, float], bar: float = 0.0) -> CaseStudy:
    """A study of the small scene: errors of 0.2, 0.1 and 0.02 of 50 mm in 1, 3 and 10 ms, and the truth in 2 s."""
    about = ("bar", "fenicsx", "reference", "", "", {"solver": "fenicsx"}, "converged", "")
    found = study("bar", 50, bar=bar)
    points = (*found.points, Point(*about, {}, {TIME: 2.0}))
    return replace(found, points=points, features=known, bars={RMS: bar} if bar else {})


def test_a_case_whose_bones_are_still_is_compared_by_no_motion() -> None:
    still = features(0.0)
    with pytest.raises(InputError, match="new: got bones that do not move, want a study of the case itself"):
        recommend(still, "new", [study("a", 50)], RMS, {"error": 5.0})
    with pytest.raises(InputError, match="got none of a case whose bones move"):
        recommend(features(50), "new", [replace(study("a", 50), features=still)], RMS, {"error": 5.0})
    assert recommend(still, "a", [replace(study("a", 50), features=still)], RMS, {"error": 5.0}).best is not None
