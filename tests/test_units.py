"""Text with a unit becomes a number in mm, MPa, s, rad, and text that is no such quantity is refused.

Conversions are powers of ten and pi / 180, so that only rounding separates them from the numbers here.
"""

import math

import pytest

from fem_reference.units import length_unit, point, quantity


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("2 cm", "a length", 20.0),
        ("-0.5 m", "a length", -500.0),
        ("180 deg", "an angle", math.pi),
        ("-1 rad", "an angle", -1.0),
        ("10 MPa", "a pressure", 10.0),
        ("30 kPa", "a pressure", 0.03),
        ("2 N/mm^2", "a pressure", 2.0),
        ("0.5 %", "a fraction", 0.005),
        ("0.5", "a fraction", 0.5),
        ("10 ms", "a time", 0.01),
        ("3 ml", "a volume", 3000.0),
        ("1e1 mm", "a length", 10.0),
        (".5mm", "a length", 0.5),
        ("0.01", "a fraction", 0.01),
        ("-1.5 %", "a fraction", -0.015),
    ],
)
def test_quantity_is_in_inside_units(text: str, kind: str, value: float) -> None:
    assert quantity(text, kind) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("1 mm", "a pressure"),
        ("1 kPa", "a length"),
        ("30", "a pressure"),
        ("30", "an angle"),
        ("30 %", "an angle"),
        (30.0, "a pressure"),
        (None, "a length"),
        ("", "a length"),
        ("mm mm (", "a length"),
        ("1 parsnip", "a length"),
        ("nan mm", "a length"),
        ("inf kPa", "a pressure"),
        ("1e400 mm", "a length"),
        ("mm", "a length"),
        ("2*3 mm", "a length"),
        ("2 mm * 3", "a length"),
        ("2 3 mm", "a length"),
        ("2 mm + 3 mm", "a length"),
        ("1 rad", "a fraction"),
        ("1 deg", "a fraction"),
        ("1 rad^2", "an angle"),
        ("1 kPa*rad", "a pressure"),
    ],
)
def test_quantity_refuses_what_is_none(text: object, kind: str) -> None:
    with pytest.raises(ValueError, match=f"^{kind} with its unit, such as"):
        quantity(text, kind)


def test_point_shares_one_unit() -> None:
    assert point("1, -2, 3.5 cm") == pytest.approx((10.0, -20.0, 35.0), rel=1e-14)
    assert point("1,2,3cm") == pytest.approx((10.0, 20.0, 30.0), rel=1e-14)
    assert point("1 cm, 2 cm, 3 cm") == pytest.approx((10.0, 20.0, 30.0), rel=1e-14)


@pytest.mark.parametrize(
    "text",
    [
        "1, 2 mm",
        "1, 2, 3, 4 mm",
        "1, 2, 3",
        "1, 2, 3 kPa",
        "",
        "1, 2,",
        [1, 2, 3],
        "a, 2, 3 mm",
        "1 mm, 2 mm, 3 m",
        "nan, 2, 3 mm",
    ],
)
def test_point_refuses_what_is_none(text: object) -> None:
    with pytest.raises(ValueError, match=r'^three lengths with one unit, such as "146, 238, -431 mm"$'):
        point(text)


def test_length_unit() -> None:
    assert [length_unit(unit) for unit in ("mm", "cm", "m")] == pytest.approx([1.0, 10.0, 1000.0], rel=1e-14)


@pytest.mark.parametrize(
    ("text", "want"), [("2 mm", "a unit of length"), (1.0, "a unit of length"), ("kPa", "a length with its unit")]
)
def test_length_unit_refuses_what_is_none(text: object, want: str) -> None:
    with pytest.raises(ValueError, match=f"^{want}"):
        length_unit(text)
