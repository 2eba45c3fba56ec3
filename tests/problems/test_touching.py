"""Parts of the surface that may touch: the law, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

import fem_reference as fr
from fem_reference.problems.checks import check
from fem_reference.problems.touching import with_itself

LAW = fr.Touching("low_z1", "high_z0", 2.0, 0.1)


def body(*laws: fr.Touching) -> fr.Body:
    high = fr.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron")
    mesh = fr.joined({"low": fr.box((1, 1, 2), (1.0, 1.0, 1.0), "tetrahedron"), "high": high})
    both = np.concatenate([mesh.facets[name] for name in ("low_z1", "high_z0")])
    mesh = replace(mesh, facets=mesh.facets | {"all": both})
    return fr.Body(mesh, (fr.make_effect("neo_hooke", mu=0.01),), (), (0.0, 1.0), touching=laws)


def test_the_pressure_is_that_of_bones() -> None:
    # k (d - g)^2 / 4d within the smoothing, k times the depth beyond it; its slope by hand.
    pressure, slope = LAW.pressure(np.array([0.2, 0.1, 0.0, -0.1, -0.3, np.nan]))
    assert pressure == pytest.approx([0, 0, 0.05, 0.2, 0.6, np.nan], abs=1e-15, nan_ok=True)
    assert slope[:5] == pytest.approx([0, 0, -1, -2, -2], abs=1e-15)


def test_skin_around_parts_is_under_one_law() -> None:
    """The sides of the lower box are around both its top and its bottom: two laws would press there with twice the pressure."""
    around = replace(LAW, around=True)
    with pytest.raises(fr.InputError, match="want one law for a pair of facets"):
        check(body(around, replace(around, one="low_z0")), "P1")
    check(body(LAW, replace(LAW, one="low_z0")), "P1")
    check(body(around, replace(around, one="low_z0", other="high_z1")), "P1")


@pytest.mark.parametrize(
    ("law", "message"),
    [
        (replace(LAW, stiffness=0.0), r"touching\[1\].stiffness: got 0.0, want a number above 0"),
        (replace(LAW, smoothing=float("nan")), r"touching\[1\].smoothing: got nan"),
        (replace(LAW, other="low_z0"), r'touching\[1\]: got "low_z1" and "low_z0" on one connected piece'),
        (replace(LAW, one="high_z1", other="low_z0", friction=0.0), r"friction: got 0\.0, want a number above 0"),
        (replace(LAW, one="low"), r'on: got "low", want a region of the body'),
        (
            replace(LAW, one="high_z0", other="low_z1"),
            r'touching\[1\]: got "high_z0" and "low_z1" with facets that also touch under t',
        ),
        (replace(LAW, one="all", other="all"), r"touching\[1\]: got .*, want one law for a pair of facets"),
        ("low_z1", r"touching\[1\]: got str .*, want Touching records"),
    ],
)
def test_what_is_wrong_is_refused(law, message) -> None:
    check(body(LAW), "P1")
    check(body(LAW, replace(LAW, one="high_z1", other="low_z0")), "P1")
    with pytest.raises(fr.InputError, match=message):
        check(body(LAW, law), "P1")


def test_a_part_with_itself_feels_no_pressure_at_rest() -> None:
    itself = replace(LAW, other="low_z1")
    check(body(itself), "P1")
    assert [one.allowance(0.5) for one in (LAW, itself, replace(itself, relaxed=(0.0, 1.0)))] == [0.0, 1.0, 0.5]
    assert [body(one).remembers for one in (LAW, itself)] == [False, True]
    moved = [replace(body(one), start=lambda points: points + [1.0, 0.0, 0.0]) for one in (LAW, itself)]
    check(moved[0], "P1")
    with pytest.raises(fr.InputError, match='start: got positions, and "low_z1" that touches itself'):
        check(moved[1], "P1")
    effect = fr.make_effect("touching", stiffness=2.0, smoothing=0.1, friction=0.2)
    assert with_itself((effect,), "free") == (fr.Touching("free", "free", 2.0, 0.1, 0.2),)
    # Behind a part that touches itself is this part: it is refused, not ignored.
    lines = fr.make_effect("touching", stiffness=2.0, smoothing=0.1, own_normals=True)
    with pytest.raises(fr.InputError, match=r"touching\[0\]\.own_normals: got True for a part that touches itself"):
        check(replace(body(itself), touching=with_itself((lines,), "low_z1")), "P1")
    assert with_itself((), "free") == ()
