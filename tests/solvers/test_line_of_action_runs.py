"""Lines of action through the run store, the comparison and the page: runs without a surface."""

import csv
import json
import re
import sys
from pathlib import Path

import pytest
import small

from fem_reference.cli import main
from fem_reference.foundations.errors import InputError
from fem_reference.report import gallery
from fem_reference.studies import execution, workflow

pytestmark = pytest.mark.slow


CANDIDATES = """
[[candidate]]
name = "line"
solver = "line_of_action"

[[candidate]]
name = "around"
solver = "line_of_action"
obstacle = [{ bone = "floor", sphere = { centre = "5, 5, 20 mm", radius = "3 mm" } }]

[[candidate]]
name = "springs"
solver = "mass_spring"
stiffness = "1 N/mm"
density = "1060 kg/m3"
frame_time = "10 ms"
damping = "eq. 5.5"
"""
EXPECTED = """
[[expect]]
of = "candidates"
metric = "{metric}"
statistic = "max"
frame = "any"
truth = "0 mm"
within = "{within} mm"
kind = "property"
because = "tested here"
"""


def scene(folder: Path) -> Path:
    """The small scene with mass-spring as its reference, which takes no finite elements, and lines among the candidates."""
    small.write(folder)
    text = (folder / "case.toml").read_text()
    head, rest = text.split("[[candidate]]")[0], text[text.index("[[expect]]") :]
    reference = 'solver = "mass_spring"\nstiffness = "1 N/mm"\ndensity = "1060 kg/m3"\nframe_time = "20 ms"\n'
    head = head.replace('solver = "fenicsx"\nfirst_step = 5\n', reference + 'damping = "0.01 N s/m"\n')
    expected = EXPECTED.format(metric="surface_deviation", within=5) + EXPECTED.format(metric="fibre_length", within=9)
    rest = rest.replace('within = "0.5 %"', 'within = "50 %"').replace(
        "[negative_control]", expected + "\n[negative_control]"
    )
    (folder / "case.toml").write_text(head + CANDIDATES + rest)
    return folder


SPHERE = 'name = "line"\nobstacle = [{{ bone = "{}", sphere = {{ centre = "{}", radius = "6 mm" }} }}]\n'
MULTIGRID_ON_TWO_RANKS = 'name = "line"\nsolver = "fenicsx"\nranks = 2\nlinear_solver = "multigrid"'
SPHERE_ON_NOTHING, SPHERE_AROUND_THE_END = SPHERE.format("skull", "5, 5, 20 mm"), SPHERE.format("lid", "5, 5, 40 mm")


@pytest.fixture(scope="module")
def compared(tmp_path_factory) -> tuple[dict, Path]:
    folder = tmp_path_factory.mktemp("lines")
    printed = folder / "printed.json"
    case = scene(folder / "bar")
    with pytest.MonkeyPatch.context() as patch:  # pictures take seconds, and lines are in none
        patch.setattr(gallery, "program", lambda _job, _folder: [sys.executable, "-c", "raise SystemExit(3)"])
        assert main(["compare", str(case), "--out", str(folder / "out"), "--json", str(printed), "--quiet"]) == 0
    return json.loads(printed.read_text()), folder / "out"


def test_lines_are_measured_and_judged_on_their_lengths_alone(compared) -> None:
    printed, _ = compared
    metrics = {
        name: {row["metric"] for row in printed["measures"] if row["candidate"] == name} for name in printed["cost"]
    }
    assert metrics["line"] == metrics["around"] == {"fibre_ends", "fibre_length", "moment_arm"}
    assert {"fibre_length", "surface_deviation", "volume", "penetration"} <= metrics["springs"]
    judged = {(row["of"], row["metric"]): row["verdict"] for row in printed["verdicts"]}
    assert judged == {
        ("reference", "volume"): "pass",
        ("springs", "surface_deviation"): "pass",
        ("springs", "fibre_length"): "pass",
        ("line", "fibre_length"): "pass",
        ("around", "fibre_length"): "pass",
    }
    assert {row["candidate"] for row in printed["from_rest"] if row["metric"] == "volume"} == {"reference", "springs"}


