"""Import of data that is not part of the project: files that the user has downloaded, recognised by their content alone."""

import hashlib
import tarfile
import zipfile
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

from fem_reference.export.folders import new_folder
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import Record, parse
from fem_reference.io import texts
from fem_reference.scenes import casefile

_WANT = "an undamaged folder or archive (zip, tar) with published data"


class Listed(Record):
    """Size [bytes] and SHA-256 of files by path in the data folder: ``published`` files, and files ``made`` from these."""

    licence: str
    published: dict[str, tuple[int, str]]
    made: dict[str, tuple[int, str]]


def known() -> Listed:
    """The files that the shipped cases, the tests and the pages read."""
    return parse(Listed, texts.toml(Path(__file__).with_name("anatomy.toml")), "anatomy.toml")


def fetch(sources: Sequence[Path], folder: Path, wanted: Listed) -> list[str]:
    """Write each file of ``wanted`` that the ``sources`` contain into a new ``folder``; return the paths of these files in it.

    A source is a folder or an archive; names of files in it are ignored. Raises InputError and makes no folder if no file is
    found, if a source is damaged, or if ``folder`` is in use.
    """
    found, files = set[str](), wanted.published | wanted.made
    sizes = {size for size, _ in files.values()}
    with new_folder(folder) as part:
        for content in (content for source in sources for content in _contents(source, sizes)):
            this = (len(content), hashlib.sha256(content).hexdigest())
            for name in (name for name, one in files.items() if one == this):
                (part / name).parent.mkdir(parents=True, exist_ok=True)
                (part / name).write_bytes(content)
                found.add(name)
        if not found:
            raise InputError(" ".join(map(str, sources)), f"none of the {len(files)} known files", _WANT)
    return sorted(found)


def cases_with(found: Collection[str]) -> list[str]:
    """The shipped cases that need data and whose files are all among ``found``."""
    needs = {name: casefile.read(name).needed_data for name in casefile.cases()}
    return [name for name, needed in needs.items() if needed and {*needed} <= {*found}]


def _contents(source: Path, sizes: Collection[int]) -> Iterator[bytes]:
    """The contents of those files in a folder or an archive whose size is one of ``sizes`` [bytes]."""
    try:
        if source.is_dir():
            paths = [path for path in source.rglob("*") if path.is_file() and path.stat().st_size in sizes]
            yield from (path.read_bytes() for path in paths)
        elif texts.is_file(source) and tarfile.is_tarfile(source):  # before zip, as a tar may end with a zip
            with tarfile.open(source) as tar:
                members = (tar.extractfile(one) for one in tar if one.isfile() and one.size in sizes)
                yield from (member.read() for member in members if member)
        elif zipfile.is_zipfile(source):
            with zipfile.ZipFile(source) as archive:
                yield from (archive.read(one) for one in archive.infolist() if one.file_size in sizes)
        else:
            raise ValueError("another file" if source.exists() else "nothing there")
    except Exception as error:  # the reader of a damaged archive may raise anything
        raise InputError(source, str(error) or type(error).__name__, _WANT) from error
