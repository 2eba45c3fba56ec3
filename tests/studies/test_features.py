"""What a case is like as numbers: by them a recommendation chooses what was studied."""

import math
from pathlib import Path

import numpy as np
import pytest
import small

from fem_reference.problems import muscle
from fem_reference.scenes import casefile
from fem_reference.studies.features import features

CONTACT = '\n[[effect]]\nname = "contact"\nstiffness = "100 kPa/mm"\nsmoothing = "0.2 mm"\n'


def test_the_numbers_of_the_small_bar(tmp_path: Path) -> None:
    """Its lid turns by 0.4 rad up to frame 10 of 20 and back; 10 MPa over 10 kPa; two bones, of which contact may name one."""
    path = small.write(tmp_path / "bar") / "case.toml"
    text = path.read_text() + small.FIBRES.format(slack=1.0)
    path.write_text(text)
    scene = casefile.read_muscle(path.parent)
    rest = muscle.setup(scene)
    found = features(scene, rest)
    # The bar's end is 10 mm above the line that the lid turns about, and its corners 5 mm to the side of it: a chord.
    assert found["motion"] == pytest.approx(2 * math.hypot(10, 5) * math.sin(0.2), rel=1e-9)
    assert found["bulk_to_shear"] == pytest.approx(1000, rel=1e-12)
    stress = next(effect.stress for effect in scene.effects if hasattr(effect, "stress"))
    assert found["fibres_to_shear"] == pytest.approx(stress / 0.01, rel=1e-12)
    assert found["tet_size"] == 6
    assert found["size"] == pytest.approx(np.linalg.norm(np.ptp(rest.surface.points, axis=0)), rel=1e-12)
    for names, count in (("", 2.0), ('bones = ["lid"]\n', 1.0)):
        path.write_text(text + CONTACT + names)
        assert features(casefile.read_muscle(path.parent), rest)["contact"] == count
    assert found["contact"] == 0


def test_every_law_counts_with_its_shear_modulus(tmp_path: Path) -> None:
    """Of a Mooney-Rivlin matrix that is 2 (c1 + c2): as stiff as 10 kPa, it has the features of the neo-Hookean bar."""
    path = small.write(tmp_path / "bar") / "case.toml"
    scene = casefile.read_muscle(path.parent)
    rest = muscle.setup(scene)
    path.write_text(
        path.read_text().replace(
            'name = "neo_hooke"\nmu = "10 kPa"', 'name = "mooney_rivlin"\nc1 = "3 kPa"\nc2 = "2 kPa"'
        )
    )
    other = casefile.read_muscle(path.parent)
    assert type(other.effects[0]).__name__ == "MooneyRivlin"
    assert features(other, rest) == pytest.approx(features(scene, rest), rel=1e-12)
