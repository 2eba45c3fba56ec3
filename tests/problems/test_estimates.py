"""Estimates of a case before it is solved, and decisions by them: what makes a force is kept, though it moves little."""

from dataclasses import replace

import numpy as np
import pytest
import random_scenes
from auto_scenes import STILL, pennate, scene_of

from fem_reference import cli
from fem_reference.effects import make
from fem_reference.problems import muscle, of_case
from fem_reference.problems.estimates import STRESS_TOLERANCE, TOLERANCE, estimates, stretched
from fem_reference.problems.setup import Setup
from fem_reference.scenes import casefile


def test_a_body_that_is_attached_to_nothing_goes_with_the_bones_beside_it(tmp_path) -> None:
    scene = scene_of(tmp_path, "")
    loose = replace(muscle.setup(scene), attached=())
    known = estimates(scene, loose)
    assert known.fixed == 0
    assert known.travel > 1
    assert known.speed > 0


@pytest.mark.slow
def test_small_motions_are_asked_for_more_closely(tmp_path) -> None:
    scene = scene_of(tmp_path, "")
    rest = muscle.setup(scene)
    known, slow = estimates(scene, rest), TOLERANCE * scene.muscle.tet_size
    assert known.tolerance == pytest.approx(min(slow, TOLERANCE * known.travel))
    bones = tuple(replace(bone, motion=None) for bone in rest.bones)
    still = replace(rest, bones=bones, attached=tuple(replace(one, bone=bones[0]) for one in rest.attached))
    assert estimates(scene, still).tolerance == pytest.approx(slow)


def test_the_estimates_of_a_bar_are_what_is_known_of_it(tmp_path) -> None:
    scene = scene_of(tmp_path, "")
    known = estimates(scene, muscle.setup(scene))
    assert known.shear == pytest.approx(0.01, rel=1e-5)  # mu = 10 kPa; small strain
    low, high = known.stretch
    assert low < 1 < high
    assert known.acceleration >= 0
    assert known.jump > 0  # keyframes are joined by straight lines


def test_the_stretch_of_what_was_solved_is_that_of_the_surface_along_the_fibres(tmp_path) -> None:
    """The bar, made longer by a fifth along its axis, thinner, and turned."""
    scene = scene_of(tmp_path, "")
    rest = muscle.setup(scene)
    first, last = (rest.surface.points[entry.vertices].mean(axis=0) for entry in rest.attached)
    axis = (last - first) / np.linalg.norm(last - first)
    longer = np.outer(axis, axis) * 1.2 + (np.eye(3) - np.outer(axis, axis)) * 1.2**-0.5
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    low, high = stretched(rest, rest.surface.points @ (turn @ longer).T)
    # Triangles whose plane is off the axis by the slope of the bar, up to a few per cent, mix in what is thinner, to second order.
    assert high == pytest.approx(1.2, abs=1e-3)
    assert low > 1.1
    assert stretched(rest, rest.surface.points) == pytest.approx((1, 1))


@pytest.mark.slow
def test_all_that_makes_a_stress_where_nothing_else_does_is_kept(tmp_path) -> None:
    """Each alone, however small, but above what rounding makes; the line says which quantity decided, and with what number."""
    for name, more in random_scenes.EFFECTS.items():
        if name in ("contact", "damping", "fibre_passive"):  # which do nothing where nothing moves
            continue
        values = STILL | {"activation": 1e-4, "density": 0.1, "weight": "0, 0, -9.81", "pressure": 1e-4}
        scene = of_case.chosen(pennate(tmp_path / name, "auto", more.format(**values)))
        assert scene.decisions[-1].needed, name
        assert "kPa of stress" in str(scene.decisions[-1])
    assert "Pressure on free: needed, about 0.0001 kPa of stress, 5e-08 kPa allowed" in str(scene.decisions[-1])


def test_what_does_nothing_is_left_out_where_nothing_moves(tmp_path) -> None:
    values = STILL | {"activation": 0.0, "drag": 1.0, "contact": 500.0}
    more = "".join(random_scenes.EFFECTS[name] for name in ("active_tension", "fibre_passive", "damping", "contact"))
    scene = of_case.chosen(pennate(tmp_path / "still", "auto", more.format(**values)))
    assert [one.needed for one in scene.decisions] == [True, True, False, False, False, False]
    assert all("kPa of stress" in str(one) for one in scene.decisions[2:])


