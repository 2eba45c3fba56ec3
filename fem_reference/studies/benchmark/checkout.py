"""The source of an earlier commit of this project, in a temporary folder."""

import shutil
import subprocess
import tarfile
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from fem_reference.foundations.errors import InputError

ROOT = Path(__file__).resolve().parent.parent.parent.parent
# What timing imports: commits without it have their modules in other places.
_NEEDED = "fem_reference/problems/paths.py"


@dataclass(frozen=True)
class Commit:
    """A commit: as it was ``asked`` for, all its digits, and as many as are needed."""

    asked: str
    digits: str
    short: str


def find(asked: str) -> Commit:
    """The commit that ``asked`` names; InputError where git is not there, has no such commit, or it is too old."""
    if shutil.which("git") is None:
        raise InputError("--against", f'"{asked}", and no git', "git on the PATH, to take a commit from")
    top = _git("rev-parse", "--show-toplevel")
    if top.returncode != 0 or Path(top.stdout.strip()).resolve() != ROOT:
        got = f'"{asked}", and {_last_words(top) or "no repository"}'
        raise InputError("--against", got, f"a git repository in {ROOT}, where this package is")
    found = _git("rev-parse", "--verify", "--end-of-options", f"{asked}^{{commit}}")
    if found.returncode != 0:
        raise InputError("--against", f'"{asked}" ({_last_words(found)})', f"a commit of the repository in {ROOT}")
    digits = found.stdout.strip()
    if _git("cat-file", "-e", f"{digits}:{_NEEDED}").returncode != 0:
        raise InputError("--against", f'"{asked}", which has no {_NEEDED}', "a later commit")
    return Commit(asked, digits, _git("rev-parse", "--short", digits).stdout.strip())


@contextmanager
def checked_out(commit: Commit) -> Iterator[Path]:
    """The files of ``commit`` in a folder that is removed afterwards; the repository stays as it is."""
    with tempfile.TemporaryDirectory(prefix="fem_reference-") as folder:
        archive, root = Path(folder) / "commit.tar", Path(folder) / "commit"
        made = _git("archive", "--format=tar", f"--output={archive}", commit.digits)
        if made.returncode != 0:
            raise InputError(
                "--against", f'"{commit.asked}" ({_last_words(made)})', "a commit whose files are all there"
            )
        with tarfile.open(archive) as packed:
            packed.extractall(root, filter="data")
        yield root


def _git(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True, check=False)


def _last_words(done: subprocess.CompletedProcess[str]) -> str:
    """The last line that git wrote of what went wrong, else of its answer."""
    lines = (done.stderr.strip() or done.stdout.strip()).splitlines()
    return lines[-1] if lines else ""
