"""Colours and fibres of the 3D view are those of the runs."""

import json
from dataclasses import replace

import numpy as np
import pytest

from fem_reference.assessment import local_fields
from fem_reference.foundations.mesh import Polylines
from fem_reference.report import viewer, viewer_fields
from tests.report.packed import acted_on, levels, positions, unpacked, with_bars

pytestmark = pytest.mark.slow


def test_signed_distances_and_depths_are_those_of_the_runs(comparison):
    data = json.loads(viewer.view(with_bars(comparison, 0.75))["data"])
    assert [one["name"] for one in data["quantities"]] == ["distance", "surface", "depth"]
    assert data["bars"] == {"distance": [0, 0.75, 0.75, 0.75, None], "surface": [0, 0.375, 0.375, 0.375, None]}
    reference, quick = comparison.reference, comparison.candidates[0]
    expected = local_fields.to_surface(quick, reference)
    found = levels(data, 1, "surface", 5)
    (scale,) = (one["top"] for one in data["quantities"] if one["name"] == "surface")
    assert scale == pytest.approx(np.abs(expected).max())
    # Half a level of 127, at its root: value = top s^2, so that it is off by at most 2 sqrt(value top) / 254 and a square of that.
    assert (np.abs(found - expected) <= np.sqrt(np.abs(expected) * scale) / 127 + scale / 254**2 + 1e-9).all()
    across = quick.positions[4][:, 2]
    # It is 4 mm off along z: outside there, inside here.
    assert found[4, np.argmax(across)] > 2
    assert found[4, np.argmin(across)] < -2
    assert data["runs"][1]["most"]["surface"] == pytest.approx(np.abs(expected).max(axis=1), rel=1e-3)
    context, body = comparison.context, comparison.setup.bones[0]
    for i, run in enumerate((reference, quick)):
        frames = zip(run.numbers, run.positions, strict=True)
        deep = np.stack([-body.distances(number, points) for number, points in frames])
        deep = np.where(context.exempt.vertices, 0, np.maximum(deep, 0))
        assert (np.abs(levels(data, i, "depth", 5) - deep) <= 0.02 * deep.max() + 1e-9).all()
        assert data["runs"][i]["most"]["depth"] == pytest.approx(deep.max(axis=1), rel=1e-3)


def test_vertices_near_a_bone_and_attached_ones_are_marked(comparison, monkeypatch):
    """By the distances of the bone itself, where 10 mm are near; none that is exempt, as attached ones are."""
    monkeypatch.setattr(viewer_fields, "NEAR", 10.0)
    changed = acted_on(comparison)
    body, free = changed.setup.bones[0], ~changed.context.exempt.vertices
    data = json.loads(viewer.view(changed)["data"])
    assert data["attached"] == [3, 5, 8]
    for i, run in enumerate((comparison.reference, comparison.candidates[0])):
        far = np.stack([body.distances(number, at) for number, at in zip(run.numbers, run.positions, strict=True)])
        near = free & (far <= 10)
        assert near.any()
        np.testing.assert_array_equal(unpacked(data["runs"][i]["touched"], "u1").reshape(near.shape), near)
    assert "touched" not in json.loads(viewer.view(comparison)["data"])["runs"][0]  # without a bone in contact


def test_fibres_and_joints_are_those_of_the_case(comparison):
    lines = Polylines(np.array([[0.0, 0, 0], [0, 0, 2], [0, 0, 4], [1, 0, 0], [1, 0, 1]]), [0, 3, 5])
    steps = 1 + 0.1 * np.arange(5)[:, None, None] * [0, 0, 1]
    inside = replace(comparison.reference, fibres=lines, fibre_positions=lines.points * steps)
    changed = replace(comparison, reference=inside, context=replace(comparison.context, fibres=lines))
    seen = viewer.view(replace(changed, candidates=()))
    data = json.loads(seen["data"])
    assert data["fibres"] == {"lines": [3, 2], "rest": [2, 2, 1], "low": 1.0, "high": pytest.approx(1.4)}
    assert seen["stretches"][0] == (0.0, 1.0)
    points = positions({"positions": data["runs"][0]["points"]}, data, 5)
    assert points == pytest.approx(inside.fibre_positions, abs=seen["error"] + 1e-12)
    (joint,) = data["joints"]
    assert (joint["name"], joint["unit"]) == ("plate", "°")
    assert joint["values"] == pytest.approx(np.degrees([0, 0.25, 0.5, 0.75, 1]), abs=0.01)
    many = Polylines(np.random.default_rng(1).normal(size=(80 * 40, 3)), np.arange(0, 80 * 40 + 1, 40))
    crowded = replace(changed, context=replace(comparison.context, fibres=many))
    drawn, indices = viewer_fields.Fields(crowded, [inside], (0,)).lines
    assert len(drawn) == viewer_fields.FIBRES
    assert len(indices) == viewer_fields.FIBRES * viewer_fields.POINTS
    assert {0, 39, 79 * 40, 80 * 40 - 1} <= set(indices.tolist())  # the first and the last, from end to end


def test_arrows_begin_where_the_force_has_no_moment(comparison):
    """2 N along y at the point (3, 0, 0) in the second frame; at rest there is no force, and so no arrow."""
    pulls = np.outer([0.0, 2, 0, 0, 0], [0.0, 1, 0])
    vectors = {"force": pulls, "moment": np.cross([3.0, 0, 0], pulls)}
    scalars = {f"{kind}_on_plate_{axis}": vectors[kind][:, i] for kind in vectors for i, axis in enumerate("xyz")}
    run = replace(comparison.reference, scalars=comparison.reference.scalars | scalars)
    assert viewer_fields.arrows(run, comparison.setup, run.numbers) == [[], [[3, 0, 0, 0, 2, 0]], [], [], []]
    assert viewer_fields.arrows(run, comparison.setup, run.numbers[1:2]) == [[[3, 0, 0, 0, 2, 0]]]
    assert viewer_fields.arrows(comparison.reference, comparison.setup, run.numbers) == [[]] * 5
