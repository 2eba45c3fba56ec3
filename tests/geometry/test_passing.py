"""Points that pass through moving triangles: only from the front, only inside, and between the ends of the path as well."""

import numpy as np
import pytest

from fem_reference.geometry.passing import passed, seen_along

FLAT = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])  # seen counterclockwise from above
SHIFT = np.array([0.3, -2.0, 5.0])


def goes(start, end, before=FLAT, after=FLAT) -> bool:
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)  # a rotation: in any direction the answer is the same
    given = (np.array([one], float) @ turn.T + SHIFT for one in (start, end, before, after))
    return bool(passed(*given)[0])


@pytest.mark.parametrize(
    ("start", "end", "through"),
    [
        ((0.2, 0.2, 1), (0.2, 0.2, -1), True),
        ((0.2, 0.2, 1), (0.4, 0.3, -1), True),
        ((0.2, 0.2, -1), (0.2, 0.2, 1), False),  # from the back
        ((0.2, 0.2, 1), (0.2, 0.2, 0.1), False),  # not as far
        ((0.8, 0.8, 1), (0.8, 0.8, -1), False),  # beside it
        ((-0.5, -0.5, 1), (0.9, 0.9, -1), True),  # (0.2, 0.2) half way
        ((-0.5, -0.5, 1), (2.5, 2.5, -1), False),  # (1, 1) half way
    ],
)
def test_a_triangle_at_rest(start, end, through) -> None:
    assert goes(start, end) is through


def test_a_triangle_that_moves() -> None:
    up = FLAT + [0, 0, 2]
    assert goes((0.2, 0.2, 1), (0.2, 0.2, 1), FLAT, up)
    assert goes((0.2, 0.2, 1), (0.2, 0.2, 2.5), FLAT, up) is False  # it goes ahead
    assert goes((0.2, 0.2, 1), (5.2, 0.2, 1), FLAT, up + [5, 0, 0])  # both go along
    assert goes((0.2, 0.2, 1), (5.2, 0.2, 1), FLAT, up) is False  # the point has left before


def test_a_triangle_that_turns_past_the_point_and_back() -> None:
    # The plane is at z = 4 t (1 - x - y) + 4 (1 - t) x: at 0.4 below the point at z = 1 at both ends, and at 1.3 half way.
    before, after = (FLAT + [[0, 0, a], [0, 0, b], [0, 0, 0]] for a, b in ((0, 4), (4, 0)))
    assert goes((0.1, 0.6, 1.0), (0.8, 0.1, 1.0), before, after)
    assert goes((0.1, 0.6, 1.4), (0.8, 0.1, 1.4), before, after) is False


def test_seen_along_is_the_first_back() -> None:
    sheets = np.stack(
        [FLAT - [0, 0, 1], FLAT - [0, 0, 3], FLAT[::-1] - [0, 0, 2]]
    )  # seen from below the first two show their backs
    up = np.array([[0.2, 0.2, -5.0], [0.2, 0.2, -2.5], [0.8, 0.8, -5.0]])
    assert seen_along(up, np.tile([0.0, 0, 1], (3, 1)), sheets) == pytest.approx([2, 1.5, np.inf])
    assert seen_along(up[:1] + [0, 0, 9], np.array([[0.0, 0, -1]]), sheets) == pytest.approx([6])
