"""Keys of cases: of all that determines the solution, and of nothing else."""

from pathlib import Path

import small

from fem_reference.scenes import casefile


def test_the_key_of_a_scene_is_of_what_its_files_contain_and_not_of_their_names(tmp_path: Path) -> None:
    folder = small.write(tmp_path / "bar")
    before = casefile.read(folder).key
    text = (folder / "case.toml").read_text()
    (folder / "floor.vtp").rename(folder / "ground.vtp")
    (folder / "case.toml").write_text(text.replace('"floor.vtp"', '"ground.vtp"'))
    assert casefile.read(folder).key == before
    (folder / "case.toml").write_text(text.replace('"floor.vtp"', '"lid.vtp"'))
    assert casefile.read(folder).key != before
