"""Folders of runs while they are made: by one at a time, with the error bars kept beside them."""

import logging
import threading
from pathlib import Path

import numpy as np
import pytest
import shapes
import small

from fem_reference.assessment import error_bars
from fem_reference.problems.problem import AtRest
from fem_reference.runs.key import versions
from fem_reference.runs.store import Frame, Outcome
from fem_reference.runs.writer import Writer
from fem_reference.scenes import casefile
from fem_reference.scenes.case import SolverChoice
from fem_reference.studies.execution import Bench
from fem_reference.studies.run_folders import bars_kept, locked, without_states


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
