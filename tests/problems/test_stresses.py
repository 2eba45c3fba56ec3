"""Stresses of effects in a state, beside closed forms of a stretched bar; omitted effects, evaluated in solved frames."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
import random_scenes
import shapes
import small
from auto_scenes import ACTIVE, STILL, pennate, scene_of, solved_as

from fem_reference.effects import make
from fem_reference.problems import muscle, of_case
from fem_reference.problems.stresses import StressSamples, StressSizes, kirchhoff
from fem_reference.studies.execution import Bench


def test_stresses_of_a_stretched_bar_are_those_of_the_closed_form() -> None:
    """At constant volume ``mu (B - I tr B / 3)``, and fibres along it that pull with ``l dW/dl``, deviatoric as well."""
    mesh, stretch, mu, pull = shapes.box((1, 1, 2), (1.0, 1.0, 2.0)), 1.2, 0.01, 0.03
    F = np.diag([stretch**-0.5, stretch**-0.5, stretch])
    fibre = np.tile([0.0, 0.0, 1.0], (len(mesh.tets), 1))
    acting = [(make("neo_hooke", mu=mu), 1.0), (make("incompressible", bulk=10.0), 1.0)]
    active = make("active_tension", tension=pull, ramp=[{"frame": 0, "amount": 1.0}])
    found = StressSamples(mesh, fibre).sizes(mesh.points @ F.T, acting, [(active, 0.5)])
    share = np.sqrt(2 / 3)  # of the deviator of a uniaxial stress
    assert found.acts == pytest.approx(mu * (stretch**2 - 1 / stretch) * share, rel=1e-9)
    assert found.added == pytest.approx([0.5 * pull * stretch**2 * share], rel=1e-9)
    assert found.stretch == pytest.approx((stretch, stretch))
    both = kirchhoff([*acting, (active, 0.5)], np.tile(F, (2000, 1, 1)), np.tile(fibre[0], (2000, 1)))
    assert both[1999] == pytest.approx(both[0], rel=1e-12)  # of parts that are evaluated one after the other


def test_a_law_of_a_region_has_its_share_of_the_stress() -> None:
    """Half of a bar has a law with four times the shear modulus; a law that is left out counts where it would act."""
    mesh, stretch, mu = shapes.box((1, 1, 2), (1.0, 1.0, 2.0)), 1.2, 0.01
    half = {"tendon": lambda points: np.where(points[:, 2] < 1, 1.0, 0.0)}
    soft, stiff = (make("neo_hooke", mu=one, **{"in": at}) for one, at in ((mu, "not tendon"), (4 * mu, "tendon")))
    positions = mesh.points @ np.diag([stretch**-0.5, stretch**-0.5, stretch])
    found = StressSamples(mesh, None, half).sizes(positions, [(soft, 1.0)], [(stiff, 1.0)])
    uniaxial = mu * (stretch**2 - 1 / stretch) * np.sqrt(2 / 3)
    assert found.acts == pytest.approx(uniaxial / np.sqrt(2), rel=1e-9)
    assert found.added == pytest.approx([4 * uniaxial / np.sqrt(2)], rel=1e-9)


def test_a_prestretch_counts_by_what_it_changes_of_the_rest() -> None:
    """At rest the energies see a bar stretched by 1.1: its stress. What is stretched by that already has a stress of its own, which
    is no part of what the prestretch adds.
    """
    mesh, stretch, mu = shapes.box((1, 1, 1), (1.0, 1.0, 1.0)), 1.1, 0.01
    fibre = np.tile([1.0, 0.0, 0.0], (len(mesh.tets), 1))
    effect = make("prestretch", stretch=stretch, ramp=[{"frame": 0, "amount": 1.0}])
    found = StressSamples(mesh, fibre).sizes(mesh.points, [(make("neo_hooke", mu=mu), 1.0)], [(effect, 1.0)])
    assert StressSamples(mesh, fibre).sizes(mesh.points, [(effect, 1.0)], []).stretch == pytest.approx(
        (stretch, stretch)
    )
    assert found.acts == pytest.approx(0.0, abs=1e-12)
    longer = mesh.points * [stretch, stretch**-0.5, stretch**-0.5]
    own = StressSamples(mesh, fibre).sizes(longer, [(make("neo_hooke", mu=mu), 1.0)], [(effect, 1.0)])
    (uniaxial, doubly) = (mu * (one**2 - 1 / one) * np.sqrt(2 / 3) for one in (stretch, stretch**2))
    assert own.acts == pytest.approx(uniaxial)
    assert own.added == pytest.approx([doubly - uniaxial])
    assert found.added == pytest.approx([mu * (stretch**2 - 1 / stretch) * np.sqrt(2 / 3)], rel=1e-9)


@pytest.mark.slow
def test_fibres_that_were_stretched_after_all_are_added(tmp_path) -> None:
    """They are slack up to more than is guessed of the turn, and the run stretched them by more than that."""
    scene = of_case.chosen(scene_of(tmp_path, small.FIBRES.format(slack=1.3)))
    rest = muscle.setup(scene)
    assert ["FibrePassive: left out" in str(one) for one in scene.decisions] == [False, False, True]
    still, longer = rest.surface.points, rest.surface.points * 1.6
    watch = of_case.watch(scene, rest, lambda: None)
    assert watch.see(0, still, None) == ()
    (late,) = watch.see(10, longer, None)
    assert "FibrePassive: found to be needed at frame 10" in str(late)


def test_an_effect_whose_stress_is_no_number_is_needed(tmp_path) -> None:
    """Energies with logarithms have none beyond their range: nothing shows that such an effect may be left out."""
    weight = random_scenes.EFFECTS["gravity"].format(density=1e-6, weight="0, 0, -9.81")
    watch = Bench(pennate(tmp_path / "scene", "auto", weight), tmp_path / "runs").watch()
    rest = watch.rest.surface.points
    for added, titles in ((0.0, []), (np.nan, ["Gravity"])):
        watch.sampled = SimpleNamespace(sizes=lambda *_, added=added: StressSizes(1.0, (added,), (1.0, 1.0)))
        assert [one.effect.title for one in watch.see(0, rest, rest)] == titles


@pytest.mark.slow
@pytest.mark.parametrize("tense", [False, True])
def test_in_situ_an_effect_is_judged_by_the_estimate(tmp_path, tense) -> None:
    """What acts there, without the stress at rest that balances it, is no measure: 1 MPa, of which 1 kPa would be nothing."""
    weight = random_scenes.EFFECTS["gravity"].format(density=1e-6, weight="0, 0, -9.81")
    tension = '[[effect]]\nname = "in_situ"\nstretch = 1.1\n' if tense else ""
    watch = Bench(pennate(tmp_path / "scene", "auto", tension + weight), tmp_path / "runs").watch()
    rest = watch.rest.surface.points
    watch.sampled = SimpleNamespace(sizes=lambda *_: StressSizes(1.0, (1e-3,), (1.0, 1.0)))
    wanted = ["Gravity"] if tense else []
    assert watch.known.stress_tolerance < 1e-3
    assert [one.effect.title for one in watch.see(0, rest, rest)] == wanted
    assert [one.effect.title for one in watch.end()] == wanted


@pytest.mark.slow
def test_what_loads_move_has_a_speed(tmp_path, monkeypatch) -> None:
    """Bones rest, so that there is no drag by what is known before; the solution moves."""
    made = solved_as(
        monkeypatch, lambda points, number: points + [0.5 * number * np.sin(np.pi * points[:, 2:] / 40), 0, 0][0]
    )
    drag = random_scenes.EFFECTS["damping"].format(drag=1e-2)
    scene = pennate(tmp_path / "scene", "auto", ACTIVE + drag)
    bench = Bench(scene, tmp_path / "runs")
    assert "Damping: left out" in str(bench.scene.decisions[-1])
    bench.obtain("reference", scene.reference, "reference")
    assert [len(titles) for titles in made] == [3, 4]


@pytest.mark.slow
def test_at_its_end_a_run_is_judged_by_the_stress_that_there_was(tmp_path, monkeypatch) -> None:
    """Bones draw at springs that yield: the matrix is hardly strained, and the weight is more than was thought beside it."""
    weight = random_scenes.EFFECTS["gravity"].format(density=10.0, weight="0, 0, -9.81")
    case = random_scenes.TEXT.format(**STILL | {"distance": 12.0}, choice="auto", effects=weight)
    found = []
    for name, strain in (("loose", 1e-3), ("tight", 0.3)):
        made = solved_as(monkeypatch, partial(longer, strain))
        scene = random_scenes.write(tmp_path / name, case, random_scenes.lines(0.0, 0.0))
        bench = Bench(scene, tmp_path / f"runs {name}")
        assert "Gravity: left out" in str(bench.scene.decisions[-1])
        bench.obtain("reference", scene.reference, "reference")
        found.append([len(titles) for titles in made])
    assert found == [[2, 3], [2]]


def longer(strain, points, number):
    """Points of a bar that gets longer by a ``strain`` up to frame 4, and thinner."""
    return points * (1 + strain * number / 4 * np.array([-0.5, -0.5, 1.0]))
