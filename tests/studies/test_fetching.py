"""Import of data by content: what is written is of the list alone, and nothing is made where nothing is known."""

import hashlib
import io
import os
import tarfile
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from fem_reference.assessment import experiments
from fem_reference.foundations.errors import InputError
from fem_reference.scenes import casefile
from fem_reference.studies import fetching
from fem_reference.studies.fetching import Listed, fetch

BOX, TOP, OTHER = b"a box", b"a top\x00\xff", b"other"  # OTHER is as long as BOX


def content(data: bytes) -> tuple[int, str]:
    """Size and hash of a file."""
    return len(data), hashlib.sha256(data).hexdigest()


WANTED = Listed(
    licence="nobody's",
    published={"box/box.vtk": content(BOX), "box/plate_top.vtk": content(TOP), "box/plate_bottom.vtk": content(b"low")},
    made={"frames/0000.ply": content(BOX)},
)
FILES = {
    "repo-main/data/x.bin": TOP,
    "../../outside.vtk": BOX,
    "/box/box.vtk": OTHER,
}  # names of other files, and paths outside


def as_zip(path: Path, files: dict[str, bytes]) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)


def as_tar(path: Path, files: dict[str, bytes], mode: str) -> None:
    with tarfile.open(path, mode) as archive:
        for name, data in files.items():
            member = tarfile.TarInfo(name)
            member.size = len(data)
            archive.addfile(member, io.BytesIO(data))


def as_folder(path: Path, files: dict[str, bytes]) -> None:
    for name, data in files.items():
        place = path / name.strip("./")
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(data)


FORMS: dict[str, Callable[[Path, dict[str, bytes]], None]] = {
    "folder": as_folder,
    "zip": as_zip,
    "tar": lambda path, files: as_tar(path, files, "w"),
    "tar.gz": lambda path, files: as_tar(path, files, "w:gz"),
    "tar.xz": lambda path, files: as_tar(path, files, "w:xz"),
}


