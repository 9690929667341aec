"""Keyframes through the Python package, the command line, scene files and a real limberd."""

import json
import os
import re
import subprocess
import sys

import limber
import meshio
import numpy as np
import pytest
from conftest import ROOT, bar, small_scene, tip_of

LENGTH = 3.0  # of the bar


@pytest.fixture
def motion(session):
    """Positions of a solved motion of the bar, frames x nodes x 3."""
    held = session.add(node=tip_of(session), frame=30, displacement=(0, 0.3, 0.3))
    session.wait()
    positions = session.frames().astype(float)
    held.remove()
    session.wait()
    return positions


def missed(session, pose, frame):
    return np.linalg.norm(session.frames(frame, 1)[0] - pose, axis=1).max()


def test_a_pose_of_the_bar_is_met_elsewhere_in_time(session, motion):
    keyframe = session.add_keyframe(frame=20, positions=motion[30], exact=True)
    result = session.wait()
    assert result.converged and result.status == "CONVERGED", result.message
    assert 0 < result.max_keyframe_error < 1e-2 * LENGTH
    assert missed(session, motion[30], 20) == pytest.approx(result.max_keyframe_error, abs=1e-4)
    receipt = keyframe.move(25, weight=1e-4)
    assert receipt.keyframe_ids == (keyframe.id,) and receipt.constraint_ids == (0,)
    softer = session.wait()
    assert softer.max_keyframe_error > result.max_keyframe_error
    assert missed(session, motion[30], 25) == pytest.approx(softer.max_keyframe_error, abs=1e-4)
    [listed] = session.keyframes()
    assert (listed.id, listed.frame, listed.weight) == (keyframe.id, 25, 1e-4)
    session.undo()
    assert session.keyframes()[0].weight == float("inf")
    assert session.wait().max_keyframe_error == pytest.approx(result.max_keyframe_error, rel=1e-3)
    keyframe.remove()
    assert session.wait().energy == pytest.approx(0, abs=1e-12)
    assert session.keyframes() == []


def test_what_is_wrong_with_a_keyframe_is_named(session):
    rest = session.geometry().rest

    def refused(**what):
        with pytest.raises(limber.LimberError) as error:
            session.add_keyframe(**({"frame": 20, "positions": rest} | what))
        return error.value.code, error.value.field

    where = "edits[0].add_keyframe.keyframe."
    assert refused(frame=60) == ("OUT_OF_RANGE", where + "frame")
    assert refused(weight=-1.0) == ("INVALID_ARGUMENT", where + "weight")
    assert refused(positions=rest[:-1]) == ("INVALID_ARGUMENT", where + "positions")
    assert refused(positions=rest * np.nan)[0] == "INVALID_ARGUMENT"
    assert refused(positions=rest * 1e9) == ("OUT_OF_RANGE", where + "positions")
    assert refused(positions=rest[:, :2]) == ("INVALID_ARGUMENT", "positions")
    assert refused(positions="none.vtu") == ("IO", "positions")
    assert refused(weight=1.0, exact=True) == ("INVALID_ARGUMENT", "weight")
    first = session.add_keyframe(frame=20, positions=rest)
    assert refused() == ("ALREADY_EXISTS", where + "frame")
    for edit, field in ((limber.move_keyframe(first), "move_keyframe"),
                        (limber.move_keyframe(99, 5), "move_keyframe.id"),
                        (limber.remove_keyframe(99), "remove_keyframe.id")):
        with pytest.raises(limber.LimberError) as error:
            session.edit([edit])
        assert error.value.field == "edits[0]." + field
    assert "held by the end" in first.move(0).issues[0]
    assert len(session.keyframes()) == 1, "what was refused left nothing"


