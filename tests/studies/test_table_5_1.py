"""The kinds of solvers in Table 5.1 on scenes: who is measured, how fast, how far off, and what the page says."""

import json
import math
import shlex
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import small
import stand_ins

from fem_reference import cli, solvers
from fem_reference.assessment.solver_table import Overall, Scenario, SolverKind, SolverResult, Table
from fem_reference.metrics import Measure
from fem_reference.report import ranking_page
from fem_reference.runs import store
from fem_reference.runs.store import Frame, Outcome
from fem_reference.scenes import casefile
from fem_reference.scenes.case import Candidate, SolverChoice
from fem_reference.solvers import fenicsx
from fem_reference.studies import table_5_1

pytestmark = pytest.mark.slow

PBD = {"sub_iterations": 1, "solver_iterations": 1, "damping": 0.0, "stretch": 1.0, "volume": 1.0, "bending": 0.5}
ROWS = (
    SolverKind(name="FEM", form="Volumetric model", speed="---", precision="+++", literature="[59]"),
    SolverKind(
        name="PBD",
        form="Surface model",
        speed="++",
        precision="?",
        literature="[62]",
        of_case=("pb*",),
    ),
)
STILL = Candidate(name="still", solver="pbd", **PBD | {"stretch": 0.0, "volume": 0.0, "bending": 0.0})


def shift(problem, _, sink) -> Outcome:
    """In place of the reference: everything moves up, by the frame number [mm]."""
    for number in problem.frames:
        up = np.array([0, 0, float(number)])
        sink(Frame(number, problem.surface.points + up, problem.fibres.points + up))
    return Outcome("converged", "done", {"seconds_solve": 8.0})


@pytest.fixture
def case(tmp_path, monkeypatch):
    """The small scene, its reference shifted, and a table of two kinds."""
    stand_ins.solve_by(monkeypatch, fenicsx, shift)
    stand_ins.unchecked(monkeypatch)
    monkeypatch.setattr(table_5_1, "solver_kinds", lambda: ROWS)
    monkeypatch.setattr(solvers, "in_table", lambda kind: (STILL,) if kind == "PBD" else ())
    return small.write(tmp_path / "bar")


def page(case, *words: str) -> tuple[int, dict, str]:
    out = case.parent / "out"
    status = cli.main(["page", "table-5-1", "--case", str(case), *words, "--out", str(out), "--quiet"])
    (written,) = out.glob("table-5-1*.json")
    return status, json.loads(written.read_text()), written.with_suffix(".html").read_text()


def test_everybody_is_measured_against_the_reference(case) -> None:
    status, facts, html = page(case)
    assert status == cli.DONE
    assert [(one["kind"], one["name"]) for one in facts["results"]] == [
        ("FEM", "reference"),
        ("PBD", "pbd"),
        ("PBD", "still"),
    ]
    reference, _, still = facts["results"]
    # 8 s for the four frames after the first; nobody asked for its error bar.
    assert reference["seconds_per_frame"] == 2.0
    assert set(reference["worst"].values()) == {None}
    # Nothing but attached vertices moves in a solver without constraints: in frame 20, where they are back at rest, the whole
    # surface is 20 mm below the reference's, and so is that of the greatest displacement, 100 %.
    assert still["worst"]["surface_deviation.rms"] == pytest.approx({"value": 20.0, "frame": 20, "unit": "mm"})
    assert still["worst"]["surface_deviation.rms_percent"]["value"] == pytest.approx(100.0)
    assert facts["scenarios"][0]["travel_mm"] == pytest.approx(20.0)
    for word in ("Surface model", "still", "20", "<svg"):
        assert word in html


