"""Numbers that are known of a case: by them a recommendation chooses what was studied, and a reference has an expected time."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small

import fem_reference as fr
from fem_reference.problems import muscle
from fem_reference.problems.body import Body
from fem_reference.scenes import casefile
from fem_reference.solvers import fenicsx
from fem_reference.solvers.fenicsx import resources
from fem_reference.studies.execution import Bench
from fem_reference.studies.features import expected, features

CONTACT = '\n[[effect]]\nname = "contact"\nstiffness = "100 kPa/mm"\nsmoothing = "0.2 mm"\n'
QUICK = {"muscle[0].tet_size": "10 mm", "muscle[1].tet_size": "10 mm", "frames.every": 20}


def test_the_numbers_of_the_small_bar(tmp_path: Path) -> None:
    """Its lid turns by 0.4 rad up to frame 10 of 20 and back; 10 MPa over 10 kPa; two bones, of which contact may name one."""
    path = small.write(tmp_path / "bar") / "case.toml"
    text = path.read_text() + small.FIBRES.format(slack=1.0)
    path.write_text(text)
    scene = casefile.read_muscle(path.parent)
    rest = muscle.setup(scene)
    found = features(scene, rest)
    # The bar's end is 10 mm above the line that the lid turns about, and its corners 5 mm to the side of it: a chord.
    assert found["motion"] == pytest.approx(2 * math.hypot(10, 5) * math.sin(0.2), rel=1e-9)
    assert found["bulk_to_shear"] == pytest.approx(1000, rel=1e-12)
    stress = next(effect.stress for effect in scene.effects if hasattr(effect, "stress"))
    assert found["fibres_to_shear"] == pytest.approx(stress / 0.01, rel=1e-12)
    assert found["tet_size"] == 6
    assert found["size"] == pytest.approx(np.linalg.norm(np.ptp(rest.surface.points, axis=0)), rel=1e-12)
    for names, count in (("", 2.0), ('bones = ["lid"]\n', 1.0)):
        path.write_text(text + CONTACT + names)
        assert features(casefile.read_muscle(path.parent), rest)["contact"] == count
    assert found["contact"] == 0


def test_every_law_counts_with_its_shear_modulus(tmp_path: Path) -> None:
    """Of a Mooney-Rivlin matrix that is 2 (c1 + c2): as stiff as 10 kPa, it has the features of the neo-Hookean bar."""
    path = small.write(tmp_path / "bar") / "case.toml"
    scene = casefile.read_muscle(path.parent)
    rest = muscle.setup(scene)
    path.write_text(
        path.read_text().replace(
            'name = "neo_hooke"\nmu = "10 kPa"', 'name = "mooney_rivlin"\nc1 = "3 kPa"\nc2 = "2 kPa"'
        )
    )
    other = casefile.read_muscle(path.parent)
    assert type(other.effects[0]).__name__ == "MooneyRivlin"
    assert features(other, rest) == pytest.approx(features(scene, rest), rel=1e-12)


def seconds(body: Body, element: str) -> float:
    return expected(body, fenicsx.BodySettings(element=element)).seconds


def body(count: int, frames: tuple[float, ...] = (0.0, 1.0)) -> Body:
    """A cube of ``count`` cells along each edge, each cut into tetrahedra."""
    cells = fr.box((count,) * 3, (10.0, 10.0, 10.0), "tetrahedron")
    return fr.Body(cells, (fr.make_effect("neo_hooke", mu=0.01),), (), frames=frames)


def test_one_frame_of_what_was_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four iterations of 0.13 s with 5456 unknowns; the 597 MB of hip_flexion's 35,970, by a fit to another muscle."""
    monkeypatch.setattr(resources, "unknowns", lambda *_: 5456)
    assert seconds(body(1), "P2/P1") == pytest.approx(0.52)
    monkeypatch.setattr(resources, "unknowns", lambda *_: 35_970)
    assert expected(body(1), fenicsx.BodySettings()).megabytes == pytest.approx(597, rel=0.1)


def test_each_frame_after_the_first_takes_as_long() -> None:
    one = seconds(body(2), "P2/P1")
    assert seconds(body(2, (0.0, 1.0, 2.0, 5.0)), "P2/P1") == pytest.approx(3 * one)


def test_contact_between_parts_takes_as_many_steps_as_their_facets_are_passed() -> None:
    """Two cubes on cells of 5 mm, of which one is moved by 40 mm and back: 16 edges, with many frames and with few."""
    cubes = [fr.box((2, 2, 2), (10.0, 10.0, 10.0), "hexahedron") for _ in range(2)]
    low, high = cubes[0], replace(cubes[1], points=cubes[1].points + [0.0, 0.0, 10.1])
    path = fr.Prescribed("top", "high_z1", (0,), lambda points, frame: 0 * points + 40 * (1 - abs(1 - frame)))
    frames, law = (0.0, 1.0, 2.0), fr.Touching("low_z1", "high_z0", 1.0, 0.1)
    alone = fr.Body(fr.joined({"low": low, "high": high}), body(1).effects, (path,), frames=frames)
    few = replace(alone, touching=(law,))
    many = replace(few, frames=tuple(np.linspace(0, 2, 5)))
    each = seconds(alone, "Q2/Q1") / 2 / 4  # of an iteration, of which 4 are expected in a frame without contact
    assert seconds(few, "Q2/Q1") == pytest.approx(15 * 80 / 5 * (each + 0.1))
    assert seconds(many, "Q2/Q1") == pytest.approx(seconds(few, "Q2/Q1"))


@pytest.mark.slow
@pytest.mark.parametrize(("change", "measured"), [pytest.param({}, 25, marks=pytest.mark.nightly), (QUICK, 15)])
def test_the_time_of_two_muscles_is_expected_within_a_factor_of_three(
    change: dict[str, object], measured: float
) -> None:
    """Processor time for 109 and 135 iterations, in 10 and in 2 frames; 65 and 39 s where other processes keep the machine busy."""
    case = casefile.read("two_muscles", changes=change)
    built = Bench(case, Path()).problem().body
    assert built is not None
    assert measured / 3 < expected(built, fenicsx.Settings()).seconds < 3 * measured


def test_more_unknowns_take_more_than_in_proportion() -> None:
    """And less than with their square, on smaller cells and in richer elements alike."""
    for (few, element), (many, other) in (((2, "P2/P1"), (4, "P2/P1")), ((3, "P1/P1"), (3, "P2/P1"))):
        small, large = body(few), body(many)
        ratio = resources.unknowns(large.mesh, other) / resources.unknowns(small.mesh, element)
        longer = seconds(large, other) / seconds(small, element)
        assert ratio < longer < ratio**2


def test_the_stiffness_of_a_muscle_is_that_beside_its_tendon(tmp_path: Path) -> None:
    """1 MPa in the tendon leaves bulk over shear of the belly as it was: 10 MPa over 1 kPa."""
    region = {"name": "tendon", "width": "2 mm", "attachment": {"name": "origin", "length": "8 mm"}}
    laws = [{"name": "neo_hooke", "mu": mu, "in": at} for mu, at in (("1 kPa", "not tendon"), ("1 MPa", "tendon"))]
    changes = {"region": [region], "effect": [*laws, {"name": "incompressible", "bulk": "10 MPa"}]}
    scene = casefile.read_muscle(small.write(tmp_path / "bar"), changes=changes)
    assert features(scene, muscle.setup(scene))["bulk_to_shear"] == pytest.approx(1e4)
