"""Contact in a scene: a bar that bends against a ball is pressed aside, starts outside it, and takes no step through it."""

import importlib.util

import numpy as np
import pytest
import small
from slides import Slide

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.motion import apply
from fem_reference.geometry.rigid_bodies import Box
from fem_reference.problems import muscle, shapes
from fem_reference.problems.body import Body
from fem_reference.problems.contact import ContactBone, ContactLaw, nearest_on_path
from fem_reference.scenes import casefile
from fem_reference.solvers import fenicsx
from fem_reference.verification import parts

pytestmark = pytest.mark.slow

BALL = '[[bone]]\nname = "ball"\nsphere = {{ centre = "5, {y}, 30 mm", radius = "4 mm" }}\n\n[[attachment]]\nname = "origin"'
CONTACT = '[[effect]]\nname = "contact"\nstiffness = "1 MPa/mm"\nsmoothing = "0.1 mm"\n\n[fibres]'


def scene(folder, y: float, contact: str = CONTACT):
    """The bar's side is at y = -1.06 mm where the ball is; the ball reaches to ``y`` + 4."""
    path = small.write(folder) / "case.toml"
    text = path.read_text().replace('[[attachment]]\nname = "origin"', BALL.format(y=y).replace("\n[[a", "[[a"), 1)
    path.write_text(text.replace("[fibres]", contact, 1).replace("last = 20", "last = 10"))
    return casefile.read(folder)


def solved(case, ranks: int = 1):
    """The frames of a scene and the depth of the deepest free vertex in the ball in each [mm]."""
    rest = muscle.setup(case)
    built = muscle.build(case, rest)
    frames = []
    settings = fenicsx.Settings(ranks=ranks, first_step=5, residual=1e-9)
    assert fenicsx.solve(built, settings, frames.append).status == "converged"
    ball = rest.bones[-1]
    return frames, [-ball.shape.sample(frame.surface[rest.free]).distance.min() for frame in frames]


@pytest.fixture(scope="module")
def needs_fenicsx() -> None:
    if not any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx")):
        pytest.skip("FEniCSx is not installed")


@pytest.mark.usefixtures("needs_fenicsx")
@pytest.mark.usefixtures("all_cores")
def test_friction_of_a_scene_drags_and_loses_work(tmp_path) -> None:
    # On two ranks each holds its own points.
    rough = CONTACT.replace("[fibres]", "friction = 0.3\n\n[fibres]").replace("\n\nfriction", "\nfriction")
    smooth, _ = solved(scene(tmp_path / "smooth", -5.5))
    (one, _), (two, _) = (solved(scene(tmp_path / f"{ranks}", -5.5, rough), ranks) for ranks in (1, 2))
    assert "friction_work" not in smooth[-1].scalars
    works = [frame.scalars["friction_work"] for frame in one]
    assert works[0] == 0
    assert (np.diff(works) >= 0).all()
    assert works[-1] > 0
    assert np.linalg.norm(one[-1].forces["ball"] - smooth[-1].forces["ball"]) > 0.01 * np.linalg.norm(
        one[-1].forces["ball"]
    )
    # The residual of 1e-9 N over forces of the order of 1e-2 N.
    assert two[-1].forces["ball"] == pytest.approx(one[-1].forces["ball"], abs=1e-6)
    assert two[-1].scalars["friction_work"] == pytest.approx(works[-1], rel=1e-4)
    # Newton's residual on a body of 10 kPa and 10 mm: 1e-8 mm.
    assert two[-1].surface == pytest.approx(one[-1].surface, abs=1e-6)
    assert two[-1].scalars["contact_area"] == pytest.approx(one[-1].scalars["contact_area"], rel=1e-9)


@pytest.mark.usefixtures("needs_fenicsx")
def test_contact_displaces_the_muscle(tmp_path) -> None:
    free, deep = solved(scene(tmp_path / "free", -5.5, "[fibres]"))
    pressed, shallow = solved(scene(tmp_path / "pressed", -5.5))
    assert deep[-1] > 0.5
    last = pressed[-1].scalars
    # At a pressure p the surface gets p / stiffness deep where it is asked; vertices lie between such points, half a tet apart.
    assert 0 < last["contact_depth"] <= last["contact_pressure"] / 1.0 + 1e-9
    assert shallow[-1] < last["contact_depth"] + 0.05
    assert last["force_ball"] > 0
    assert pressed[0].scalars["contact_area"] == 0
    assert "overlap_at_rest" not in last
    assert free[0].surface == pytest.approx(pressed[0].surface, abs=1e-12)


@pytest.mark.usefixtures("needs_fenicsx")
def test_what_overlaps_at_rest_is_relaxed_first_and_reported(tmp_path) -> None:
    case = scene(tmp_path / "bar", -4.6)  # 0.46 mm deep
    assert muscle.build(case, muscle.setup(case)).body.frames == (-10.0, 0, 5, 10)
    frames, depths = solved(case)
    assert [frame.number for frame in frames] == [0, 5, 10]
    first = frames[0].scalars
    assert first["overlap_at_rest"] == pytest.approx(0.46, abs=0.05)  # points are half a tet, 3 mm, apart
    assert first["contact_depth"] < 0.1
    assert depths[0] < first["contact_depth"] + 0.05


