"""The package itself: one list of public names, which editors see too, and nothing loaded before it is asked for."""

import ast
import subprocess
from pathlib import Path

import pytest

import fem_reference as fr
from fem_reference.foundations.subprocesses import command, environment

STUB = ast.parse((Path(fr.__file__).parent / "__init__.pyi").read_text(encoding="utf-8"))


def test_every_public_name_is_listed_for_editors() -> None:
    (listed,) = [node.value for node in STUB.body if isinstance(node, ast.Assign)]
    assert ast.literal_eval(listed) == fr.__all__


@pytest.mark.parametrize("name", fr.__all__)
def test_every_public_name_is_found(name: str) -> None:
    assert callable(getattr(fr, name))
    assert name in dir(fr)


def test_a_name_that_is_none_is_refused() -> None:
    with pytest.raises(AttributeError, match="module 'fem_reference' has no attribute 'load_cases'"):
        fr.load_cases  # noqa: B018


def test_importing_it_loads_nothing_else() -> None:
    code = "import sys, fem_reference; print([name for name in sys.modules if name.startswith('fem_reference.')])"
    done = subprocess.run(command("-c", code), env=environment(), capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    code = "import sys, fem_reference; fem_reference.InputError; print('numpy' in sys.modules)"
    done = subprocess.run(command("-c", code), env=environment(), capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
