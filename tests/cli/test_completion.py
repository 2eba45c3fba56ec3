"""Completion: what a shell is given offers every verb, option and name; bash, and others where they are installed, take it."""

import argparse
import re
import shutil
import subprocess

import pytest

from fem_reference import cli, solvers
from fem_reference.cli import completion
from fem_reference.scenes import casefile


@pytest.fixture(scope="module")
def scripts() -> dict[str, str]:
    """What is printed for each shell, by its name."""
    return {shell: completion.script(shell) for shell in ("bash", "fish", "zsh")}


def offered(script: str, *line: str) -> list[str]:
    """What bash offers for the last word of a ``line``."""
    code = 'COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _shtab_fem_reference; printf "%s\\n" "${COMPREPLY[@]}"'
    done = subprocess.run(["bash", "-c", f"{script}\n{code}", "-", *line], capture_output=True, text=True, check=True)
    assert done.stderr == ""
    return done.stdout.split()


def test_bash_offers_verbs_options_and_names(scripts) -> None:
    script = scripts["bash"]
    assert offered(script, "fem-reference", "") == [*options()]
    assert offered(script, "fem-reference", "--v") == ["--version"]
    assert offered(script, "fem-reference", "comp") == ["compare", "completion"]
    assert offered(script, "fem-reference", "run", "") == casefile.cases()
    assert offered(script, "fem-reference", "run", "hip_flexion", "--so") == ["--solver"]
    assert offered(script, "fem-reference", "run", "hip_flexion", "--solver", "") == solvers.names()
    assert offered(script, "./fem", "export", "rod", "--format", "p") == ["paraview"]
    assert offered(script, "fem-reference", "completion", "") == ["bash", "fish", "zsh"]
    registered = subprocess.run(["bash", "-c", f"{script}\ncomplete -p ./fem"], capture_output=True, text=True)
    assert registered.stdout == "complete -o default -F _shtab_fem_reference ./fem\n"


def test_bash_offers_folders_and_files(scripts, tmp_path, monkeypatch) -> None:
    (tmp_path / "here").mkdir()
    (tmp_path / "a.json").write_text("")
    monkeypatch.chdir(tmp_path)
    assert offered(scripts["bash"], "./fem", "export", "rod", "--to", "") == ["here"]
    assert set(offered(scripts["bash"], "./fem", "run", "rod", "--json", "")) == {"here", "a.json"}


def options() -> dict[str, list[argparse.Action]]:
    """The options of each verb."""
    verbs = cli.parser()._subparsers._group_actions[0].choices.items()
    return {name: [action for action in sub._actions if action.option_strings] for name, sub in verbs}


def test_no_option_of_any_verb_is_left_out(scripts) -> None:
    for verb, actions in options().items():
        wanted = [option for action in actions for option in action.option_strings]
        assert sorted(offered(scripts["bash"], "fem-reference", verb, "--")) == sorted(
            option for option in wanted if option.startswith("--")
        )
        in_zsh = re.search(
            rf"_shtab_fem_reference_{verb.replace('-', '_')}_options=\((.*?)\n\)", scripts["zsh"], re.DOTALL
        )
        assert in_zsh is not None
        in_fish = "\n".join(line for line in scripts["fish"].splitlines() if re.search(rf"\b{verb}\b", line))
        for option in wanted:
            assert option in in_zsh[1]
            assert f"-{'l' if option.startswith('--') else 's'} {option.lstrip('-')}" in in_fish


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
