"""Forces as a table and as points: statics by hand, rotations of the scene, and reading back."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_reference.assessment.comparison import Comparison
from fem_reference.export import forces
from fem_reference.foundations.motion import RigidMotion
from fem_reference.io.formats import vtk
from fem_reference.metrics import Measure
from fem_reference.problems.setup import AttachedVertices, Joint, Setup
from fem_reference.runs.contents import vector_scalars
from fem_reference.runs.store import Run
from tests.report.comparisons import small_comparison

PULL = np.outer(np.arange(5.0), [0.0, 3.0, 4.0])  # [N], none at rest
POINT, CENTRE = np.array([7.0, 10.0, 0.0]), np.array([1.0, 2.0, 0.0])


def pulled(run: Run, forces: np.ndarray = PULL, point: np.ndarray = POINT) -> Run:
    scalars = {
        name: values
        for kind, vectors in {"force": forces, "moment": np.cross(point, forces)}.items()
        for name, values in zip(vector_scalars(f"{kind}_on_plate", np.zeros(3)), vectors.T, strict=True)
    }
    return replace(run, scalars=run.scalars | scalars)


@pytest.fixture
def compared(tmp_path, monkeypatch: pytest.MonkeyPatch) -> Comparison:
    """The reference pulls the plate, which turns about x; "quick" has arms and no force."""
    found = small_comparison(tmp_path, monkeypatch)
    numbers, plate = found.reference.numbers, found.setup.bones[0]
    turns = RigidMotion((1, 0, 0), tuple(CENTRE), tuple(map(float, numbers)), (0.0, 0.1, 0.2, 0.3, 0.4))
    bone = replace(plate, motion=turns)
    joint = Joint("knee", bone, np.array([1.0, 0, 0]), CENTRE, lambda frame: 0.01 * frame)
    setup = Setup(
        found.setup.surface,
        (bone,),
        (AttachedVertices("foot", bone, np.array([0, 1])),),
        numbers,
        None,
        joints=(joint,),
    )
    arms = tuple(
        Measure("moment_arm", name, "mm", value + np.arange(5.0)) for name, value in (("mean", 3.0), ("least", 2.0))
    )
    by_force = (Measure("joint_moment", "arm", "mm", np.array([np.nan, 8, 8, 8, 8])),)
    changes = found.changes | {name: found.changes[name] + arms for name in ("reference", "quick")}
    changes["reference"] += by_force
    context = replace(found.context, bones=(bone,), joints=(joint,))
    return replace(found, setup=setup, context=context, changes=changes, reference=pulled(found.reference))


def test_the_point_of_application_is_free_of_moment(compared: Comparison) -> None:
    """The force of one point: the line through it along the force has no moment, and NaN where there is no force."""
    bone, run = compared.setup.bones[0], compared.reference
    found = forces.applied(run, bone, compared.setup)
    assert np.isnan(found[0]).all()
    for i in range(1, 5):
        assert_allclose(run.moment("plate", found[i])[i], 0, atol=1e-9)  # rounding of 1e3 N mm
        assert_allclose(np.cross(found[i] - POINT, PULL[i]), 0, atol=1e-9)


def test_a_turned_scene_turns_vectors_and_points(compared: Comparison) -> None:
    """A quarter turn about z of the forces alone, on a bone without attachments: the nearest point to the origin turns along."""
    setup, turn = replace(compared.setup, attached=()), np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    bone = setup.bones[0]
    turned = pulled(compared.reference, PULL @ turn.T, turn @ POINT)
    assert_allclose(
        forces.applied(turned, bone, setup)[1:], forces.applied(compared.reference, bone, setup)[1:] @ turn.T
    )


def test_the_table_is_read_back(compared: Comparison, tmp_path) -> None:
    forces.write_table(compared, tmp_path / forces.FILE)
    rows = list(csv.DictReader((tmp_path / forces.FILE).read_text().splitlines()))
    assert [row["run"] for row in rows] == ["reference"] * 5 + ["quick"] * 5 + ["torn"] * 5
    own = rows[:5]
    assert [[float(row[f"force_{axis}_N"]) for axis in "xyz"] for row in own] == PULL.tolist()
    # 8 mm along y times 4 N along z, about x through the centre; 0.1 rad a frame in degrees
    assert_allclose([float(row["moment_about_axis_N_mm"]) for row in own], 32 * np.arange(5))
    assert_allclose([float(row["moment_x_N_mm"]) for row in own], 32 * np.arange(5))
    assert_allclose([float(row["angle_deg"]) for row in own], np.degrees(0.1) * np.arange(5))
    assert [float(row["moment_arm_mean_mm"]) for row in own] == [3, 4, 5, 6, 7]
    assert own[0]["at_x_mm"] == own[0]["moment_arm_by_force_mm"] == ""  # no force, no point, no arm
    assert [row["moment_arm_by_force_mm"] for row in rows[1:6]] == ["8.0"] * 4 + [""]
    quick = rows[5]
    assert (quick["force_x_N"], quick["moment_arm_least_mm"], quick["moment_arm_greatest_mm"]) == ("", "2.0", "")


def test_points_with_vectors_for_paraview(compared: Comparison, tmp_path) -> None:
    import pyvista

    assert forces.block(compared.candidates[0], compared.setup, 2) is None
    assert forces.block(compared.reference, compared.setup, 0) is None  # no force at rest
    found = forces.block(compared.reference, compared.setup, 2)
    assert found is not None
    vtk.write_blocks(tmp_path / "frame.vtm", {"forces": found})
    read = pyvista.read(tmp_path / "frame.vtm")["forces"]
    assert_allclose(read.point_data["force"], PULL[[2]])
    assert_allclose(read.points, found.points)
    assert not read.point_data["displacement"].any()
