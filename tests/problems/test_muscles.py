"""Several muscles as one problem: each keeps its place in joined arrays, only near ones touch, and one muscle is not all."""

from pathlib import Path

import numpy as np
import pytest
import shapes

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines
from fem_reference.io import files
from fem_reference.problems import muscles, of_case
from fem_reference.runs.store import Frame, Outcome, collected
from fem_reference.scenes import casefile
from fem_reference.scenes.case import SolverChoice
from fem_reference.studies import judging
from fem_reference.studies.execution import Bench

COUNTS = {"a": (1, 1, 2), "b": (1, 1, 3)}
ARAP = {"weights": "clamped cotangent", "iterations": 4, "volume_constraint": True}
BOXES = {"floor": -5, "lid": 25}
ENDS = "".join(
    f'[[muscle.attachment]]\nname = "{name}"\nbone = "{bone}"\nwithin = "0.1 mm"\n'
    for name, bone in (("low", "floor"), ("top", "lid"))
)


def text(effects: str = "listed", slide: int = 2) -> str:
    """Two bars of 10 x 10 x 20 mm, 5 mm apart, between a floor and a lid that slides along them."""
    bones = "".join(
        f'[[bone]]\nname = "{name}"\nbox = {{ centre = "10, 5, {z} mm", size = "60, 60, 10 mm" }}\n'
        for name, z in BOXES.items()
    )
    knots = f'[{{ frame = 0, distance = "0 mm" }}, {{ frame = 2, distance = "{slide} mm" }}]'
    motion = f"[bone.motion]\ndirection = [1, 0, 0]\nkeyframes = {knots}\n"
    own = "".join(
        f'[[muscle]]\nname = "{name}"\nsurface = "{name}.vtp"\nunit = "mm"\ntet_size = "10 mm"\nmesher = "block"\n{ENDS}'
        '[muscle.fibres.polylines]\nfile = "lines.vtp"\nunit = "mm"\n'
        + ('[[muscle.effect]]\nname = "viscosity"\neta = "1 kPa s"\n' if name == "b" else "")
        for name in COUNTS
    )
    effect = '[[effect]]\nname = "neo_hooke"\nmu = "10 kPa"\n[[effect]]\nname = "incompressible"\nbulk = "10 MPa"\n'
    touching = '[[effect]]\nname = "touching"\nstiffness = "1 MPa/mm"\nsmoothing = "0.1 mm"\n'
    head = f'title = "Two"\nproves = "so"\neffects = "{effects}"\n'
    frames = '[frames]\nfirst = 0\nlast = 2\nevery = 1\ninterval = "1 s"\n[reference]\nsolver = "fenicsx"\n'
    return head + own + bones + motion + effect + touching + frames


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for i, (name, counts) in enumerate(COUNTS.items()):
        bar = shapes.skin(shapes.box(counts, (10.0, 10.0, 20.0)))
        files.write_surface(tmp_path / f"{name}.vtp", bar, bar.points + [15 * i, 0, 0])

    lines = Polylines(np.array([[5.0, 5, 1], [5, 5, 10], [5, 5, 19]]), np.array([0, 3]))
    files.write_polylines(tmp_path / "lines.vtp", lines, lines.points)
    return tmp_path


def case_of(folder: Path, **how):
    (folder / "case.toml").write_text(text(**how), encoding="utf-8")
    return casefile.read(folder)


@pytest.mark.slow
def test_muscles_that_cannot_come_near_do_not_touch(folder: Path) -> None:
    # 5 mm apart at rest, less what the lid moves either, and the spacing of points.
    for slide, near in ((1, False), (3, True)):
        case = of_case.chosen(case_of(folder, effects="auto", slide=slide))
        assert (case.touching is not None) is near
        said = next(str(one) for one in case.decisions if one.effect.title == "MuscleContact")
        assert ("left out" in said) is not near
        rest = of_case.setup(case_of(folder, slide=slide))
        assert rest.pairs == ((("a", "b"),) if near else ())
        gap = muscles.clearance(rest.muscles["a"], rest.muscles["b"])
        assert 5 - 2 * slide - 1 < gap < 5 - 2 * slide


@pytest.mark.slow
def test_a_run_whose_muscles_must_not_cross_is_another_one(folder: Path) -> None:
    """Contact that "auto" leaves out is in no equation, and yet muscles are checked: nothing unchecked is taken up for it."""
    without = of_case.chosen(case_of(folder, effects="auto", slide=1))
    plain = case_of(folder, slide=1)
    assert without.touching is None
    assert without.apart
    shared = tuple(one for one in plain.effect if one is not plain.touching)
    never = plain.model_copy(update={"effect": shared})
    same = without.model_copy(update={"muscle": never.muscle})  # auto leaves out the viscosity too
    assert not never.apart
    assert same.model_copy(update={"decisions": ()}).key == never.key
    assert same.key != never.key


@pytest.mark.slow
def test_loads_and_bones_that_press_bring_muscles_nearer(folder: Path) -> None:
    """Muscles that the lid alone keeps 3 mm apart may touch where a load bends them, or where a bone that rests is in their way."""
    gravity = '[[effect]]\nname = "gravity"\ndensity = "1060 kg/m3"\nacceleration = "9.81, 0, 0 m/s^2"\nramp = []\n'
    gravity = gravity.replace("ramp = []", "ramp = [{ frame = 0, amount = 0.0 }, { frame = 2, amount = 1.0 }]")
    wall = '[[bone]]\nname = "wall"\nbox = { centre = "-6, 5, 10 mm", size = "10, 10, 10 mm" }\n'
    contact = '[[effect]]\nname = "contact"\nstiffness = "1 MPa/mm"\nsmoothing = "0.1 mm"\nbones = ["wall"]\n'
    pushed = text(slide=-2).replace("[frames]", f"{wall}{contact}[frames]")
    near = {}
    for name, scene in (("alone", text(slide=-2)), ("load", f"{text(slide=1)}{gravity}"), ("pulley", pushed)):
        (folder / "case.toml").write_text(scene, encoding="utf-8")
        near[name] = of_case.setup(casefile.read(folder)).pairs
    assert near == {"alone": (), "load": (("a", "b"),), "pulley": (("a", "b"),)}