def test_sizes_for_quick_solutions_changes_and_error_bars_are_taken_where_asked(case) -> None:
    """A quick size that ends at frame 10, 10 mm up; a change that ends at frame 5; and bars of the reference."""
    with (case / "case.toml").open("a") as file:
        file.write('\n[quick]\n"frames.last" = 10\n')
    for words, end in (([], 20), (["--quick"], 10), (["--quick", "--set", "frames.last=5", "--error-bar"], 5)):
        _, facts, _ = page(case, *words, "--name", f"table-5-1-{end}")
        assert facts["scenarios"][0]["travel_mm"] == pytest.approx(end)
        for one in (case.parent / "out").glob("table-5-1*"):
            one.unlink()
    bar = facts["results"][0]["worst"]["surface_deviation.rms"]
    assert (bar["value"], bar["unit"]) == (pytest.approx(0, abs=1e-6), "mm")  # all sizes are shifted alike


def test_parameters_are_counted_from_records(case) -> None:
    """Attachments and bones are those of the case; a default that is written out is no parameter."""
    read = casefile.read_muscle(case)
    context = SimpleNamespace(fibres=[None] * 7)

    def count(solver: str, **settings) -> dict[str, int]:
        return table_5_1.needs(read, SolverChoice(solver=solver, **settings), context)

    ends, bones = len(read.attachment), len(read.bone)
    assert count("pbd", **PBD) == {"settings": len(PBD), "attachments": ends}
    collision = {"gap": "0 mm", "stiffness": 1.0}
    assert count("pbd", **PBD, collision=collision) == {"settings": len(PBD) + 2, "attachments": ends, "bones": bones}
    assert count("rbf_muscle", gaussians=9, iterations=10)["settings"] == 1
    assert count("line_of_action") == {"attachments": ends, "fibres": 7}
    via = [{"at": 0.25, "bone": "a"}, {"at": 0.75, "bone": "b"}]
    assert count("line_of_action", via=via)["settings"] == 4
    assert count("recorded", folder="frames") == {}
    plain = count("fenicsx")
    assert plain["effects"] == sum(map(table_5_1.stated, read.effects)) > 0
    assert "settings" not in plain


def test_a_foreign_solver_stands_in_the_same_table(case, tmp_path) -> None:
    folder = tmp_path / "mine"
    folder.mkdir()
    rest = small.body()
    for number in (0, 5, 10, 15, 20):
        store.files.write_surface(
            folder / f"frame_{number}.vtp", rest, rest.points + [0, 0, number + 0.25 * (number == 20)]
        )
    (folder / "candidate.toml").write_text("seconds_per_frame = 0.5\nthreads = 3\n")
    status, facts, html = page(case, "--candidate", f"{case}={folder}")
    assert status == cli.DONE
    mine = facts["results"][-1]
    assert (mine["kind"], mine["name"], mine["solver"]) == ("Yours", "mine", "recorded")
    assert mine["seconds_per_frame"] == 0.5
    assert "3 threads" in html
    assert mine["worst"]["surface_deviation.rms"]["value"] == pytest.approx(0.25, abs=1e-4)  # files of single precision
    assert "Yours" in html


def test_a_command_stands_in_the_same_table(case) -> None:
    own = Path(__file__).parents[2] / "examples" / "own_command" / "relax.py"
    words = f"{shlex.quote(sys.executable)} {shlex.quote(str(own))} --iterations {{iterations}} {{scene}} {{out}}"
    status, facts, html = page(case, "--solver-command", words)
    assert status == cli.DONE
    mine = facts["results"][-1]
    assert (mine["kind"], mine["name"], mine["solver"]) == ("Yours", "relax", "command")
    assert mine["seconds_per_frame"] > 0
    assert "relax" in html


