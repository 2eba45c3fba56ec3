"""The head of the page says what was asked: whether a candidate was judged, and the reference's own checks beside it."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
import small
import stand_ins

from fem_reference import cli
from fem_reference.foundations.limits import ENERGY_GAP
from fem_reference.runs.store import Frame, Outcome
from fem_reference.solvers import fenicsx, pbd

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("without_pictures")]


def still(problem, _settings, sink) -> Outcome:
    """In place of the reference: nothing moves, and its equilibrium is unstable at the end."""
    for number in problem.frames:
        unstable = {
            "negative_modes": float(number == problem.frames[-1]),
            "min_det_F_quadrature": 0.05,
            "outside_law": float(number >= 15),
        }
        sink(Frame(number, problem.surface.points, problem.fibres.points, scalars=unstable))
    return Outcome("converged", "done", {"seconds": 1.0})


def shift(setup, _settings, sink) -> Outcome:
    """In place of a candidate: it is 0.1 mm a frame number away."""
    for number in setup.frames:
        sink(Frame(number, setup.surface.points + np.array([0.1 * number, 0, 0])))
    return Outcome("converged", "done", {"seconds": 1.0})


@pytest.fixture
def words(tmp_path: Path, monkeypatch) -> list[str]:
    stand_ins.solve_by(monkeypatch, fenicsx, still)
    stand_ins.unchecked(monkeypatch)
    stand_ins.solve_by(monkeypatch, pbd, shift)
    return ["compare", str(small.write(tmp_path / "bar")), "--quiet", "--out", str(tmp_path / "out")]


def head(folder: Path) -> str:
    text = (folder / "out" / "bar" / "report.html").read_text()
    return text[text.index("<header>") : text.index("</header>")]


def row(folder: Path, name: str) -> str:
    """The row of a run in the table at the top."""
    found = re.search(rf"<tr><th>{name}</th>.*?</tr>", head(folder), re.DOTALL)
    return found[0] if found else ""


def test_a_candidate_that_nobody_judged_says_so_and_its_numbers(words, tmp_path: Path) -> None:
    assert cli.main(words) == cli.DONE
    mine, reference = row(tmp_path, "pbd"), row(tmp_path, "reference")
    assert '<span class="badge not">not judged</span>' in mine
    assert '<td>2&#8239;<span class="unit">mm</span></td>' in re.sub(
        r"\s*\n\s*", "", mine
    )  # 0.1 mm times frame 20, everywhere
    assert '<span class="badge doubtful">doubtful pass</span>' in reference
    assert "1 of 1 expectations met; doubtful: unstable equilibrium in 1 of 5 frames; doubtful: det F " in reference
    assert "the intended range of a law in 2 of 5 frames, first in frame 15" in reference
    page = (tmp_path / "out" / "bar" / "report.html").read_text()
    below = page[page.index("Deviations at their worst frames") :]
    for one in ("Fibre length", "Volume", "Surface"):  # each number of the top is in the table below, with its frame
        assert one in below


def test_a_doubtful_pass_is_one_word_on_the_page_in_json_and_in_the_terminal(words, tmp_path: Path, capsys) -> None:
    target = tmp_path / "facts.json"
    assert cli.main([*words, "--json", str(target)]) == cli.DONE
    assert "verdict: doubtful pass for the reference; candidates are measured" in capsys.readouterr().out
    facts = json.loads(target.read_text())
    assert (facts["verdict"], len(facts["doubts"])) == ("doubtful pass", 3)
    listed = (tmp_path / "out" / "index.html").read_text()
    assert '<span class="badge doubtful">doubtful pass</span> <b>reference</b>' in listed


@pytest.mark.parametrize("lost", [-0.135, 0.04])
def test_energy_that_came_from_nowhere_is_judged_where_it_stands(
    lost, words, tmp_path: Path, monkeypatch, capsys
) -> None:
    def leaking(problem, _settings, sink) -> Outcome:
        for number in problem.frames:
            scalars = {"energy": 1.0 * number, "energy_gap": lost * (number == 10)}
            sink(Frame(number, problem.surface.points, problem.fibres.points, scalars=scalars))
        return Outcome("converged", "done", {"seconds": 1.0})

    stand_ins.solve_by(monkeypatch, fenicsx, leaking)
    stand_ins.unchecked(monkeypatch)
    target = tmp_path / "facts.json"
    assert cli.main([*words, "--json", str(target)]) == cli.DONE
    doubts, printed = json.loads(target.read_text())["doubts"], capsys.readouterr().out
    page = (tmp_path / "out" / "bar" / "report.html").read_text()
    if abs(lost) < ENERGY_GAP:
        assert doubts == []
        assert "doubtful" not in head(tmp_path) + printed
        assert "Doubtful:" not in page
    else:
        (why,) = doubts
        assert why.startswith(
            "the energy changed by -13.5 % without work at frame 10: the body jumped, or the load steps are too large"
        )
        assert f"reference: doubtful, {why}" in printed
        assert '<span class="badge doubtful">doubtful pass</span>' in row(tmp_path, "reference")
        assert "Doubtful: \N{MINUS SIGN}13.5 % of the energy appeared or vanished without work" in page
    assert "by Simpson's rule with a state halfway" in page


def test_limits_judge_candidates_without_a_change_of_the_case(words, tmp_path: Path, capsys) -> None:
    assert cli.main([*words, "--limit", "surface_deviation.max=2.1 mm"]) == cli.DONE
    assert '<span class="badge pass">pass</span>' in row(tmp_path, "pbd")
    assert cli.main([*words, "--limit", "surface_deviation.max=2.1 mm", "--limit", "surface_deviation.rms=1.9 mm"]) == 1
    assert '<span class="badge fail">fail</span>' in row(tmp_path, "pbd")
    for limit, want in (
        ("surface_deviation.max", '--limit: got "surface_deviation.max", want METRIC.STATISTIC=VALUE'),
        ("surface_deviation.max=2 kPa", '--limit: got "surface_deviation.max=2 kPa", want a value in mm: '),
        ("volume.deviation=x", '--limit: got "volume.deviation=x", want a value in %: '),
        ("surface_deviation.mx=2 mm", "want a statistic such as surface_deviation.max"),
        ("beauty.max=2 mm", "beauty"),
    ):
        assert cli.main([*words, "--limit", limit]) == cli.BAD_INPUT
        assert want in capsys.readouterr().err
