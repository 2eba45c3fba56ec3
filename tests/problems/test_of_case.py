"""Cases of every kind as problems: with the effects that they need, and in words."""

from dataclasses import replace

import fields
import pytest
import small
from auto_scenes import CONTACT, WEIGHT, scene_of

from fem_reference.effects import make as make_effect
from fem_reference.foundations.errors import InputError
from fem_reference.problems import estimates, muscle, of_case
from fem_reference.problems.scalar import FieldProblem, build
from fem_reference.report.overview import case_facts
from fem_reference.report.sections import origin
from fem_reference.scenes import casefile


@pytest.mark.slow
def test_a_scene_keeps_what_it_needs_and_has_the_key_of_that(tmp_path) -> None:
    light, heavy = (scene_of(tmp_path / text, WEIGHT.format(density=text)) for text in ("0.001", "100000"))
    kept = [of_case.chosen(one) for one in (light, heavy)]
    assert [len(one.effects) for one in kept] == [2, 3]
    assert [len(one.decisions) for one in kept] == [3, 3]
    listed = scene_of(tmp_path / "listed", "", "listed")
    assert kept[0].key == listed.key
    assert of_case.chosen(kept[0]) is kept[0]
    assert of_case.chosen(listed) is listed
    assert origin.changes(kept[0]) == [], "what it chose is no change of its file"
    assert "Gravity: left out" in str(kept[0].decisions[2])
    assert "Gravity: needed" in str(kept[1].decisions[2])
    assert "NeoHooke: kept, as part of the material" in str(kept[0].decisions[0])
    itself = make_effect("touching", stiffness=0.1, smoothing=0.1)
    decided = estimates.Decision(itself, needed=True, indicator=None, bound=0.1, stress_bound=0.1)
    assert str(decided) == "MuscleContact: kept, as no estimate shows which surfaces touch"


@pytest.mark.slow
def test_bones_that_come_nowhere_near_are_left_out_and_those_that_do_are_not(tmp_path) -> None:
    """A third bone beside the bar, which rests: 1.5 mm from where that goes, and 600 mm."""
    found = []
    for away in (1.5, 600.0):
        ball = f'\n[[bone]]\nname = "ball"\nsphere = {{ centre = "5, {-away - 20}, 36 mm", radius = "20 mm" }}\n'
        scene = scene_of(tmp_path / f"{away:g}", ball + CONTACT.replace("smoothing", 'bones = ["ball"]\nsmoothing'))
        found.append(of_case.chosen(scene).decisions[-1])
    assert [one.needed for one in found] == [True, False]
    assert found[1].indicator.estimate == 0


def test_a_scalar_field_needs_all_and_is_its_own_set_up() -> None:
    case = casefile.read("rod_advection")
    rest = of_case.setup(case)
    assert isinstance(rest, FieldProblem)
    assert of_case.problem(case, rest) is rest
    assert of_case.explained(case) == ()
    assert of_case.chosen(case) is case
    assert of_case.known(case, rest) == {}
    assert of_case.watch(case, rest, lambda: rest) is None
    assert of_case.scalar_case(case) is case


def test_the_case_of_a_muscle_is_no_scalar_one(tmp_path) -> None:
    case = scene_of(tmp_path, "")
    with pytest.raises(InputError, match=r'case\.toml: got "bar", the case of a muscle, want a scalar case'):
        of_case.scalar_case(case)


def test_what_was_found_to_matter_acts_and_the_rest_stays_left_out(tmp_path) -> None:
    light = of_case.chosen(scene_of(tmp_path, WEIGHT.format(density="0.001") + small.FIBRES.format(slack=1.3)))
    first, second = light.decisions[2:]
    assert not first.needed
    assert not second.needed
    found = of_case.with_effects(light, (replace(second, needed=True, turned_out=5.0),))
    assert found.effects == (*light.effects, second.effect)
    assert [one.turned_out for one in found.decisions] == [None, None, None, 5.0]
    assert len(light.effects) == 2, "the case itself is as it was"


def test_show_says_what_bones_are_and_how_they_move(squeezed, bar) -> None:
    facts = case_facts(squeezed, muscle.setup(squeezed))
    assert facts["muscle"]["mesher"] == "block"
    assert facts["attachments"] == {}
    assert facts["bones"] == {
        "floor": "half space of point (0, 10, 0), normal (0, 1, 0), mm, fixed",
        "lid": "box of centre (0, 140, 0), size (400, 100, 400), rounding 0, mm, slides along (0, -1, 0): "
        "0 mm at frame 0, 40 mm at frame 100",
    }
    turning = casefile.read(bar)
    assert "through (5, 5, 30) mm: 0 rad at frame 0, " in case_facts(turning, muscle.setup(turning))["bones"]["lid"]


def test_a_muscle_has_its_volume_the_areas_of_its_ends_and_its_effects(bar) -> None:
    case = casefile.read(bar)
    rest = muscle.setup(case)
    facts = of_case.facts(case, rest)
    assert facts["muscle"]["triangles"] == len(rest.surface.triangles)
    assert facts["muscle"]["tet_size_mm"] == 6
    for name, bone in (("origin", "floor"), ("insertion", "lid")):
        # Ends are squares of 10 mm.
        assert facts["attachments"][name].endswith(f" vertices, 100 mm2, attached to {bone} exactly")
    assert facts["effects"] == {"NeoHooke": {"mu": "0.01 MPa"}, "Incompressible": {"bulk": "10 MPa"}}
    assert facts["frames"] == "0 to 20, every 5"


def test_springs_and_their_stiffness_are_said(bar) -> None:
    case = casefile.read(bar)
    soft = case.attachment[1].model_copy(update={"stiffness": 0.1})
    case = case.model_copy(update={"attachment": (case.attachment[0], soft)})
    said = of_case.facts(case, muscle.setup(case))["attachments"]
    assert said["insertion"].endswith("attached to lid by springs of 0.1 MPa/mm")
    assert said["origin"].endswith("attached to floor exactly")


def test_a_field_has_its_size_its_nodes_and_its_form(tmp_path) -> None:
    """A rod of 2 mm in 4 cells, fixed at one end; its mesh Peclet number is ``3 * 0.5 / (2 * 1)``."""
    case = fields.scene(
        tmp_path,
        domain={"interval": {"start": 0.0, "end": 2.0, "count": 5}},
        effect=[{"name": "diffusion", "coefficient": 1.0}, {"name": "advection", "velocity": [3.0]}],
        boundary=[{"on": "left", "value": 0}],
        element=fields.element(1),
    )
    facts = of_case.facts(case, build(case))
    assert facts["domain"] == "4 cells, 5 vertices, size 2"
    assert facts["element"] == "P1, 5 nodes, 1 fixed"
    assert facts["form"] == "galerkin, mesh Peclet number up to 0.75"
    assert facts["effects"]["Diffusion"]["coefficient"] == "1.0"
    assert set(facts["effects"]) == {"Diffusion", "Advection"}
