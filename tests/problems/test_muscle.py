"""A ball that slides across a bar of few large triangles: it presses that aside as one of small ones, and is not overlooked."""

import importlib.util

import numpy as np
import pytest
import shapes

import fem_reference as fr
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines
from fem_reference.io import files
from fem_reference.metrics import MeasurementContext, penetration
from fem_reference.problems import muscle, of_case
from fem_reference.problems.setup import Setup
from fem_reference.runs.store import Outcome, Run
from fem_reference.solvers import fenicsx

COARSE, FINE = (2, 2, 3), (4, 4, 12)  # edges of 13 and of 3 mm
LAST = 22


def scene(folder, cells, within: str = "1.5 mm", effects: str = "listed"):
    """A bar of 10 x 10 x 40 mm between two plates; the ball of 3 mm begins 1 mm beside it and ends 5 mm behind."""
    bar = shapes.skin(shapes.box(cells, (10.0, 10.0, 40.0)))
    files.write_surface(folder / "bar.vtp", bar, bar.points)
    plates = {"floor": -5.0, "lid": 45.0}
    bones = [
        {"name": name, "box": {"centre": f"5, 5, {z} mm", "size": "30, 30, 9 mm", "rounding": "1 mm"}}
        for name, z in plates.items()
    ]
    motion = {
        "direction": [1, 0, 0],
        "keyframes": [{"frame": 0, "distance": 0.0}, {"frame": LAST, "distance": float(LAST)}],
    }
    bones.append({"name": "ball", "sphere": {"centre": "-4, 5, 20 mm", "radius": "3 mm"}, "motion": motion})
    table = {
        "title": "A ball across a bar",
        "proves": "that contact is felt between the vertices of a surface",
        "effects": effects,
        "muscle": {"surface": "bar.vtp", "unit": "mm", "tet_size": "5 mm", "mesher": "block"},
        "bone": bones,
        "attachment": [{"name": f"to {name}", "bone": name, "within": within} for name in plates],
        "effect": [
            {"name": "neo_hooke", "mu": "10 kPa"},
            {"name": "incompressible", "bulk": "10 MPa"},
            {"name": "contact", "stiffness": "500 kPa/mm", "smoothing": "0.3 mm"},
        ],
        "fibres": {"traced": {"count": 4, "start": "to floor", "end": "to lid"}},
        "frames": {"first": 0, "last": LAST, "every": LAST // 2},
        "reference": {"solver": "fenicsx"},
    }
    return fr.make_case(table, folder)


def deepest(rest: Setup, numbers, positions) -> np.ndarray:
    run = Run("run", "test", Outcome("converged", ""), tuple(numbers), rest.surface, np.array(positions), None, None)
    lines = Polylines(rest.surface.points[:2], np.array([0, 2]))
    context = MeasurementContext.of(run, lines, rest.bones, rest.exempt)
    return penetration.measure(run, run, context)[0].values


def test_a_ball_that_passes_through_is_deep_in_the_bar(tmp_path) -> None:
    rest = muscle.setup(scene(tmp_path, COARSE))
    # Its middle is 4 mm before the side, in the bar, and 8 mm behind: points drawn in it come within 0.4 mm of that.
    found = deepest(rest, (0, 11, 22), [rest.surface.points] * 3)
    assert found[[0, 2]].tolist() == [0, 0]
    assert 2.6 < found[1] <= 3


@pytest.mark.parametrize("cells", [(1, 1, 1), COARSE, FINE])
def test_it_is_known_before_that_the_ball_reaches_the_bar(tmp_path, cells) -> None:
    for effects in ("listed", "auto"):
        case = scene(tmp_path, cells, effects=effects)
        said = next(str(one) for one in of_case.explained(case) if one.effect.title == "Contact")
        assert "(ball, nearest at frame" in said
        assert "no bone is reached" not in said
        assert "left out" not in said
        assert [type(effect).__name__ for effect in of_case.chosen(case).effects][-1] == "Contact"


def test_a_bar_that_is_attached_all_round_is_refused_before_it_is_meshed(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(muscle, "_filled", lambda *_: pytest.fail("it was meshed"))
    case = scene(tmp_path, COARSE, within="14 mm")  # the vertices 13.3 mm away too: none is left
    with pytest.raises(InputError, match=r"case.attachment: got .* no contact is felt, want at most 50 %"):
        muscle.build(case, muscle.setup(case))


def plate(folder, thick: float, smoothing: str = "0.3 mm"):
    """The bar and a plate beside it, which goes face on to its other side within the one interval between two frames."""
    case = scene(folder, COARSE)
    size = f"20, {thick}, 20 mm"
    ball = {"centre": "5, -3, 20 mm", "size": size, "rounding": "0.05 mm"}
    bones = [*case.bone[:2], case.bone[2].model_copy(update={"sphere": None, "box": type(case.bone[0].box)(**ball)})]
    motion = case.bone[2].motion.model_copy(update={"direction": (0.0, 1.0, 0.0)})
    bones[2] = bones[2].model_copy(update={"motion": motion})
    effects = [*case.effects[:2], case.effects[2].model_copy(update={"smoothing": float(smoothing.split()[0])})]
    frames = case.frames.model_copy(update={"every": LAST})
    return case.model_copy(update={"bone": tuple(bones), "effect": tuple(effects), "frames": frames})


def test_a_bone_that_would_pass_between_contact_points_is_refused(tmp_path) -> None:
    # Points of the bar are 0.53 mm apart, an eightieth of its diagonal: 1.5 times that is 0.8 mm.
    case = plate(tmp_path, 0.4)
    with pytest.raises(InputError, match=r"bone\[2\]: got a bone 0.4 mm thick, want 0.8 mm or more"):
        muscle.build(case, muscle.setup(case))


@pytest.mark.slow
def test_a_plate_thinner_than_twice_the_smoothing_does_not_pass_in_one_step(tmp_path) -> None:
    if not any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx")):
        pytest.skip("FEniCSx is not installed")
    case, frames = plate(tmp_path, 0.9, "0.6 mm"), []
    settings = fenicsx.Settings(ranks=1, first_step=float(LAST), smallest_step=LAST / 4)
    outcome = fenicsx.solve(muscle.build(case, muscle.setup(case)), settings, frames.append)
    # It cannot be solved in steps of that size: what matters is that no step takes it through.
    assert outcome.status != "converged"
    assert "went through" in outcome.message


@pytest.fixture(scope="module")
def pressed(tmp_path_factory):
    """By the surface, its setup and its frames."""
    if not any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx")):
        pytest.skip("FEniCSx is not installed")
    found = {}
    for cells in (COARSE, FINE):
        case = scene(tmp_path_factory.mktemp("bar"), cells)
        rest, frames = muscle.setup(case), []
        outcome = fenicsx.solve(muscle.build(case, rest), fenicsx.Settings(ranks=1), frames.append)
        assert outcome.status == "converged"
        found[cells] = rest, frames
    return found


@pytest.mark.slow
def test_the_ball_presses_a_coarse_bar_aside_as_a_fine_one(pressed) -> None:
    # The same tetrahedra under both: what differs are the points at which contact is felt, half a millimetre apart in both.
    coarse, fine = (pressed[cells][1] for cells in (COARSE, FINE))
    for one, other in zip(coarse[1:], fine[1:], strict=True):
        assert one.scalars["force_ball"] > 0.1
        assert one.scalars["force_ball"] == pytest.approx(other.scalars["force_ball"], rel=0.01)
        assert one.scalars["contact_area"] == pytest.approx(other.scalars["contact_area"], rel=0.03)
        assert 0 <= one.scalars["contact_depth"] <= one.scalars["contact_pressure"] / 0.5 + 1e-9  # gives way by p / k
    # At the end the ball's middle is 13 mm beyond where the bar's axis was: nearest vertices of both go with the bar.
    shared = np.linalg.norm(pressed[COARSE][0].surface.points[:, None] - pressed[FINE][0].surface.points, axis=2)
    one, other = np.nonzero(shared < 1e-6)
    assert len(one) > 20
    moves = [frames[-1].surface - rest.surface.points for rest, frames in pressed.values()]
    assert np.abs(moves[0][one] - moves[1][other]).max() < 0.1
    assert np.linalg.norm(moves[0], axis=1).max() > 10


@pytest.mark.slow
def test_that_a_coarse_surface_does_not_show_the_dent_is_said(pressed) -> None:
    # The bar has been pressed aside with a give of half a millimetre; what 34 vertices say of it passes through the ball, and what
    # is not shown is not called zero. Triangles of 3 mm show most of it.
    depths = {
        cells: deepest(rest, [frame.number for frame in frames], [frame.surface for frame in frames])
        for cells, (rest, frames) in pressed.items()
    }
    assert depths[COARSE][0] == depths[FINE][0] == 0
    assert depths[COARSE][-1] > 2
    assert pressed[FINE][1][-1].scalars["contact_depth"] < depths[FINE][-1] < 1.5
