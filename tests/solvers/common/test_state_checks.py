"""What is no muscle any more: positions that are no number, too wide, too large or inside out."""

import numpy as np
import pytest
import shapes

from fem_reference.foundations.motion import RigidMotion, apply
from fem_reference.solvers.common.state_checks import SurfaceCheck, Trouble, first_trouble

REST = shapes.sphere(1, 10.0)
NONE = np.zeros(0, np.int64)
TURN = RigidMotion((1, 2, 3), (5, -4, 700), (0.0, 1.0), (0.0, 2.0)).pose(1)


def trouble(points, rest, attached) -> Trouble | None:
    return SurfaceCheck(rest, attached).trouble(points)


class Unasked:
    """A check that must not be reached."""

    def trouble(self, _) -> Trouble | None:
        raise AssertionError("asked after one that found trouble")


def test_checks_are_asked_in_their_order_up_to_the_first_that_finds_trouble():
    check = SurfaceCheck(REST, NONE)
    assert first_trouble((check, check, Unasked()), np.nan * REST.points) == check.trouble(np.nan * REST.points)
    assert first_trouble((check, check), REST.points) is None


def scaled(*factors):
    return REST.points * factors


@pytest.mark.parametrize(
    "points", [REST.points, apply(TURN, REST.points), scaled(1.7, 1.7, 1.7), scaled(0.1, 0.1, 0.1)]
)
def test_what_may_be_a_muscle(points):
    # 1.7^3 = 4.9.
    assert trouble(points, REST, NONE) is None


@pytest.mark.parametrize(
    ("points", "status", "sentence"),
    [
        (scaled(11, 0.1, 0.1), None, ""),  # the diagonal of the box is 11 / sqrt(3) = 6.4 times as long
        (scaled(18, 0.1, 0.1), "diverged", "the muscle extends over "),  # 10.4 times
        (scaled(1.72, 1.72, 1.72), "diverged", "the surface encloses 5.09 times its volume at rest"),
        (scaled(1, 1, -1), "inverted", "the surface is turned inside out"),
        (scaled(1, 1, 0), "inverted", "the surface is turned inside out"),
        (scaled(1, 1, np.nan), "diverged", "the position of 42 points is not a number (first: point 0)"),
        (REST.points + [0, 0, np.inf], "diverged", "the position of 42 points is not a number"),
    ],
)
def test_what_is_none(points, status, sentence):
    found = trouble(points, REST, NONE)
    if status is None:
        assert found is None
    else:
        assert found.status == status
        assert found.sentence.startswith(sentence)


def test_what_bones_draw_out_may_be_as_wide_and_large():
    # Thirty times as long, and as large: so are the attached ends, of a diagonal of about 30 * 20 mm against 35 mm.
    points, ends = scaled(30, 1, 1), np.array([REST.points[:, 0].argmin(), REST.points[:, 0].argmax()])
    assert trouble(points, REST, ends) is None
    assert trouble(points, REST, NONE).status == "diverged"
    assert trouble(points * [1, 3, 3], REST, ends).sentence.startswith("the surface encloses 270 times")
