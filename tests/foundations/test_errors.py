"""Errors of input: one line with place, got and wanted, which goes from one process to another."""

import pickle

from fem_reference.foundations.errors import InputError


def test_an_error_names_place_got_and_wanted() -> None:
    error = InputError("case.toml: effect[0].mu", '"1 mm"', "a pressure")
    assert (error.place, error.got, error.want) == ("case.toml: effect[0].mu", '"1 mm"', "a pressure")
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) == 'case.toml: effect[0].mu: got "1 mm", want a pressure'


def test_it_is_one_short_line_whatever_was_got() -> None:
    said = str(InputError("key\n\x1b[31m", "x" * 10_000 + "end", "a number"))
    assert said.isprintable()
    assert len(said) < 500
    assert "..." in said
    assert "end, want a number" in said