def test_a_scene_that_is_not_there_is_left_out_and_reported(case, capsys) -> None:
    (case / "bar.vtp").unlink()
    made = table_5_1.stand([casefile.read_muscle(case)], case.parent, {})
    assert (made.scenarios, made.results) == ((), ())
    assert "bar.vtp" in made.missing["bar"]
    assert "Left out" in ranking_page.page(made).html()
    assert "bar: left out" in ranking_page.text(made)
    # One that was asked for by name is an error.
    assert cli.main(["page", "table-5-1", "--case", str(case), "--quiet"]) == cli.BAD_INPUT
    assert "bar.vtp" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "place"),
    [
        (["--candidate", "somewhere"], '--candidate: got "somewhere", want CASE=DIR'),
        (["--candidate", "hip_flexion=."], '--candidate: got "hip_flexion", want one of bar'),
        (["--candidate", "CASE="], '--candidate: got "", want a folder of frames'),
        (["--candidate", "CASE=pbd"], '--candidate: got "pbd", want a folder of frames'),
        (["--candidate", "CASE=TWICE", "--candidate", "CASE=TWICE"], '--candidate: got "twice" twice, want'),
        (["--candidate", "CASE=reference"], '--candidate: got "reference", want another name'),
    ],
)
def test_a_foreign_solver_that_cannot_stand_is_bad_input(case, words, place, capsys, monkeypatch) -> None:
    monkeypatch.chdir(case.parent)
    for name in ("twice", "reference"):
        (case.parent / name).mkdir()
    words = [word.replace("CASE", str(case)).replace("TWICE", "twice") for word in words]
    assert cli.main(["page", "table-5-1", "--case", str(case), *words, "--quiet"]) == cli.BAD_INPUT
    assert place in capsys.readouterr().err


def test_other_pages_have_no_candidates(capsys) -> None:
    assert cli.main(["page", "octave-examples", "--case", "rod", "--quiet"]) == cli.BAD_INPUT
    said = capsys.readouterr().err
    assert (
        "page: got --case for octave-examples, want this option for table-5-1, error-bars and estimation only" in said
    )


def table(*found: SolverResult) -> Table:
    scenarios = tuple(Scenario(f"case{i}", f"Case {i}", 100 * (i + 1), 50.0, Outcome("converged", "")) for i in (0, 1))
    return Table(ROWS, scenarios, found, {}, {}, ("this machine",))


def solver_result(case: str, *values: float, seconds: float | None = 0.01) -> SolverResult:
    measures = (Measure("surface_deviation", "rms_percent", "%", np.array(values)),)
    return SolverResult(
        "PBD", "pbd", "pbd", case, Outcome("converged", ""), seconds, measures, tuple(range(len(values))), ""
    )


def test_what_is_worst_over_frames_and_scenes() -> None:
    made = table(solver_result("case0", 1.0, -7.0, 3.0), solver_result("case1", 2.0, 2.5, seconds=0.5))
    assert made.results[0].worst("surface_deviation", "rms_percent") == (-7.0, 1)
    assert made.results[0].worst("volume", "deviation") is None
    overall = made.over("PBD", "pbd", "surface_deviation", "rms_percent")
    assert overall == Overall(median=(7.0 + 2.5) / 2, worst=-7.0, case="case0", count=2)
    assert made.over("PBD", "nobody", "surface_deviation", "rms_percent") is None
    assert made.speed("PBD", "pbd") == (made.scenarios[1], 0.5)  # that with more triangles
    # A scene that was not come through is printed, and does not hide behind the others, nor they behind it.
    lost = table(solver_result("case0", 1.0, math.nan), solver_result("case1", 99.0))
    overall = lost.over("PBD", "pbd", "surface_deviation", "rms_percent")
    assert overall == Overall(99.0, 99.0, "case1", 1, ("case0",))
    assert "failed on case0" in ranking_page.page(lost).html()
    nowhere = table(solver_result("case0", math.nan)).over("PBD", "pbd", "surface_deviation", "rms_percent")
    assert (nowhere.count, nowhere.lost) == (0, ("case0",))


def test_bad_input_is_not_an_empty_table(capsys) -> None:
    assert cli.main(["page", "table-5-1", "--case", "nowhere", "--quiet"]) == cli.BAD_INPUT
    assert "nowhere" in capsys.readouterr().err