def test_a_line_is_shorter_than_its_fibre_at_rest_already(compared) -> None:
    printed, out = compared
    rows = {
        (row["candidate"], row["statistic"]): row["value"]
        for row in printed["measures"]
        if row["frame"] == 0 and row["metric"] == "fibre_length" and row["value"] is not None
    }
    assert rows["springs", "max"] == pytest.approx(0, abs=1e-9)
    assert -1 < rows["line", "mean"] < -0.01  # fibres of a bulging bar are bent
    assert rows["around", "mean"] > rows["line", "mean"]
    written = list(csv.DictReader((out / "bar" / "measures.csv").read_text().splitlines()))
    assert {row["metric"] for row in written if row["candidate"] == "line"} == {
        "fibre_ends",
        "fibre_length",
        "moment_arm",
    }
    assert all(row["value"] for row in written)


def test_the_page_shows_a_dash_and_says_that_there_is_no_surface(compared) -> None:
    _, out = compared
    text = (out / "bar" / "report.html").read_text(encoding="utf-8")
    for name in ("line", "around"):
        assert f"<b>{name}</b> has no surface to draw" in text
        row = text.split(f"<th>{name}<small>line_of_action</small></th>")[1].split("</tr>")[0]
        assert row.count("<td>\N{EN DASH}</td>") == 6  # of 8 columns of measures two are of fibres
        assert " ms</td>" in row  # the time of a frame is known
    assert "A row of dashes means that the solver computes only lines" in text
    assert "Surface of springs: distance to the reference" in text
    assert "Surface of line: distance to the reference" not in text
    assert "has no frame whose coordinates" not in text


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('name = "line"\n', 'name = "line"\nvia = [{ at = 0.5, bone = "skull" }]\n', 'via[0].bone: got "skull", want one of'),
        ('name = "line"\n', SPHERE_ON_NOTHING, 'obstacle[0].bone: got "skull", want one of floor, lid'),
        ('name = "line"\n', SPHERE_AROUND_THE_END, "an obstacle with all fixed points outside"),
        ('name = "line"\nsolver = "line_of_action"', MULTIGRID_ON_TWO_RANKS, "ranks: got 2, want 1"),
    ],
)  # fmt: skip
def test_what_a_candidate_cannot_have_is_refused_before_the_reference_is_solved(
    old, new, message, tmp_path, capsys, monkeypatch
) -> None:
    case, out = scene(tmp_path / "bar"), tmp_path / "out"
    monkeypatch.setattr(execution, "Writer", lambda *_: pytest.fail("something was solved"))
    text = (case / "case.toml").read_text()
    assert old in text
    (case / "case.toml").write_text(text.replace(old, new, 1))
    for verb in ("validate", "run", "compare"):
        words = [verb, str(case), "--out", str(out), "--quiet"]
        assert main(words) == 2
        printed = capsys.readouterr().err
        assert message in printed, verb
        assert "case.toml: candidate[0]." in printed, verb
    with pytest.raises(InputError, match=re.escape(message)):
        workflow.solve(workflow.load_case(case), store=out)
    assert not out.exists()


def test_a_reference_of_lines_alone_is_refused(tmp_path, capsys) -> None:
    case = scene(tmp_path / "bar")
    text = (case / "case.toml").read_text()
    head, tail = text[: text.index("[reference]")], text[text.index("[[candidate]]") :]
    (case / "case.toml").write_text(head + '[reference]\nsolver = "line_of_action"\n' + tail)
    assert main(["compare", str(case), "--candidate", "line", "--out", str(tmp_path / "out"), "--quiet"]) == 2
    assert (
        "reference: surface: got a run of lines alone, want a reference that moves the surface"
        in capsys.readouterr().err
    )
