"""Recommendations out of damaged studies."""

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fem_reference.assessment.cost_study import facts, load
from fem_reference.assessment.recommendation import recommend
from fem_reference.foundations.errors import InputError
from tests.assessment.test_recommendation import PERCENT, RMS, features, own_study, study

VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-2, 10**18),
    st.floats(),
    st.text(max_size=5),
    st.lists(st.integers(), max_size=2),
    st.dictionaries(
        st.sampled_from(["muscle.tet_size", "muscle.refinements", "triangles", "scene", RMS]),
        st.floats() | st.text(max_size=3),
        max_size=3,
    ),
)


def places(table: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Where something stands in a table, the way to each."""
    inside = (
        list(table.items()) if isinstance(table, dict) else list(enumerate(table)) if isinstance(table, list) else []
    )
    return [found for key, value in inside for found in ((*at, key), *places(value, (*at, key)))]


@pytest.mark.slow
@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_whatever_a_study_says_a_recommendation_is_finite_or_refused(data: st.DataObject, tmp_path: Path) -> None:
    base = own_study(features(50), bar=1.0)
    choice = {"solver": "fenicsx", "scene": {"muscle.tet_size": "20 mm", "muscle.refinements": 0}}
    fem = replace(base.points[0], solver="fenicsx", name="reference", knob="tetrahedra", choice=choice)
    table = json.loads(json.dumps(facts(replace(base, points=(*base.points, fem)), {})))
    for _ in range(data.draw(st.integers(1, 3))):
        *above, last = data.draw(st.sampled_from(places(table)))
        inside = table
        for key in above:
            inside = inside[key]
        inside[last] = data.draw(VALUES)
        if data.draw(st.booleans()) and isinstance(inside, dict):
            del inside[last]
    (tmp_path / "study.json").write_text(json.dumps(table).replace("Infinity", "1e999"))
    for case, known in (("bar", features(50)), ("new", features(70, 3000))):
        for metric, limits in ((RMS, {"error": 6.0}), (PERCENT, {"time": 0.004}), (RMS, {"error": 0.1, "time": 0.004})):
            try:
                found = recommend(known, case, [*load(tmp_path / "study.json"), study("b", 80)], metric, limits)
            except InputError:
                continue
            for one in (found.best, found.nearest):
                assert one is None or (one.error >= 0 and one.time > 0 and math.isfinite(one.error + one.time))
            assert found.best is None or all(getattr(found.best, name) <= limit for name, limit in limits.items())
