"""Every shipped case: its expectations pass, and with its spoil applied the verdict turns to fail."""

import json

import pytest

from fem_reference import casefile, cli

# The way there and back in its two ends and a middle; the bulk of the time is the number of frames.
FEW = {"frames.every": 100}


def run(scene, folder, monkeypatch):
    monkeypatch.setattr(casefile, "read", lambda _: scene)
    target = folder / "facts.json"
    status = cli.main(["run", scene.name, "--out", str(folder), "--json", str(target), "--quiet"])
    return status, json.loads(target.read_text())


def rows(facts, metric, statistic):
    found = [row for row in facts["measures"] if (row["metric"], row["statistic"]) == (metric, statistic)]
    return {row["frame"]: row["value"] for row in found if row["candidate"] == "reference"}


def test_every_case_is_run_here() -> None:
    assert casefile.cases() == ["gluteus_maximus", "hip_flexion"]


def test_hip_flexion_spoiled_fails(tmp_path, monkeypatch) -> None:
    status, facts = run(casefile.read("hip_flexion", changes=FEW, spoiled=True), tmp_path, monkeypatch)
    assert status == cli.VERDICT_FAIL
    assert max(map(abs, rows(facts, "volume", "deviation").values())) > 2  # percent, where 0.5 is allowed


def test_main_job(tmp_path) -> None:
    target = tmp_path / "facts.json"
    status = cli.main(["demo", "--out", str(tmp_path), "--json", str(target), "--quiet"])
    facts = json.loads(target.read_text())
    assert (status, facts["verdict"], facts["status"]) == (cli.DONE, "pass", "converged")
    frames = {row["frame"] for row in facts["measures"] if row["candidate"] == "pbd"}
    assert frames == set(range(0, 201, 10))
    metrics = {row["metric"] for row in facts["measures"] if row["candidate"] == "pbd"}
    assert metrics == {"volume", "fibre_length", "surface_deviation"}
    page = (tmp_path / "hip_flexion" / "report.html").read_text()
    assert page.count("data:image/webp") >= 4, "the pictures are missing"


def test_gluteus_maximus_against_the_recorded_output(data, tmp_path) -> None:
    target, recorded = tmp_path / "facts.json", data / "candidates" / "report_pbd_gluteus_maximus"
    status = cli.main(
        [
            "compare",
            "gluteus_maximus",
            "--candidate",
            str(recorded),
            "--out",
            str(tmp_path),
            "--json",
            str(target),
            "--quiet",
        ]
    )
    facts = json.loads(target.read_text())
    assert (status, facts["verdict"], facts["status"]) == (cli.DONE, "pass", "converged")
    volume = rows(facts, "volume", "deviation")
    assert sorted(volume) == list(range(0, 201, 10))
    assert max(map(abs, volume.values())) < 0.5
    assert rows(facts, "surface_deviation", "max")[200] < 0.01
    # The report's program states its greatest displacement, 132.5 mm at iteration 100, of vertices that both hold alike.
    assert rows(facts, "surface_deviation", "max")[100] == pytest.approx(132.5, abs=1)


def test_gluteus_maximus_with_a_truncated_frame(data, tmp_path, capsys) -> None:
    folder = tmp_path / "cut"
    folder.mkdir()
    for path in (data / "candidates" / "report_pbd_gluteus_maximus").glob("*.ply"):
        content = path.read_bytes()
        (folder / path.name).write_bytes(content[: len(content) // 2] if path.stem == "frame_0120" else content)
    assert (
        cli.main(["compare", "gluteus_maximus", "--candidate", str(folder), "--out", str(tmp_path / "out")])
        == cli.BAD_INPUT
    )
    assert "frame_0120.ply" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_gluteus_maximus_spoiled_fails(data, tmp_path, monkeypatch) -> None:
    assert data.is_dir()
    coarse = {"frames.last": 110, "frames.every": 110, "expect[1].frame": 110, "muscle.tet_size": "14 mm"}
    status, _ = run(casefile.read("gluteus_maximus", changes=coarse, spoiled=True), tmp_path, monkeypatch)
    assert status == cli.VERDICT_FAIL