@pytest.mark.slow
def test_a_motion_allows_stresses_of_its_own_size(tmp_path) -> None:
    """Bones that draw the bar a tenth longer: a strain of 0.1 in a matrix of 10 kPa; and bones that move together do not."""
    case = random_scenes.TEXT.format(**STILL | {"distance": 4.0}, choice="auto", effects="")
    scene = random_scenes.write(tmp_path / "longer", case, random_scenes.lines(0.0, 0.0))
    rest = muscle.setup(scene)
    known = estimates(scene, rest)
    assert known.stress_tolerance == pytest.approx(STRESS_TOLERANCE * 0.01 * 0.1, rel=0.1)
    together = tuple(replace(entry, bone=rest.attached[1].bone) for entry in rest.attached)
    alike = estimates(scene, Setup(rest.surface, rest.bones, together, rest.frames, rest.interval))
    assert alike.travel == pytest.approx(4.0)
    assert alike.stress_tolerance < 1e-4 * known.stress_tolerance


def test_what_happens_in_the_middle_of_a_motion_is_asked_for(tmp_path) -> None:
    """A bone that comes down to the bar, 10 mm wide, and is back at the last frame."""
    values = STILL | {"centre": "5, 17, 20", "contact": 500.0}
    case = random_scenes.TEXT.format(**values, choice="auto", effects=random_scenes.EFFECTS["contact"].format(**values))
    path = '[{ frame = 0, distance = "0 mm" }, { frame = 2, distance = "3 mm" }, { frame = 4, distance = "0 mm" }]'
    ball = 'name = "ball"\nmotion = { direction = [0, -1, 0], keyframes = ' + path + " }"
    scene = random_scenes.write(tmp_path / "ball", case.replace('name = "ball"', ball), random_scenes.lines(0.0, 0.0))
    contact = of_case.explained(scene)[-1]
    assert contact.needed
    assert "ball, nearest at frame 2" in str(contact)


@pytest.mark.slow
def test_fibres_stretched_at_rest_are_asked_for_at_that_stretch(tmp_path) -> None:
    """Slack up to 1.05, and stretched by 1.2 without any motion."""
    more = """
[[effect]]
name = "prestretch"
stretch = 1.2
ramp = [{ frame = 0, amount = 0.0 }, { frame = 4, amount = 1.0 }]
"""
    passive = random_scenes.EFFECTS["fibre_passive"].format(**STILL | {"slack": 1.05})
    found = [
        of_case.chosen(pennate(tmp_path / name, "auto", text)) for name, text in (("a", passive), ("b", more + passive))
    ]
    assert [one.decisions[-1].needed for one in found] == [False, True]


@pytest.mark.slow
def test_listed_effects_are_said_to_act(tmp_path, capsys) -> None:
    """Far away bones and no weight: "auto" would leave both out, and "listed" does not."""
    values = STILL | {"contact": 500.0}
    for choice, said in (("listed", False), ("auto", True)):
        scene = pennate(tmp_path / choice, choice, random_scenes.EFFECTS["contact"].format(**values))
        for verb in (["validate", str(scene.folder)], ["run", str(scene.folder), "--explain"]):
            assert cli.main(verb) == cli.DONE
            printed = capsys.readouterr().out
            assert ("left out" in printed) is said, verb
            assert ("acts, as it is listed" in printed) is not said


@pytest.mark.slow
def test_the_passive_fibres_of_the_shipped_muscle_are_estimated_as_they_were_measured() -> None:
    """Without them ``hip_flexion`` changes by 3.1 to 3.5 mm, on two meshes (docs/effects.md)."""
    case = casefile.read_muscle("hip_flexion", changes={"effects": "auto"})
    (passive,) = (one for one in of_case.explained(case) if one.effect.title == "FibrePassive")
    assert passive.needed
    assert 3.5 / 2 < passive.indicator.estimate < 3.1 * 2


def test_a_muscle_with_a_stiff_region_is_as_soft_as_its_softest_place(tmp_path) -> None:
    """What is stiffer somewhere makes nothing look needless: neither its modulus nor the tension of its fibres counts elsewhere."""
    scene, plain = scene_of(tmp_path, ""), {"region": "tendon"}
    stiff = make("neo_hooke", mu=1.0, **{"in": "tendon"})
    fibres = make("fibre_passive", stress=0.3, p1=0.05, p2=6.6, optimal_stretch=0.9, linear_from=1.4)
    rest = replace(muscle.setup(scene), regions={"tendon": lambda points: np.where(points[:, 2] < 5, 1.0, 0.0)})
    there = scene.model_copy(update={"effect": (*scene.effect, stiff, fibres.model_copy(update=plain))})
    everywhere = scene.model_copy(update={"effect": (*scene.effect, fibres)})
    known = estimates(there, rest)
    assert known.shear == pytest.approx(0.01, rel=1e-5)
    assert (known.tension, estimates(everywhere, rest).tension > 0) == (0, True)
