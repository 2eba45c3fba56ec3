"""What is no answer is named, whatever its statistics say: exploded, collapsed, inside out, stuck; what is wrong alone is not."""

from dataclasses import replace

import numpy as np
import pytest
import shapes

from fem_reference.assessment.soundness import unsound
from fem_reference.runs.store import Outcome, Run
from tests.report.comparisons import NAN, small_comparison, with_bars

REST = shapes.sphere(2, 10.0)
MOVED = np.stack([REST.points, REST.points + [3.0, 0, 0]])


def run(last: np.ndarray) -> Run:
    return Run("mine", "test", Outcome("converged", "done"), (0, 10), REST, np.stack([REST.points, last]))


TRUTH = run(MOVED[1])


def flattened() -> np.ndarray:
    return MOVED[1] * [1, 1, 0.4]


def turned() -> np.ndarray:
    """A cap pressed through the body and out of its other side, the rest grown: two thirds of the volume are left."""
    points = MOVED[1].copy()
    points[REST.points[:, 2] > 8] -= [0, 0, 20]
    return 1.2 * points


def dropped() -> np.ndarray:
    points = MOVED[1].copy()
    points[REST.points[:, 0] > 6] = REST.points[REST.points[:, 0] > 6]
    return points


@pytest.mark.parametrize(
    ("last", "why"),
    [
        (MOVED[1] * 1e6, "exploded: a vertex of a body of "),  # finite, as the numbers of a solver that explodes
        (MOVED[1] * 1.3, "exploded: 2.2 times the volume of the reference in frame 10"),  # 1.3^3
        (flattened(), "collapsed: 0.4 times the volume of the reference in frame 10"),
        (turned(), "inside out: "),
        (dropped(), "stuck: "),
        (MOVED[1] / 1000, "collapsed: 1e-09 times"),  # metres for millimetres, beyond the first frame
        (MOVED[1] * 1000, "exploded: a vertex of a body of "),
    ],
)
def test_frames_that_are_no_answer_are_named(last, why: str) -> None:
    assert unsound(run(last), TRUTH).startswith(why)


def test_what_is_only_wrong_is_sound() -> None:
    for last in (MOVED[1], MOVED[1] + [5.0, 0, 0], MOVED[1] * 1.2, MOVED[1] * [1, 1, 0.6], REST.points + 1e-4):
        assert unsound(run(last), TRUTH) == ""
    frozen = run(REST.points)
    assert unsound(frozen, TRUTH).startswith(
        f"stuck: {len(REST.points)} vertices never move, although they move by up to 3 mm"
    )
    assert unsound(frozen, run(REST.points + [1e-2, 0, 0])) == ""  # the reference rests too
    lost = run(MOVED[1] * NAN)
    assert unsound(lost, TRUTH) == unsound(run(MOVED[1] * 1e6), lost) == ""  # statuses and statistics say so


def test_a_run_that_says_it_converged_without_a_frame_is_no_answer() -> None:
    nothing = replace(TRUTH, positions=TRUTH.positions * NAN)
    assert unsound(nothing, TRUTH).startswith("unknown: ")
    assert unsound(replace(nothing, outcome=Outcome("crashed", "at once")), TRUTH) == ""


def test_lines_without_a_surface_are_an_answer() -> None:
    lines = replace(run(MOVED[1]), has_surface=False, positions=np.full_like(MOVED, NAN))
    assert unsound(lines, TRUTH) == ""
    assert unsound(replace(lines, has_surface=True), TRUTH) == "unknown: every frame has values that are not numbers"


def test_it_is_not_ranked_and_named_on_the_page(tmp_path, monkeypatch) -> None:
    found = with_bars(small_comparison(tmp_path, monkeypatch))
    assert "quick" in {place.deviation.name for one in found.rankings for place in one.places}
    quick, torn = found.candidates
    small = replace(quick, positions=quick.positions * np.linspace(1, 0.5, 5)[:, None, None])
    shrunk = replace(found, candidates=(small, torn))
    assert set(shrunk.unsound) == {"quick"}
    assert "quick" not in {place.deviation.name for one in shrunk.rankings for place in one.places}
