"""Text with a unit becomes a number in mm, MPa, s, rad, tonne, and text that is no such quantity is refused.

Conversions are powers of ten and pi / 180, so that only rounding separates them from the numbers here.
"""

import math
import subprocess

import pint
import pytest

from fem_reference.foundations import units
from fem_reference.foundations.subprocesses import command
from fem_reference.foundations.units import length_unit, quantity, three, unit_of


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
        ("3 cm3", "a volume", 3000.0),
        ("1060 kg/m3", "a density", 1.06e-9),
        ("1.06 g/cm^3", "a density", 1.06e-9),
        ("9.81 m/s^2", "an acceleration", 9810.0),
        ("9.81 m/s2", "an acceleration", 9810.0),
        ("2 N/mm2", "a pressure", 2.0),
        ("10 cmH2O", "a pressure", 980.665e-6),
        ("200 N/m", "a stiffness", 0.2),
        ("0.1 N s/m", "a damping", 1e-4),
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
        ("1060 kg", "a density"),
        ("1060", "a density"),
        ("9.81 m/s", "an acceleration"),
        ("1 m23", "a length"),
    ],
)
def test_quantity_refuses_what_is_none(text: object, kind: str) -> None:
    with pytest.raises(ValueError, match=f"^{kind} with its unit, such as"):
        quantity(text, kind)


def test_three_share_one_unit() -> None:
    assert three("1, -2, 3.5 cm", "a length") == pytest.approx((10.0, -20.0, 35.0), rel=1e-14)
    assert three("1,2,3cm", "a length") == pytest.approx((10.0, 20.0, 30.0), rel=1e-14)
    assert three("1 cm, 2 cm, 3 cm", "a length") == pytest.approx((10.0, 20.0, 30.0), rel=1e-14)
    assert three("0, 6.25, 0 kPa", "a pressure") == pytest.approx((0.0, 0.00625, 0.0), rel=1e-14)
    assert three("0, 0, -9.81 m/s2", "an acceleration") == pytest.approx((0.0, 0.0, -9810.0), rel=1e-14)


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
def test_three_refuses_what_are_none(text: object) -> None:
    with pytest.raises(ValueError, match=r'^three lengths with one unit, such as "146, 238, -431 mm"$'):
        three(text, "a length")


@pytest.mark.parametrize(
    ("kind", "want"),
    [
        ("a pressure", r'three pressures with one unit, such as "0, 6\.25, 0 kPa"'),
        ("an acceleration", r'three accelerations with one unit, such as "0, 0, -9\.81 m/s\^2"'),
    ],
)
def test_three_names_its_kind(kind: str, want: str) -> None:
    with pytest.raises(ValueError, match=f"^{want}$"):
        three("1, 2, 3 mm", kind)


def test_types_say_their_unit() -> None:
    printed = {
        name: unit_of(kind.__metadata__)
        for name, kind in vars(units).items()
        if hasattr(kind, "__metadata__") and kind is not units.LengthUnit
    }
    assert printed == {
        "Length": "mm",
        "PositiveLength": "mm",
        "Angle": "rad",
        "Pressure": "MPa",
        "PositivePressure": "MPa",
        "PressureVector": "MPa",
        "AreaStiffness": "MPa/mm",
        "VolumeDamping": "MPa*s/mm^2",
        "Viscosity": "MPa*s",
        "Force": "N",
        "Stiffness": "N/mm",
        "BendingStiffness": "N*mm",
        "Rate": "1/s",
        "Density": "tonne/mm^3",
        "AccelerationVector": "mm/s^2",
        "Time": "s",
        "Point": "mm",
    }
    assert unit_of(units.LengthUnit.__metadata__) == ""


def test_length_unit() -> None:
    for unit in units.LENGTH_UNITS:
        assert length_unit(unit) == pytest.approx(quantity(f"1 {unit}", "a length"), rel=1e-14)


@pytest.mark.parametrize(
    ("text", "want"),
    [("2 mm", "a unit of length"), (1.0, "a unit of length"), ("kPa", "a unit of length"), ("Mm", "a unit of length")],
)
def test_length_unit_refuses_what_is_none(text: object, want: str) -> None:
    with pytest.raises(ValueError, match=f"^{want}"):
        length_unit(text)


def test_common_units_are_those_of_pint_to_the_last_digit() -> None:
    registry = pint.UnitRegistry(cache_folder=None)
    kinds = {kind.unit for kind in units.KINDS.values()}
    for (unit, inside), factor in units.COMMON.items():
        assert inside in kinds
        one = registry.Quantity(1.0, registry.parse_units(unit))
        assert one.to(inside or "dimensionless").magnitude == factor, unit
        assert one.to_root_units().units == registry.Quantity(1.0, inside).to_root_units().units, unit


_THREADS = """
import sys, threading
from fem_reference.foundations.units import quantity
sys.setswitchinterval(1e-5)
found, begin = [], threading.Barrier(8)
def read(i):
    begin.wait()
    found.append(quantity(f"{i} fortnight", "a time"))
threads = [threading.Thread(target=read, args=(i,)) for i in range(1, 9)]
for one in threads: one.start()
for one in threads: one.join()
assert sorted(found) == [1209600.0 * i for i in range(1, 9)], found
"""


@pytest.mark.slow
def test_threads_share_one_registry() -> None:
    # Without a lock each built its own: in most of such processes a unit was then said to be none.
    subprocess.run(command("-c", _THREADS), check=True, timeout=60)
