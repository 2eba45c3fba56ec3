"""Runs while they are made: by one process at a time, with the error bars kept beside them, and watched for omitted effects."""

import importlib.util
import logging
import re
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import random_scenes
import shapes
import small
from auto_scenes import ACTIVE, STILL, pennate, solved_as

from fem_reference.assessment import error_bars
from fem_reference.problems.problem import AtRest
from fem_reference.runs.key import versions
from fem_reference.runs.store import Frame, Outcome, Run, load
from fem_reference.runs.writer import Writer
from fem_reference.scenes import casefile
from fem_reference.scenes.case import SolverChoice
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers import fenicsx
from fem_reference.studies import making
from fem_reference.studies.execution import Bench
from fem_reference.studies.making import bars_kept, locked
from fem_reference.studies.variations import without_states


@pytest.mark.slow
def test_a_run_asked_for_twice_at_a_time_is_made_once(tmp_path, caplog) -> None:
    caplog.set_level(logging.INFO, logger="fem_reference")
    scene = casefile.read(small.write(tmp_path / "bar"))
    made = []

    def ask() -> None:
        made.append(Bench(scene, tmp_path / "runs").obtain("pbd", scene.candidate[0], "candidate[0]"))

    threads = [threading.Thread(target=ask) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(made) == 2
    assert np.array_equal(made[0].positions, made[1].positions)
    assert caplog.text.count("solved before") == 1


def test_a_folder_that_is_locked_waits_for_its_turn(tmp_path: Path) -> None:
    said: list[str] = []

    def second() -> None:
        with locked(tmp_path / "runs" / "one"):
            said.append("second")

    with locked(tmp_path / "runs" / "one"):
        thread = threading.Thread(target=second)
        thread.start()
        thread.join(0.2)
        assert thread.is_alive()
        said.append("first")
    thread.join()
    assert said == ["first", "second"]
    with locked(tmp_path / "runs" / "one"), locked(tmp_path / "runs" / "two"):  # others do not wait
        assert not (tmp_path / "runs" / "one").exists()


def test_a_run_over_its_time_ends_with_the_frames_that_it_reached(tmp_path: Path) -> None:
    """No limit is nearer than none: a run within it converges."""
    surface = shapes.sphere(0)

    def solve(sink: Callable[[Frame], None]) -> Outcome:
        for number in (0, 1, 2):
            begin = time.process_time()
            while time.process_time() < begin + 0.15:
                pass
            sink(Frame(number, surface.points))
        return Outcome("converged", "")

    for limit, status, reached in ((10.0, "converged", 3), (0.25, "timed out", 2)):
        identity = {"name": "one", "solver": "test", "frames": (0, 1, 2), "origin": {}}
        writer = Writer(tmp_path / status.split()[0], identity, AtRest(surface))
        making.write(writer, solve, None, limit)
        found = load(writer.folder)
        assert (found.outcome.status, len(found.numbers)) == (status, reached)


@pytest.mark.parametrize(("numpy", "kept"), [(None, True), ("0", False)])
def test_error_bars_stay_where_the_same_packages_solve_again(numpy: str | None, kept: bool, tmp_path: Path) -> None:
    made = versions() | ({} if numpy is None else {"numpy": numpy})
    surface = shapes.sphere(0)
    folder = tmp_path / "run"

    def make() -> None:
        identity = {"name": "one", "solver": "test", "frames": (0,), "origin": {"versions": made}}
        writer = Writer(folder, identity, AtRest(surface))
        writer.add(Frame(0, surface.points))
        writer.close(Outcome("converged", ""))

    make()
    (folder / error_bars.FILE).write_text("bars")
    with bars_kept(folder):
        make()
        assert not (folder / error_bars.FILE).exists()
    assert (folder / error_bars.FILE).exists() == kept


def test_only_a_reference_is_asked_to_keep_no_states() -> None:
    reference, other = SolverChoice(solver="fenicsx", element="P2/P1"), SolverChoice(solver="pbd", stretch=1.0)
    assert without_states(reference).settings == {"element": "P2/P1", "store_state": False}
    assert without_states(other) == other


def asked(bench: Bench[MuscleCase]) -> Run:
    """The reference's run, of which a stand-in for the solver has no states to keep."""
    return bench.obtain("reference", without_states(bench.scene.reference), "reference")


def spindle(folder: Path, choice: str, stress: str = "15", effects: str = "") -> MuscleCase:
    """A muscle that is thicker in its middle, between fixed plates, with fibres from one to the other."""
    path = small.write(folder) / "case.toml"
    case = path.read_text().replace('"0.4 rad"', '"0 rad"').replace("last = 20\nevery = 5", "last = 4\nevery = 2")
    case = case.replace("frame = 20", "frame = 3").replace("frame = 10", "frame = 2") + ACTIVE.replace("300", stress)
    path.write_text(f'effects = "{choice}"\n{case}{effects}')
    return casefile.read_muscle(path.parent)


def stiff_spindle(folder: Path, choice: str) -> MuscleCase:
    """The spindle with 300 kPa, and fibres that stiffen where it is stretched."""
    return spindle(folder, choice, "300", small.FIBRES.format(slack=1).replace("300 kPa", "1 MPa"))


def solved_by_choice(folder: Path, scene: Callable[[Path, str], MuscleCase]) -> list[Run]:
    """The runs of a ``scene`` with the effects that are listed, and with those that it needs."""
    cases = [scene(folder / choice, choice) for choice in ("listed", "auto")]
    return [
        Bench(case, folder / f"runs {case.choice}").obtain("reference", case.reference, "reference") for case in cases
    ]


@pytest.fixture(scope="module")
def fem() -> Iterator[None]:
    if not any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx")):
        pytest.skip("FEniCSx is not installed")
    with fenicsx.shared():
        yield


@pytest.mark.slow
@pytest.mark.usefixtures("fem")
@pytest.mark.parametrize(("scene", "moves"), [(pennate, 5.0), (spindle, 0.5), (stiff_spindle, 2.0)])
def test_an_isometric_contraction_is_that_of_the_listed_effects(scene, moves, tmp_path) -> None:
    """300 kPa, or 15, between bones that rest: by an indicator of displacement alone nothing happened, and forces were 0."""
    listed, chosen = solved_by_choice(tmp_path, scene)
    assert listed.outcome.status == chosen.outcome.status == "converged", listed.outcome.message
    assert chosen.positions == pytest.approx(listed.positions, abs=1e-6)
    # Fibres of 300 kPa pull at 100 to 170 mm2 with 30 to 51 N, less what the matrix is pressed and, of the oblique ones, what
    # ends at the sides; those of 15 kPa with a twentieth.
    forces = chosen.scalars["force_origin"]
    assert 1 < forces[-1] < 51
    assert forces == pytest.approx(listed.scalars["force_origin"], rel=1e-6, abs=1e-9)
    assert np.abs(listed.positions - listed.positions[0]).max() > moves


@pytest.mark.slow
@pytest.mark.usefixtures("fem")
def test_a_contraction_without_an_equilibrium_ends_the_same_either_way(tmp_path) -> None:
    """300 kPa without passive fibres: the thin ends are stretched beyond the optimum, where tension falls. By sections that stay
    plane the ends carry the middle up to 10 kPa, at frame 0.14; attached ends are stiffer. It must not end as a contraction.
    """
    listed, chosen = solved_by_choice(tmp_path, lambda folder, choice: spindle(folder, choice, "300"))
    assert listed.outcome.status == chosen.outcome.status == "diverged"
    assert listed.numbers == chosen.numbers == (0,)
    assert listed.outcome.message == chosen.outcome.message
    reached = re.search(r"beyond frame (\S+)", chosen.outcome.message)
    assert reached is not None
    assert 0.14 < float(reached[1]) < 0.4


def inside(points, number):
    """Points on the skin of the bar rest; those inside move along it, which stretches fibres there."""
    z = points[:, 2]
    off = np.abs(points[:, :2] - 5).max(axis=1) < 4.9
    return points + (off * (z > 15) * (z < 25) * 0.5 * number)[:, None] * np.array([0.0, 0.0, 1.0])


@pytest.mark.slow
@pytest.mark.parametrize("stored", [False, True])
def test_fibres_that_are_stretched_inside_only_are_added(stored, tmp_path, monkeypatch, caplog) -> None:
    """The surface rests, and the guess with it: only tetrahedra show it, of a run that is made and of one that is found stored."""
    made = solved_as(monkeypatch, inside)
    if stored:  # by somebody who listed just what "auto" keeps
        plain = pennate(tmp_path / "plain", "listed", "")
        asked(Bench(plain, tmp_path / "runs"))
    scene = pennate(tmp_path / "scene", "auto", random_scenes.EFFECTS["fibre_passive"].format(**STILL))
    bench = Bench(scene, tmp_path / "runs")
    assert len(bench.scene.effects) == 2
    with caplog.at_level("INFO", logger="fem_reference"):
        run = asked(bench)
    assert [len(titles) for titles in made] == [2, 3]
    assert "FibrePassive: found to be needed at frame" in caplog.text
    assert "FibrePassive" in run.origin["effects"]


@pytest.mark.slow
def test_a_run_that_was_watched_to_its_end_is_not_watched_again(tmp_path, monkeypatch) -> None:
    made = solved_as(monkeypatch, lambda points, _: points)
    scene = pennate(tmp_path / "scene", "auto", random_scenes.EFFECTS["fibre_passive"].format(**STILL))
    for _ in range(2):
        bench = Bench(scene, tmp_path / "runs")
        run = asked(bench)
    assert len(made) == 1
    assert run.origin["watched"] == bench.watch().names
    assert bench.watch().frames == {}
    assert not any(making.seen(bench.watch(), run.folder, run.numbers[:3]))  # of one that was cut off
    assert tuple(bench.watch().frames) == run.numbers[:3]
    assert all(sizes.acts == pytest.approx(0, abs=1e-12) for _, sizes in bench.watch().frames.values())


@pytest.mark.slow
@pytest.mark.usefixtures("fem")
def test_a_run_that_is_stopped_at_its_end_goes_on_with_what_matters(tmp_path) -> None:
    """Springs so soft that the bar hardly follows its bones, though these draw it a third longer: its weight is some of the force.
    At frame 0 it does not act yet, so that this frame is good.
    """
    weight = random_scenes.EFFECTS["gravity"].format(density=20.0, weight="0, 0, -9.81")
    found = []
    for choice in ("auto", "listed"):
        case = random_scenes.TEXT.format(**STILL | {"distance": 12.0, "every": 2}, choice=choice, effects=weight)
        case = case.replace('"1.5 mm"', '"1.5 mm"\nstiffness = "0.01 kPa/mm"')
        scene = random_scenes.write(tmp_path / choice, case, random_scenes.lines(0.0, 0.0))
        bench = Bench(scene, tmp_path / f"runs of {choice}")
        found.append(bench.obtain("reference", scene.reference, "reference"))
    chosen, listed = found
    assert any("Gravity: found to be needed at frame 0" in text for text in chosen.origin["effects_chosen"])
    assert "effects were added, from frame 0 on" in chosen.outcome.message
    assert chosen.positions == pytest.approx(listed.positions, abs=1e-6)
    # 4 cm3 of 20 kg/m3 weigh 0.78 mN, which one bone carries more than the other does; springs of 1e-5 MPa/mm over 100 mm2.
    forces = [chosen.scalars[f"force_{name}"][-1] for name in ("origin", "insertion")]
    assert abs(forces[1] - forces[0]) == pytest.approx(4000 * 20e-12 * 9810, rel=1e-3)
