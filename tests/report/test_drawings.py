"""Drawings inside a page: ids of their own, colours that a dark page may change, numbers as people read them."""

import itertools
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from fem_reference import solvers
from fem_reference.report import drawings
from fem_reference.scenes import casefile


def line(_figure, axes) -> None:
    axes.plot([1, 10], [1, 1000], color=drawings.PALETTE[0])
    drawings.logarithmic(axes)


def test_no_two_drawings_share_an_id_and_each_refers_to_its_own() -> None:
    one, other = (drawings.drawn(name, "A <title>", (3, 2), line).markup for name in ("one", "an other"))
    ids = [set(re.findall(r'\bid="([^"]*)"', text)) for text in (one, other)]
    assert ids[0]
    assert not ids[0] & ids[1]
    for own, text in zip(ids, (one, other), strict=True):
        assert set(re.findall(r'(?:href="|url\()#([^")]*)', text)) <= own
    assert all(each.startswith("an_other-") for each in ids[1])
    assert 'aria-label="A &lt;title&gt;"' in one


def test_colours_are_those_of_the_page_and_stay_what_they_are_where_it_says_nothing() -> None:
    text = drawings.drawn("one", "One", (3, 2), line).markup
    assert "var(--c-0072b2, #0072b2)" in text
    assert "var(--grid, #e8e8e8)" in text
    assert "xmlns" not in text
    assert "metadata" not in text


# Colours as dichromats see them: Machado, Oliveira, Fernandes 2009, IEEE Trans. Vis. Comput. Graph. 15(6), severity 1.
VISION = {
    "all": np.eye(3),
    "no red": np.array([[0.1523, 1.0526, -0.2049], [0.1145, 0.7863, 0.0992], [-0.0039, -0.0481, 1.0520]]),
    "no green": np.array([[0.3673, 0.8606, -0.2280], [0.2801, 0.6725, 0.0474], [-0.0118, 0.0429, 0.9689]]),
    "no blue": np.array([[1.2555, -0.0767, -0.1788], [-0.0784, 0.9308, 0.1476], [0.0047, 0.6914, 0.3039]]),
}


def seen(colour: str, vision: np.ndarray) -> np.ndarray:
    """A colour in CIELAB, in which a distance of 2.3 is just noticeable."""
    stored = np.array(to_rgb(colour))
    light = np.where(stored <= 0.04045, stored / 12.92, ((stored + 0.055) / 1.055) ** 2.4)
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    share = to_xyz @ np.clip(vision @ light, 0, 1) / [0.9505, 1.0, 1.089]
    x, y, z = np.where(share > 0.008856, np.cbrt(share), 7.787 * share + 16 / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def test_no_two_runs_have_one_colour() -> None:
    assert len({drawings.colour_of(i) for i in range(40)}) == 40


# The colours of a page on dark paper, by those on light paper.
STYLE = (Path(drawings.__file__).parent / "style.css").read_text(encoding="utf-8")
DARK = {f"#{light}": dark for light, dark in re.findall(r"--c-(\w{6}): (#\w{6})", STYLE)}


@pytest.mark.parametrize("vision", VISION)
@pytest.mark.parametrize("paper", [{}, DARK], ids=["light", "dark"])
def test_fifteen_runs_and_the_reference_are_told_apart_by_their_lines_whatever_colours_one_sees(vision, paper) -> None:
    for one, other in itertools.combinations(map(drawings.look_of, range(16)), 2):
        first, second = (seen(paper.get(look["color"], look["color"]), VISION[vision]) for look in (one, other))
        # Four times what is just noticeable, as lines are thin; marks have colours alone, for all who see all of these.
        least = 10 if one["linestyle"] == other["linestyle"] else 20 if vision == "all" else 0
        assert np.linalg.norm(first - second) >= least, (one, other)


def test_each_of_our_solvers_has_one_colour_on_all_pages() -> None:
    """Solvers of Table 5.1 and candidates of the five muscles: theirs alone, whatever else is shown, and in any order."""
    cases = map(
        casefile.read, ("hip_flexion", "gluteus_maximus", "gluteus_medius", "iliacus_anatomical", "adductor_brevis")
    )
    candidates = [one for case in cases for one in (*case.candidate, *solvers.in_table())]
    # Studies have points by solver, of lines too.
    ours = list(dict.fromkeys([*(one.name for one in candidates if one.solver != "recorded"), "line_of_action"]))
    found = drawings.looks(["reference", "mine", *ours, "theirs"])
    assert len({look["color"] for look in found.values()}) == len(ours) + 3 >= 17
    assert found["reference"]["color"] == drawings.REFERENCE == drawings.looks(["fenicsx"])["fenicsx"]["color"]
    same = [name for name in ours if drawings.looks(["yours", name])[name] == found[name]]
    assert len(same) >= 14  # all but a solver that came later
    assert drawings.looks(["theirs", "pbd", "mine"])["theirs"] == found["mine"]  # what is left, in their order
    assert drawings.looks(["reference", "fenicsx"])["fenicsx"] == found["mine"]  # a candidate by the same solver


def test_powers_of_ten_are_written_as_numbers() -> None:
    text = drawings.drawn("one", "One", (3, 2), line).markup
    assert {"1", "10", "100", "1\N{NARROW NO-BREAK SPACE}000"} <= set(re.findall(r">([^<>]+)</text>", text))


def test_a_drawing_over_frames_has_its_unit_and_a_legend_whose_last_entry_is_what_is_not_a_number() -> None:
    def curves(axes) -> None:
        axes.plot([0, 10], [0, 1], "x", label=drawings.NOT_A_NUMBER)
        axes.plot([0, 10], [0, 1], label="a run")

    texts = re.findall(r">([^<>]+)</text>", drawings.over_frames("v", "Volume", "mm3", curves).markup)
    assert {"frame", "mm³"} <= set(texts)
    assert texts.index("a run") < texts.index(drawings.NOT_A_NUMBER)


def test_a_logarithmic_axis_within_a_decade_has_numbers_and_a_longer_one_only_its_powers() -> None:
    """Between 0.37 and 0.68 no power of ten stands; between 0.15 and 5.5 one does, and other numbers than 2 and 5 would overlap;
    between 1 and 1000 four do.
    """

    def labels(low: float, high: float) -> list[str]:
        axes = Figure().subplots()
        axes.set_yscale("log")
        axes.set_ylim(low, high)
        drawings.plain_numbers(axes.yaxis)
        shown = zip(axes.yaxis.get_ticklocs(minor=True), axes.yaxis.get_ticklabels(minor=True), strict=True)
        return [text.get_text() for at, text in shown if low <= at <= high and text.get_text()]

    assert labels(0.37, 0.68) == ["0.400", "0.500", "0.600"]
    assert labels(0.15, 5.5) == ["0.200", "0.500", "2", "5"]
    assert labels(1, 1000) == []
