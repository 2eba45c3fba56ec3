"""Signals that end the process raise exceptions, and are repeated where Python loses these."""

import signal
import sys
import time
import weakref

import pytest

from fem_reference import cli
from fem_reference.foundations import signals
from tests.signals import Losing, listening

ENDINGS = [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, SystemExit)]


def lose(number: int) -> None:
    """Lose a signal, and go on for 5 s unless it is repeated."""
    Losing(number)
    time.sleep(5)


@pytest.mark.parametrize(("number", "raised"), ENDINGS)
def test_a_signal_raises_at_once(number, raised) -> None:
    with pytest.raises(raised), listening():
        signal.raise_signal(number)


@pytest.mark.parametrize(("number", "raised"), ENDINGS)
def test_a_signal_lost_in_a_deletion_raises_all_the_same(number, raised) -> None:
    with pytest.raises(raised), listening():
        lose(number)


def test_a_signal_lost_in_a_callback_raises_all_the_same() -> None:
    things = [{1}]
    _kept = weakref.ref(things[0], lambda _: signal.raise_signal(signal.SIGTERM))

    def call_back() -> None:
        things.clear()
        time.sleep(5)

    with pytest.raises(SystemExit) as ended, listening():
        call_back()
    assert ended.value.code == signals.TERMINATED


def test_other_lost_exceptions_are_reported_as_before(monkeypatch) -> None:
    class Wrong:
        def __del__(self) -> None:
            raise ValueError("ours")

    found = []
    monkeypatch.setattr(sys, "unraisablehook", lambda lost: found.append(str(lost.exc_value)))
    with listening():
        Wrong()
    assert found == ["ours"]


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, cli.INTERRUPTED), (signal.SIGTERM, signals.TERMINATED)])
def test_the_command_ends_by_a_signal_that_was_lost(number, status, monkeypatch) -> None:
    def verb(_) -> int:
        lose(number)
        return 0

    monkeypatch.setattr(sys, "argv", ["fem-reference", "list"])
    monkeypatch.setattr("fem_reference.cli.list.run", verb)
    with pytest.raises(SystemExit) as ended, listening():
        cli.entry()
    assert ended.value.code == status
