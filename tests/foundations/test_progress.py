"""Lines of progress, given to a caller's own function."""

import logging

import pytest

from fem_reference.foundations.progress import reported

LOG = logging.getLogger("fem_reference.somewhere")


def test_lines_go_to_the_function_as_long_as_it_is_asked_for() -> None:
    lines, package = list[str](), logging.getLogger("fem_reference")
    before = package.level, list(package.handlers)
    with reported(lines.append):
        LOG.info("frame %d of %d", 3, 10)
        LOG.debug("nobody asked for this")
    LOG.info("afterwards")
    assert lines == ["frame 3 of 10"]
    assert (package.level, list(package.handlers)) == before


def test_it_ends_with_an_error_too_and_without_a_function_nothing_is_changed() -> None:
    package = logging.getLogger("fem_reference")
    before = package.level, list(package.handlers)
    with pytest.raises(ZeroDivisionError), reported(lambda _line: 1 / 0):
        LOG.info("a line")
    with reported(None):
        assert (package.level, list(package.handlers)) == before
    assert (package.level, list(package.handlers)) == before
