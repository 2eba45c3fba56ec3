"""Arguments of callers: in words, and as paths."""

from pathlib import Path

import numpy as np
import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.given import path, said


def test_an_array_is_told_by_its_shape_and_the_rest_by_type_and_value() -> None:
    assert said(np.zeros((4, 3))) == "an array (4, 3)"
    assert said(3) == "int 3"
    assert said("") == "str ''"


def test_a_path_need_not_be_there() -> None:
    assert path("somewhere/else", "out") == Path("somewhere/else")


@pytest.mark.parametrize("wrong", [3, "", None, "a\0b", "x" * 5000, "\udcff"])
def test_what_can_be_no_path_is_refused(wrong) -> None:
    with pytest.raises(InputError, match=r"^out: got .*, want a path"):
        path(wrong, "out")