@pytest.mark.usefixtures("needs_fenicsx")
def test_in_situ_an_overlap_at_rest_stays_and_is_reported(tmp_path) -> None:
    """The same overlap; nothing moves at the first frame, to the residual over the stiffness."""
    tense = f'[[effect]]\nname = "in_situ"\nstretch = 1.01\n\n{CONTACT}'
    case = scene(tmp_path / "bar", -4.6, tense)
    case = case.model_copy(update={"frames": case.frames.model_copy(update={"last": 5})})
    frames, _ = solved(case)
    first = frames[0]
    assert first.surface == pytest.approx(muscle.setup(case).surface.points, abs=1e-5)
    assert first.scalars["overlap_at_rest"] == pytest.approx(first.scalars["contact_depth"], abs=1e-5)
    assert first.scalars["overlap_at_rest"] == pytest.approx(0.46, abs=0.05)
    assert "mm with bones at rest remains" in first.note


def test_attached_vertices_are_exempt_from_contact(tmp_path) -> None:
    case = scene(tmp_path / "bar", -5.5)
    rest = muscle.setup(case)
    body = muscle.build(case, rest).body
    assert [entry.name for entry in body.bones] == ["floor", "lid", "ball"]
    assert [type(effect).__name__ for effect in body.effects] == ["NeoHooke", "Incompressible"]
    heights = body.contact.on.points[:, 2]
    reach = np.linalg.norm(np.ptp(rest.surface.points, axis=0)) / 80
    assert (
        reach < heights.min() < 1.0 < 39.0 < heights.max() < 40 - reach
    )  # the ends are attached; pieces are 0.5 mm high
    turned = body.bones[1].pose(10)
    assert apply(turned, np.array([[5.0, 5, 30]])) == pytest.approx(np.array([[5, 5, 30]]))


def test_only_some_bones_are_obstacles(tmp_path) -> None:
    some = CONTACT.replace("\n\n", '\nbones = ["ball"]\n\n')
    case = scene(tmp_path / "bar", -5.5, some)
    assert [entry.name for entry in muscle.build(case, muscle.setup(case)).body.bones] == ["ball"]
    with pytest.raises(InputError, match=r'effect\[2\]\.bones: got "bal", want one of floor, lid, ball'):
        scene(tmp_path / "other", -5.5, some.replace("ball", "bal"))


def test_a_step_through_a_plate_is_cut(fem_lab) -> None:
    # A plate 0.2 mm thin jumps over the top of a block in one step: at both ends of the step it touches nothing.
    mesh = shapes.box((2, 2, 2), (1.0, 1.0, 1.0), "tetrahedron")
    attached = parts.SYMMETRY
    plate = ContactBone("plate", Box((0.5, 0.5, 1.2), (4.0, 4.0, 0.2), 0.0), Slide((0.0, 0.0, -0.5)))
    body = Body(
        mesh,
        parts.neo_hooke(0.01, 10.0),
        attached,
        (0.0, 1.0),
        contact=ContactLaw("z1", 1.0, 0.01),
        bones=(plate,),
    )
    state = fem_lab.solve(body, "P2/P1", first_step=1.0, residual=1e-11).last
    assert state.scalars["cut_backs"] > 0
    assert state.forces["plate"][2] < 0
    assert state.points[:, 2].max() == pytest.approx(0.6, abs=0.05)


@pytest.mark.parametrize("start", np.linspace(3.0, 33.0, 11))
def test_no_path_through_a_thin_plate_is_missed(start: float) -> None:
    # A plate 1 mm thin, paths of 36 mm from 3 to 33 mm before it: at most half a millimetre deep, and out on the other side.
    plate = ContactBone("plate", Box((0.0, 0.0, 0.0), (90.0, 90.0, 1.0), 0.0), Slide((0.0, 0.0, 0.0)))
    starts, displacements = np.array([[0.3, 0.2, start], [0.0, 0.0, 40.0]]), np.array([[1.0, 2.0, -36.0]] * 2)
    through, short = nearest_on_path(plate, starts, displacements, 0.1)
    assert -0.5 <= through < -0.3
    assert 3.5 <= short < 4.2  # it ends 3.5 mm above the plate, up to nine tenths of the last gap after the last look


@pytest.mark.usefixtures("needs_fenicsx")
def test_what_relaxes_waits_for_the_first_frame(tmp_path) -> None:
    # The lid would turn before frame 0 if its keyframes began earlier; at rest it is where frame 0 has it.
    path = tmp_path / "bar" / "case.toml"
    scene(tmp_path / "bar", -4.6)
    turning = path.read_text().replace(
        '{ frame = 0, angle = "0 rad" }', '{ frame = -20, angle = "0.3 rad" }, { frame = 0, angle = "0 rad" }'
    )
    path.write_text(turning)
    case = casefile.read(path)
    body = muscle.build(case, muscle.setup(case)).body
    assert body.first == 0
    assert body.bones[1].pose(-10.0) == pytest.approx(np.eye(4))
    top = np.array([[5.0, 5.0, 40.0]])
    assert body.prescribed[1].path(top, -10.0) == pytest.approx(np.zeros((1, 3)))
    assert np.abs(body.prescribed[1].path(top, 5.0)).max() > 0.1


def test_an_obstacle_and_an_attachment_have_names_of_their_own(tmp_path) -> None:
    path = tmp_path / "bar" / "case.toml"
    scene(tmp_path / "bar", -5.5)
    path.write_text(
        path.read_text().replace('name = "origin"', 'name = "floor"').replace('start = "origin"', 'start = "floor"')
    )
    with pytest.raises(InputError, match=r'attachment\[0\]\.name: got "floor", which is also the name of a bone'):
        casefile.read(path)


def test_a_bone_that_the_muscle_swallows_is_refused(tmp_path) -> None:
    case = scene(tmp_path / "bar", 5.0)
    with pytest.raises(InputError, match=r"case.toml: bone\[2\]: got a bone entirely inside the muscle"):
        muscle.build(case, muscle.setup(case))