@pytest.mark.slow
def test_each_muscle_has_its_part_of_what_is_joined(folder: Path) -> None:
    case = case_of(folder)
    problem = of_case.problem(case, of_case.setup(case))
    body, rest, b = problem.body, problem.rest, problem.spans[1]
    assert [effect.title for effect in body.effects] == ["NeoHooke", "Incompressible", "Viscosity in b"]
    first, last = body.within["b"]
    assert body.mesh.points[body.mesh.cells[first:last]][..., 0].min() == 15
    assert (first, last) == (b.cells.start, b.cells.stop)
    assert {"a low", "a free", "b top"} <= set(body.mesh.facets)
    assert rest.surface.points[b.vertices] == pytest.approx(problem.problems["b"].surface.points)
    assert rest.mesh.points[rest.mesh.tets[b.cells]].reshape(-1, 3)[:, 0].min() == 15


def test_friction_between_muscles_is_that_of_the_parts_that_touch(folder: Path) -> None:
    rough = text(slide=3).replace('smoothing = "0.1 mm"\n', 'smoothing = "0.1 mm"\nfriction = 0.2\n')
    (folder / "case.toml").write_text(rough)
    case = casefile.read(folder)
    body = of_case.problem(case, of_case.setup(case)).body
    assert [(law.friction, law.relaxed) for law in body.touching] == [(0.2, None)]
    assert body.rubs
    (folder / "case.toml").write_text(rough.replace("0.2", "0.0"))
    with pytest.raises(InputError, match=r"friction: got 0\.0"):
        casefile.read(folder)


@pytest.mark.slow
def test_nothing_of_one_muscle_is_made_of_several(folder: Path, tmp_path: Path) -> None:
    bench = Bench(case_of(folder), tmp_path / "runs")
    with pytest.raises(InputError, match=r'"arap_pbd" for several muscles, want the reference'):
        bench.obtain("arap", SolverChoice(solver="arap_pbd", **ARAP), "solver")
    with pytest.raises(InputError, match="a case of several muscles, want the case of a muscle"):
        bench.of_muscle()
    with pytest.raises(InputError, match=r"several \(a, b\), want a case of one muscle"):
        _ = bench.problem().muscle
    rest = collected([Frame(0, bench.problem().rest.surface.points)], Outcome("converged", ""), bench.problem().rest)
    with pytest.raises(InputError, match="a comparison of several muscles as one"):
        judging.compare(bench, rest, [])


@pytest.mark.slow
def test_a_motion_there_and_back_between_frames_counts(folder: Path) -> None:
    """The lid slides by 3 mm up to frame 1, and is back at frame 2, where alone it would have to be looked at."""
    scene = text().replace(
        '{ frame = 2, distance = "2 mm" }', '{ frame = 1, distance = "3 mm" }, { frame = 2, distance = "0 mm" }'
    )
    (folder / "case.toml").write_text(scene.replace("every = 1", "every = 2"))
    rest = of_case.setup(casefile.read(folder))
    (folder / "case.toml").write_text(scene.replace('"3 mm"', '"0 mm"').replace("every = 1", "every = 2"))
    still = of_case.setup(casefile.read(folder))
    far, near = (muscles.clearance(*one.muscles.values()) for one in (still, rest))
    assert far - near == pytest.approx(6.0, abs=1e-9)  # each may come nearer by 3 mm


@pytest.mark.slow
def test_a_load_on_one_muscle_is_carried_by_bones_and_by_the_other_muscle(folder: Path, tmp_path: Path) -> None:
    """Bars 0.35 mm apart, of which the weight of one (0.2 N, ten times that of tissue) presses it onto the other: the second
    check knows the push, as the load of each is what bones and the other carry, to what Newton's method leaves.
    """
    other = files.read_surface(folder / "b.vtp", 1.0)
    files.write_surface(folder / "b.vtp", other, other.points - [4.65, 0, 0])
    gravity = (
        '[[muscle.effect]]\nname = "gravity"\ndensity = "1e4 kg/m3"\nacceleration = "9.81, 0, 0 m/s^2"\n'
        "ramp = [{ frame = 0, amount = 0.0 }, { frame = 2, amount = 1.0 }]\n"
    )
    scene = text(slide=0).replace('[[muscle]]\nname = "b"', f'{gravity}[[muscle]]\nname = "b"')
    scene = (
        scene.replace('10 mm"\nmesher', '5 mm"\nmesher')
        .replace("1 MPa/mm", "100 kPa/mm")
        .replace('0.1 mm"\n[fr', '0.3 mm"\n[fr')
    )
    (folder / "case.toml").write_text(scene, encoding="utf-8")
    run = Bench(casefile.read(folder), tmp_path / "runs").reference()
    assert run.outcome.status == "converged"
    push, weight = run.scalars["a.force_on_b_x"][-1], 1e-8 * 9810 * 2000
    assert 0.05 * weight < push < weight
    assert run.scalars["b.force_on_a_x"][-1] == pytest.approx(-push, rel=1e-9)
    carried = push + sum(run.scalars[f"a.force_on_{bone}_x"][-1] for bone in BOXES)
    assert carried == pytest.approx(weight, abs=1e-6)
