"""Completion: what a shell is given offers every verb, option and name; bash, and others where they are installed, take it."""

import shutil
import subprocess

import pytest

from fem_reference import cli, solvers
from fem_reference.cli import _parser
from fem_reference.scenes import casefile


@pytest.fixture(scope="module")
def scripts() -> dict[str, str]:
    """What is printed for each shell, by its name."""
    from fem_reference.cli import completion

    verbs = completion.words()
    return {shell: write(verbs) for shell, write in completion._SHELLS.items()}


def offered(script: str, *line: str) -> list[str]:
    """What bash offers for the last word of a ``line``."""
    code = 'COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _fem_reference; printf "%s\\n" "${COMPREPLY[@]}"'
    done = subprocess.run(["bash", "-c", f"{script}\n{code}", "-", *line], capture_output=True, text=True, check=True)
    assert done.stderr == ""
    return done.stdout.split()


def test_bash_offers_verbs_options_and_names(scripts) -> None:
    script = scripts["bash"]
    assert offered(script, "fem-reference", "") == [*_parser.names(), "--help", "--version"]
    assert offered(script, "fem-reference", "comp") == ["compare", "completion"]
    assert offered(script, "fem-reference", "run", "") == casefile.cases()
    assert offered(script, "fem-reference", "run", "hip_flexion", "--so") == ["--solver"]
    assert offered(script, "fem-reference", "run", "hip_flexion", "--solver", "") == solvers.names()
    assert offered(script, "./fem", "export", "rod", "--format", "p") == ["paraview"]
    assert offered(script, "./fem", "export", "rod", "--to", "") == []  # files: bash itself
    assert offered(script, "fem-reference", "completion", "") == ["bash", "fish", "zsh"]
    registered = subprocess.run(["bash", "-c", f"{script}\ncomplete -p fem-reference"], capture_output=True, text=True)
    assert registered.stdout == "complete -o default -F _fem_reference fem-reference\n"


def test_no_option_of_any_verb_is_left_out(scripts) -> None:
    for name, sub in _parser.parser()._subparsers._group_actions[0].choices.items():
        wanted = [action.option_strings[-1] for action in sub._actions if action.option_strings]
        assert offered(scripts["bash"], "fem-reference", name, "--") == wanted
        for option in wanted:
            assert f"{option}:" in scripts["zsh"]
            assert f"__fish_seen_subcommand_from {name}' -l {option.removeprefix('--')}" in scripts["fish"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_shell_takes_its_script(scripts, shell: str, tmp_path) -> None:
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed")
    (tmp_path / "script").write_text(scripts[shell])
    done = subprocess.run([shell, "-n", str(tmp_path / "script")], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_it_is_printed(scripts, capsys) -> None:
    assert cli.main(["completion", "bash"]) == cli.DONE
    assert capsys.readouterr().out == scripts["bash"]