def tree(folder: Path) -> dict[str, bytes]:
    """The files below a folder."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("form", FORMS)
def test_what_is_identical_is_written_whatever_it_is_called(form: str, tmp_path: Path) -> None:
    """One content may be two files; another one of the same size and name is none; no path of an archive is written to."""
    FORMS[form](tmp_path / "given", FILES)
    found = fetch([tmp_path / "given"], tmp_path / "a" / "deep" / "to", WANTED)
    assert found == ["box/box.vtk", "box/plate_top.vtk", "frames/0000.ply"]
    assert tree(tmp_path / "a") == {
        "deep/to/box/box.vtk": BOX,
        "deep/to/box/plate_top.vtk": TOP,
        "deep/to/frames/0000.ply": BOX,
    }
    assert {path.name for path in tmp_path.iterdir()} == {"given", "a"}


def test_a_tar_whose_last_file_is_a_zip_is_a_tar(tmp_path: Path) -> None:
    as_zip(tmp_path / "inner", {"nothing": b"of ours"})
    as_tar(tmp_path / "given", {"top": TOP, "inner.zip": (tmp_path / "inner").read_bytes()}, "w")
    assert fetch([tmp_path / "given"], tmp_path / "to", WANTED) == ["box/plate_top.vtk"]


def test_links_of_an_archive_are_not_followed(tmp_path: Path) -> None:
    (tmp_path / "secret").write_bytes(BOX)
    with tarfile.open(tmp_path / "given", "w") as archive:
        link = tarfile.TarInfo("box.vtk")
        link.type, link.linkname, link.size = tarfile.SYMTYPE, str(tmp_path / "secret"), 0
        archive.addfile(link)
    with pytest.raises(InputError, match="none of the 4 known files"):
        fetch([tmp_path / "given"], tmp_path / "to", WANTED)


def test_several_downloads_make_one_folder_with_which_a_case_can_be_solved(tmp_path: Path) -> None:
    as_folder(tmp_path / "one", {"top": TOP})
    as_zip(tmp_path / "two", {"box": BOX})
    some = fetch([tmp_path / "one", tmp_path / "two"], tmp_path / "some", WANTED)
    assert fetching.cases_with(some) == [], "a plate is missing"
    as_tar(tmp_path / "three", {"low": b"low"}, "w:bz2")
    every = fetch([tmp_path / name for name in ("one", "two", "three")], tmp_path / "every", WANTED)
    assert fetching.cases_with(every) == ["box_squeeze_report"]


def damaged(path: Path, form: str) -> None:
    """An archive of a file that is known, which ends early."""
    FORMS[form](path, {"noise": os.urandom(9000), "top": TOP})
    path.write_bytes(path.read_bytes()[: 600 if form == "tar" else 5000])


@pytest.mark.parametrize("make", [
    lambda path: as_folder(path, {"box.vtk": OTHER}),
    lambda path: as_zip(path, {"box.vtk": OTHER}),
    lambda path: damaged(path, "tar"),
    lambda path: damaged(path, "tar.gz"),
    lambda path: damaged(path, "tar.xz"),
    lambda path: damaged(path, "zip"),
    lambda path: path.write_bytes(BOX),
    lambda _: None,
])  # fmt: skip
def test_where_nothing_is_known_nothing_is_made(make: Callable[[Path], None], tmp_path: Path) -> None:
    make(tmp_path / "given")
    before = tree(tmp_path)
    with pytest.raises(
        InputError, match=r"given: got .*want an undamaged folder or archive \(zip, tar\) with published data"
    ):
        fetch([tmp_path / "given"], tmp_path / "a" / "to", WANTED)
    assert tree(tmp_path) == before
    assert not (tmp_path / "a").exists()


def test_a_damaged_source_leaves_nothing_of_a_whole_one(tmp_path: Path) -> None:
    as_folder(tmp_path / "whole", {"top": TOP})
    damaged(tmp_path / "given", "tar.gz")
    with pytest.raises(InputError, match="given: got "):
        fetch([tmp_path / "whole", tmp_path / "given"], tmp_path / "to", WANTED)
    assert not (tmp_path / "to").exists()


def test_a_zip_whose_content_is_not_as_its_checksum_says_is_damaged(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "given", "w") as archive:
        archive.writestr("box", BOX)
    (tmp_path / "given").write_bytes((tmp_path / "given").read_bytes().replace(BOX, OTHER))
    with pytest.raises(InputError, match="Bad CRC-32"):
        fetch([tmp_path / "given"], tmp_path / "to", WANTED)


def test_a_folder_that_is_in_use_stays_as_it_is(tmp_path: Path) -> None:
    as_folder(tmp_path / "given", FILES)
    as_folder(tmp_path / "to", {"mine": b"mine"})
    with pytest.raises(InputError, match=r"--to: got .*, which is not empty, want a new or empty folder"):
        fetch([tmp_path / "given"], tmp_path / "to", WANTED)
    assert tree(tmp_path / "to") == {"mine": b"mine"}


def test_the_list_has_all_that_cases_and_experiments_name() -> None:
    files = {*fetching.known().published, *fetching.known().made}
    named = {name for case in casefile.cases() for name in casefile.read(case).needed_data}
    named |= {one.file for one in experiments.experiments().values() if one.file}
    assert len(named) > 10
    assert named <= files
    assert not fetching.known().published.keys() & fetching.known().made.keys()
    assert not [name for name in files if Path(name).is_absolute() or ".." in Path(name).parts]


def test_the_list_is_that_of_the_data(data: Path) -> None:
    for name, stated in (fetching.known().published | fetching.known().made).items():
        assert content((data / name).read_bytes()) == stated, name


def test_published_files_alone_bring_the_box_alone() -> None:
    """Every muscle needs a cleaned pelvis, its attachments too, which no copy has."""
    assert fetching.cases_with(fetching.known().published) == ["box_squeeze_report"]
