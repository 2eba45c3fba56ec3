"""Variations of a case: with one thing changed it is another one, in which all else stays; and ladders of them."""

from pathlib import Path

import numpy as np
import pytest
import shapes
import small

from fem_reference.effects import make
from fem_reference.effects.contact import among
from fem_reference.foundations.errors import InputError
from fem_reference.problems import muscle
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.studies.campaign import Workers, carry_out, solve
from fem_reference.studies.execution import Bench
from fem_reference.studies.variations import (
    candidate_trials,
    nearest_vertices,
    on_tetrahedra,
    reference_trials,
    resample,
    with_contact,
    with_distances,
)


@pytest.fixture
def scene(tmp_path: Path) -> MuscleCase:
    """The small scene with contact."""
    found = casefile.read_muscle(small.write(tmp_path / "bar"))
    contact = make("contact", stiffness="100 kPa/mm", bones=(found.bone[0].name,))
    return found.model_copy(update={"effect": (*found.effect, contact)})


def test_only_what_is_named_changes(scene: MuscleCase) -> None:
    assert on_tetrahedra(scene, tet_size=3.0).muscle == scene.muscle.model_copy(update={"tet_size": 3.0})
    stiffer = with_contact(scene, stiffness=0.4)
    assert among(stiffer.effects).stiffness == 0.4
    assert stiffer.effects[:-1] == scene.effects[:-1]
    halved = with_distances(scene, 0.5, "distance_error")
    assert [bone.distance_error for bone in halved.bone] == [0.5 * bone.distance_error for bone in scene.bone]
    assert [bone.distance_rounding for bone in halved.bone] == [bone.distance_rounding for bone in scene.bone]


def test_no_two_changes_have_one_key(scene: MuscleCase) -> None:
    found = (scene, on_tetrahedra(scene, tet_size=3.0), with_contact(scene, stiffness=0.4))
    assert len({one.key for one in (*found, with_distances(scene, 0.5, "distance_error"))}) == 4


def test_without_contact_none_comes(scene: MuscleCase) -> None:
    plain = scene.model_copy(update={"effect": scene.effect[:-1]})
    assert with_contact(plain, stiffness=1.0).effects == plain.effects


def test_it_can_be_set_up_from_a_folder_outside_the_case(tmp_path: Path) -> None:
    scene = casefile.read_muscle(small.write(tmp_path / "case" / "bar"))
    rest = muscle.setup(scene)
    coarse = muscle.setup(resample(scene, rest, -1, tmp_path / "elsewhere"))
    assert len(coarse.surface.triangles) < 0.5 * len(rest.surface.triangles)
    assert [one.attachment for one in coarse.attached] == [one.attachment for one in rest.attached]


def test_a_vertex_is_attached_where_the_nearest_is() -> None:
    """Points beside the vertices of a ball, each nearer to one of them than to any other."""
    ball = shapes.sphere(1, 10.0)
    beside = ball.points * 1.02 + np.random.default_rng(5).uniform(-0.3, 0.3, ball.points.shape)
    assert np.array_equal(nearest_vertices(ball, beside), np.arange(len(ball.points)))


def test_a_resampled_scene_has_one_key_wherever_its_study_is(tmp_path: Path) -> None:
    scene = casefile.read_muscle(small.write(tmp_path / "bar"))
    keys, runs = set(), set()
    for name in ("here", "elsewhere"):
        bench = Bench(scene, tmp_path / name)
        other = resample(scene, bench.setup(), -1, tmp_path / name / "surfaces")
        keys.add(other.key)
        runs.add(Bench(other, tmp_path / name).folder(other.candidate[0], "candidate[0]").name)
    assert len(keys) == len(runs) == 1
    assert keys != {scene.key}


