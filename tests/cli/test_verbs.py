"""The contract of verbs, met by every file of cli/: its help names its options, and what it does not know ends with status 2."""

import argparse
import contextlib
import logging

import pytest

from fem_reference import cli
from fem_reference.cli._parser import names, parser, verb

VERBS = names()


def options_of(name: str) -> argparse.ArgumentParser:
    """The parser of the verb alone, with every option it has."""
    (kinds,) = (action for action in parser()._actions if isinstance(action, argparse._SubParsersAction))
    return kinds.choices[name]


@pytest.mark.parametrize("name", VERBS)
def test_a_verb_has_what_the_command_line_asks_for(name: str) -> None:
    module = verb(name)
    assert module.HELP.strip()
    assert not module.HELP.endswith(".")
    assert callable(module.run)
    assert module.__doc__.startswith(f"The verb ``{name}``: ")


@pytest.mark.parametrize("name", VERBS)
def test_help_explains_every_option_and_ends_well(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match=r"^0$"):
        cli.main([name, "--help"])
    printed = capsys.readouterr().out
    for action in options_of(name)._actions:
        assert all(word in printed for word in action.option_strings)
        assert action.help, f"{action.dest} is not explained"


@pytest.mark.parametrize("ranks", ["0", "-1", "many", "1e3", "9" * 5000])
def test_a_number_of_ranks_that_cannot_be_is_named(ranks: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match=r"^2$"):
        cli.main(["run", "hip_flexion", "--ranks", ranks])
    assert "argument --ranks: got " in capsys.readouterr().err


@pytest.mark.parametrize("verb", ["study", "stress"])
def test_a_solver_that_is_named_twice_counts_once(verb: str) -> None:
    given = [*(["hip_flexion"] if verb == "study" else []), "--solver", "pbd", "--solver", "xpbd", "--solver", "pbd"]
    assert options_of(verb).parse_args(given).solver == ["pbd", "xpbd"]
    assert options_of(verb).parse_args(given[:-6]).solver == []


@pytest.mark.parametrize("name", VERBS)
def test_what_a_verb_does_not_know_ends_with_2(name: str, tmp_path, capsys: pytest.CaptureFixture[str]) -> None:
    given = []
    for action in (action for action in options_of(name)._actions if action.required):
        given += [*action.option_strings[:1], next(iter(action.choices or ["hip_flexion"]))]
    with pytest.raises(SystemExit, match=r"^2$"):
        cli.main([name, *given, "--out", str(tmp_path), "--no-such-option"])
    assert "--no-such-option" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("words", [["list"], ["list", "--quiet"], ["list", "--unknown"]])
@pytest.mark.parametrize("error", [None, OSError("disk"), TypeError("ours")])
def test_the_log_of_a_process_is_left_as_it_was(words, error, monkeypatch: pytest.MonkeyPatch) -> None:
    def verb(_: argparse.Namespace) -> int:
        if error:
            raise error
        return 0

    monkeypatch.setattr("fem_reference.cli.list.run", verb)
    log = logging.getLogger("fem_reference")
    monkeypatch.setattr(log, "level", logging.ERROR)
    monkeypatch.setattr(log, "handlers", [logging.NullHandler()])
    before = log.level, log.handlers[:]
    with contextlib.suppress(SystemExit):
        cli.main(words)
    assert (log.level, log.handlers) == before