def test_scenes_have_keyframes_and_keep_them(server, session, motion, tmp_path):
    nodes, tets = bar()
    scene = small_scene(keyframes=[limber.keyframe(frame=20, positions=motion[30], exact=True)])
    opened = server.open(scene, progress=False)
    result = opened.wait()
    assert 0 < result.max_keyframe_error < 1e-2 * LENGTH
    opened.export(tmp_path, ["scene"], "again")
    again = limber.load_scene(tmp_path / "again.json")
    kept = again.keyframes[0]
    assert (kept.frame, kept.exact) == (20, True)
    np.testing.assert_allclose(np.frombuffer(kept.positions.data).reshape(-1, 3), motion[30], atol=1e-12)
    assert opened.scene().keyframes[0] == kept
    opened.close()

    # In files: mesh files beside the scene.
    meshio.write(tmp_path / "bar.vtk", meshio.Mesh(nodes, [("tetra", tets)]))
    meshio.write(tmp_path / "up.vtk", meshio.Mesh(motion[30], [("tetra", tets)]))
    body = {"mesh": {"path": "bar.vtk"}, "frames": 60, "fixed_nodes": list(range(9)), "model": {"modes": 8},
            "material": {"youngs_modulus": 1e5}, "dynamics": {"period_frames": 25},
            "keyframes": [{"frame": 20, "path": "up.vtk", "exact": True}]}
    (tmp_path / "scene.json").write_text(json.dumps(body))
    opened = server.open(tmp_path / "scene.json", progress=False)
    assert opened.wait().max_keyframe_error < 1e-2 * LENGTH
    opened.close()


def test_the_command_line(cli, session, motion, tmp_path):
    def done(*arguments):
        process = cli(*arguments)
        assert process.returncode == 0, process.stderr
        return process.stdout

    nodes, tets = bar()
    meshio.write(tmp_path / "bar.vtk", meshio.Mesh(nodes, [("tetra", tets)]))
    meshio.write(tmp_path / "up.vtk", meshio.Mesh(motion[30], [("tetra", tets)]))
    meshio.write(tmp_path / "few.vtk", meshio.Mesh(motion[30][:9], [("tetra", np.array([[0, 1, 2, 4]]))]))
    up = tmp_path / "up.vtk"
    assert re.search(r"revision \d+, keyframe 1$", done("keyframe", session.id, "--frame", 20, "--pose", up, "--exact"),
                     re.MULTILINE)
    done("keyframe", session.id, "--frame", 40, "--pose", up)
    done("keyframe", session.id, "--move", 2, "--frame", 45, "--weight", 7)
    done("wait", session.id)
    rows = [line.split() for line in done("keyframes", session.id).splitlines()]
    assert rows[1:3] == [["1", "20", "exact"], ["2", "45", "7"]] and rows[3][0] == "missed"
    assert "keyframe error" in done("show", session.id)
    listed = json.loads(done("--json", "keyframes", session.id))["keyframes"]
    assert [keyframe["frame"] for keyframe in listed] == [20, 45]
    done("keyframe", "--remove", 1, 2, session.id)
    assert session.keyframes() == []

    for arguments, code, text in ((("--frame", 20, "--pose", tmp_path / "few.vtk"), 1, "keyframe.file"),
                                  (("--frame", 20, "--pose", tmp_path / "none.vtk"), 1, "--pose"),
                                  (("--pose", up), 1, "--frame"), (("--frame", 20), 2, ""),
                                  (("--remove", 1, "--frame", 3), 2, ""), (("--move", 9, "--frame", 3), 1, "[NOT_FOUND]")):
        process = cli("keyframe", session.id, *arguments)
        assert process.returncode == code and text in process.stderr, (arguments, process.stderr)
    (tmp_path / "scene.json").write_text(json.dumps(
        {"mesh": {"path": "bar.vtk"}, "frames": 60, "fixed_nodes": list(range(9)), "model": {"modes": 8},
         "keyframes": [{"frame": 61, "path": "up.vtk"}, {"frame": 3, "path": "few.vtk"}, {"frame": 4}]}))
    assert re.findall(r"^error: (\S+):", cli("validate", tmp_path / "scene.json").stdout, re.MULTILINE) == [
        "keyframes[1].path", "keyframes[2].positions", "keyframes[0].frame"]


def test_the_example_interpolates_three_poses(limberd, tmp_path):
    process = subprocess.run([sys.executable, str(ROOT / "examples" / "interpolate_poses.py")], capture_output=True,
                             text=True, timeout=60, env=dict(os.environ, XDG_CACHE_HOME=str(tmp_path)))
    assert process.returncode == 0, process.stderr
    rows = [line.split() for line in process.stdout.splitlines()[1:]]
    assert [row[0] for row in rows] == ["motion", "all"]
    energy, poses, tip = np.array([row[1:] for row in rows], float).T
    assert energy[1] < energy[0] and (poses < 0.1).all() and (tip < 0.05).all(), process.stdout