def test_what_is_varied_on_coarser_tetrahedra_says_so() -> None:
    trials = list(reference_trials(casefile.read_muscle("hip_flexion")))
    whole, *others = trials
    assert (whole.knob, whole.changed) == ("", {})
    sizes = [one.value for one in others if one.knob == "tetrahedra"]
    assert "10 mm, not refined" in sizes
    assert "6.25 mm, refined once" in sizes
    varied = [one for one in others if one.knob != "tetrahedra"]
    assert {"element", "contact stiffness", "error of distances to bones"} < {one.knob for one in varied}
    assert all(one.value.endswith("(tetrahedra = 10 mm, not refined)") for one in varied)
    linear = next(one for one in varied if one.value.startswith("P1"))
    assert linear.value.startswith("P1, volume by a penalty (")
    assert linear.changed["effect[1].name"] == "incompressible_penalty"
    # The energy that is left when the pressure is eliminated, with the same bulk modulus.
    assert [(type(one).__name__, one.bulk) for one in linear.scene.effects if hasattr(one, "bulk")] == [
        ("IncompressiblePenalty", whole.scene.effects[1].bulk)
    ]
    softer = next(one for one in varied if one.knob == "contact stiffness")
    assert softer.changed["effect[3].stiffness"] == "0.05 MPa/mm"


@pytest.mark.parametrize(
    ("effects", "element", "values"),
    [
        (
            {"effect[1].name": "incompressible_penalty"},
            "P2",
            {"P2/P1": "incompressible", "P1/P1": "incompressible", "P1": None},
        ),
        ({"effect[2]": {"name": "incompressible_penalty", "bulk": "1 MPa"}}, "P2/P1", {"P2/P0": None, "P1": None}),
    ],
)
def test_the_volume_goes_with_the_element(effects, element, values) -> None:
    """With a penalty alone a pressure takes its place; of a bulk modulus in two parts neither is moved, and P1 is refused."""
    scene = casefile.read_muscle("hip_flexion", effects | {"reference.element": element})
    found = {one.choice.settings.get("element"): one for one in reference_trials(scene) if one.knob == "element"}
    for name, volume in values.items():
        assert found[name].changed.get("effect[1].name") == volume
        assert ("volume by" in found[name].value) == (volume is not None)


def test_a_candidate_has_the_ladders_that_its_solver_declares() -> None:
    trials = list(candidate_trials(casefile.read_muscle("hip_flexion"), {}))

    def values(name: str) -> dict[str, set[str]]:
        mine = [one for one in trials if one.name == name and one.knob]
        return {knob: {one.value for one in mine if one.knob == knob} for knob in {one.knob for one in mine}}

    # The case has 100 Gaussians and ten iterations, and straight lines; what it has already is no variation.
    assert values("rbf_muscle") == {"gaussians": {"10", "30"}, "iterations": {"3", "30"}}
    assert values("straight_lines") == {"via_count": {"2", "4", "8"}}
    assert values("via_points") == {}, "via-points by name exclude a number of them"
    assert [one.name for one in trials if not one.knob].count("rbf_muscle") == 1, "that of Table 5.1 is the case's own"


def test_a_point_with_another_element_is_the_run_that_its_keys_give(tmp_path) -> None:
    trials = reference_trials(casefile.read_muscle("hip_flexion"))
    trial = next(one for one in trials if one.value.startswith("P1, "))
    again = casefile.read_muscle("hip_flexion", trial.changed | {"reference.element": "P1"})
    keys = [
        Bench(scene, tmp_path).folder(choice, "reference")
        for scene, choice in ((trial.scene, trial.choice), (again, again.reference))
    ]
    assert keys[0] == keys[1]


def test_how_runs_were_made_is_said_of_a_cluster_too() -> None:
    assert str(Workers()) == "runs one after the other"
    assert str(Workers(2)) == "runs 2 at once"
    assert str(Workers(address="tcp://there:8786")) == "runs by the workers of a cluster"


def test_a_setting_that_is_refused_is_named_once(tmp_path) -> None:
    trials = reference_trials(casefile.read_muscle("hip_flexion"))
    refused = next(one for one in trials if one.knob == "element" and one.value.startswith("Q1 "))
    with pytest.raises(InputError, match=r"case\.toml: reference\.element: got \"Q1\""):
        solve(refused, tmp_path)
    (made,) = carry_out([refused], tmp_path, Workers())
    assert made.run is None
    assert made.failure.startswith("case.toml: reference.element: got ")  # and no folder of this machine
