"""Runs are named by all that determines them, made once even when asked for twice at a time, and complete over the frames."""

import logging
import threading
from pathlib import Path

import numpy as np
import pytest
import shapes
import small

from fem_reference import casefile, execution
from fem_reference.errors import InputError
from fem_reference.execution import Bench, complete
from fem_reference.runs import Outcome, Run
from fem_reference.scene import SolverChoice


def bench(folder: Path, **changes) -> Bench:
    return Bench(casefile.read(small.write(folder / "bar"), changes=changes or None), folder / "runs")


def key(made: Bench) -> str:
    return made.key("fenicsx", made.settings(made.scene.reference, "reference"))


def test_the_key_names_what_determines_a_run(tmp_path) -> None:
    base = key(bench(tmp_path))
    assert key(bench(tmp_path)) == base
    different = [
        {"effect[0].mu": "11 kPa"},
        {"frames.every": 10},
        {"muscle.tet_size": "5 mm"},
        {"reference.first_step": 4},
    ]
    assert len({base, *(key(bench(tmp_path, **changes)) for changes in different)}) == 5
    # What only judges, names or concerns the machine does not: such runs are shared.
    for changes in ({"title": "another"}, {"expect[0].within": "1 %"}, {"candidate[0].damping": 0.5}):
        assert key(bench(tmp_path, **changes)) == base
    assert key(Bench(bench(tmp_path).scene, tmp_path, ranks=1)) == base


def test_the_key_changes_with_the_code(tmp_path, monkeypatch) -> None:
    base = key(bench(tmp_path))
    monkeypatch.setattr(execution, "code_hash", lambda _: "another")
    assert key(bench(tmp_path)) != base


def test_the_code_of_a_run_is_that_of_its_solver_and_what_it_imports() -> None:
    folder = Path(execution.__file__).parent / "solvers"
    of_pbd = execution._files(folder, "pbd")
    assert {path.name for path in of_pbd} >= {"pbd.py", "pbd_kernels.py"}
    assert not any("fenicsx" in path.parts or path.name == "listing.py" for path in of_pbd)
    of_reference = execution._files(folder, "fenicsx")
    assert of_reference >= {folder / "fenicsx" / "worker.py", folder / "fenicsx" / "body.py"}
    assert not of_pbd & of_reference
    assert len({execution.code_hash(name) for name in ("pbd", "fenicsx", "recorded")}) == 3


def test_a_run_made_with_other_packages_is_made_again(tmp_path, monkeypatch, caplog) -> None:
    caplog.set_level(logging.INFO, logger="fem_reference")
    made = bench(tmp_path)
    made.obtain("pbd", made.scene.candidate[0], "candidate[0]")
    now = execution.versions()
    monkeypatch.setattr(execution, "versions", lambda: now | {"numba": "0"})
    made.obtain("pbd", made.scene.candidate[0], "candidate[0]")
    assert "solved before, but with another numba" in caplog.text
    # What is not installed here cannot be compared: stored runs are judged where no solver is.
    monkeypatch.setattr(execution, "versions", lambda: {"numpy": now["numpy"]})
    caplog.clear()
    made.obtain("pbd", made.scene.candidate[0], "candidate[0]")
    assert "solved before, taken from" in caplog.text


def test_a_run_asked_for_twice_at_a_time_is_made_once(tmp_path, caplog) -> None:
    caplog.set_level(logging.INFO, logger="fem_reference")
    scene = bench(tmp_path).scene
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


def test_frames_that_were_not_reached_are_not_numbers() -> None:
    rest = shapes.sphere(0)
    positions = np.stack([rest.points, rest.points + 1])
    run = Run(
        "one", "test", Outcome("diverged", "no"), (0, 10), rest, positions, scalars={"energy": np.array([1.0, 2.0])}
    )
    whole = complete(run, (0, 5, 10))
    assert whole.numbers == (0, 5, 10)
    assert np.array_equal(whole.positions[[0, 2]], positions)
    assert np.isnan(whole.positions[1]).all()
    assert whole.fibre_positions is None
    assert np.array_equal(whole.scalars["energy"], [1, np.nan, 2], equal_nan=True)
    assert complete(run, (0, 10)) is run


def test_an_element_that_does_not_suit_the_effects_is_named(tmp_path) -> None:
    scene = casefile.read_muscle(small.write(tmp_path / "bar"))
    bench = Bench(scene, tmp_path / "runs")
    for element, want in (("Q2/Q1", "P2/P0, P2/P1"), ("P1", "P2/P0, P2/P1")):
        with pytest.raises(
            InputError, match=rf'case.toml: reference.element: got "{element}", want one for .*: {want}'
        ):
            bench.settings(SolverChoice(solver="fenicsx", element=element), "reference")


def test_a_run_says_which_effects_its_solver_simulated(tmp_path) -> None:
    made = bench(tmp_path)
    reference, pbd = made.scene.reference, made.scene.candidate[0]
    told = {one.solver: made.origin(one.solver, made.settings(one, "here"))["effects"] for one in (reference, pbd)}
    assert list(told["fenicsx"]) == ["NeoHooke", "Incompressible"]
    assert told["pbd"] == "none"
