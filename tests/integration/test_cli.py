"""`limber` as a person or a shell script uses it."""

import json
import os
import pty
import re
import select
import signal
import subprocess
import time
import warnings

import limber
import meshio
import numpy as np
import pytest
from conftest import bar, small_scene, tip_of
from limber.launching import find_binary
from limber.messages import scene as scene_messages

COMMANDS = ["start", "stop", "info", "status", "backup", "jobs", "sample", "validate", "tetrahedralize", "simulate", "open",
            "list", "show", "wait", "close", "cancel", "cold", "add", "move", "replace", "remove", "ends", "dynamics", "keyframe",
            "keyframes", "undo", "redo", "edit-script", "frames", "export", "watch",
            "deploy", "pin", "attach"]


@pytest.fixture
def scene_file(tmp_path):
    """A scene file with its mesh beside it."""
    nodes, tets = bar()
    meshio.write(tmp_path / "bar.vtk", meshio.Mesh(nodes, [("tetra", tets)]))
    (tmp_path / "scene.json").write_text(json.dumps({
        "name": "bar", "mesh": {"path": "bar.vtk"}, "frames": 60, "fixed_nodes": list(range(9)),
        "material": {"youngs_modulus": 1e5}, "dynamics": {"period_frames": 25}, "model": {"modes": 8, "tolerance": 0.02}}))
    return tmp_path / "scene.json"


def done(process):
    assert process.returncode == 0, process.stderr + process.stdout
    return process.stdout


def failed(process, code):
    assert process.returncode == code, (process.returncode, process.stderr, process.stdout)
    assert "terminate" not in process.stderr
    return process.stderr


def test_help_lists_every_command(cli):
    text = done(cli("--help"))
    listed = re.findall(r"^  ([a-z-]+) {2,}\S", text, re.MULTILINE)
    assert sorted(set(listed) & set(COMMANDS)) == sorted(COMMANDS)
    assert "Exit codes" in text
    assert done(cli("--version")).startswith("limber ")


@pytest.mark.parametrize("command", COMMANDS)
def test_each_command_explains_itself(cli, command):
    text = done(cli(command, "--help"))
    assert "Example" in text and f"limber {command}" in text and "--endpoint" in text and "--json" in text


@pytest.mark.parametrize("arguments", [(), ("unknown",), ("open",), ("open", "a.json", "--sample", "beam"), ("add", "s"),
                                       ("add", "s", "--node", "1", "--frame", "2"),
                                       ("add", "s", "--node", "1", "--frame", "2", "--position", "1", "2"),
                                       ("add", "s", "--node", "1", "--frame", "-2", "--position", "1", "2", "3"),
                                       ("add", "s", "--node", "1", "--frame", "2", "--position", "1", "2", "3", "--axes", "w"),
                                       ("frames", "s", "--out", "x.txt"), ("wait", "s", "--until", "never")])
def test_wrong_command_lines_are_exit_code_2(cli, arguments):
    assert failed(cli(*arguments), 2) != ""


def test_nobody_there_is_exit_code_3(cli, tmp_path):
    endpoint = f"ipc://{tmp_path}/nobody"
    message = failed(cli("info", "--timeout", "0.3", endpoint=endpoint), 3)
    assert "limber start" in message and endpoint in message


@pytest.mark.parametrize("arguments", [("list",), ("wait", "s"), ("export", "s", "--format", "pvd"), ("stop",)])
def test_that_nobody_is_there_is_known_soon(cli, arguments):
    begin = time.monotonic()
    failed(cli(*arguments, endpoint="tcp://127.0.0.1:9"), 3)
    assert time.monotonic() - begin < 4, "two seconds and what the process takes to start"
    begin = time.monotonic()
    failed(cli("--connect-timeout", "0.2", *arguments, endpoint="tcp://127.0.0.1:9"), 3)
    assert time.monotonic() - begin < 2


def test_a_scene_without_a_name(cli, scene_file):
    scene = json.loads(scene_file.read_text())
    del scene["name"]
    assert done(cli("open", write(scene_file, json.dumps(scene)), "--session", "n")).startswith("session n: 144 tets")
    assert done(cli("show", "n")).startswith("session n, ready")
    done(cli("close", "n"))


def test_the_whole_flow(cli, scene_file, tmp_path):
    opened = done(cli("open", scene_file, "--session", "flow"))
    assert "144 tets, 63 nodes, 60 frames, ready" in opened
    tip = 62
    assert "revision 1, constraint" in done(cli("add", "flow", "--node", tip, "--frame", 30, "--displacement", 0, 0, -0.4))
    result = json.loads(done(cli("wait", "flow", "--json")))
    assert result["converged"] and result["revision"] == "1" and result["total_energy"] > 0
    shown = done(cli("show", "flow"))
    assert "(0, 0, -0.4)" in shown and "energy" in shown
    number = json.loads(done(cli("show", "flow", "--json")))["scene"]["constraints"][0]["id"]
    done(cli("move", "flow", number, 0, 0, -0.2))
    done(cli("replace", "flow", number, "--nodes", tip, tip - 1, "--frame", 31, "--position", 3, 1, 0.8, "--axes", "xz",
             "--exact"))
    done(cli("ends", "flow", "--first", "position_velocity", "--last", "free"))
    done(cli("undo", "flow"))
    done(cli("redo", "flow"))
    assert "revision 7" in done(cli("remove", "flow", number))
    done(cli("undo", "flow"))
    assert "final" in done(cli("wait", "flow", "--until", "final"))
    assert "job" in done(cli("cold", "flow"))
    done(cli("wait", "flow"))

    arrays = {}
    for encoding in ("coordinates", "positions", "quantised"):
        done(cli("frames", "flow", "--out", tmp_path / "m.npy", "--encoding", encoding))
        arrays[encoding] = np.load(tmp_path / "m.npy")
        assert arrays[encoding].shape == (60, 63, 3)
        np.testing.assert_allclose(arrays[encoding], arrays["coordinates"], atol=1e-3)
    done(cli("frames", "flow", "--out", tmp_path / "m.csv", "--first", 31, "--count", 1))
    table = np.genfromtxt(tmp_path / "m.csv", delimiter=",", names=True)
    assert set(table["frame"]) == {31}
    np.testing.assert_allclose(np.column_stack([table["x"], table["y"], table["z"]]), arrays["coordinates"][31], atol=1e-5)
    mean = arrays["positions"][31, [tip, tip - 1]].mean(axis=0)
    assert mean[0] == pytest.approx(3, abs=1e-4) and mean[2] == pytest.approx(0.8, abs=1e-4)

    done(cli("export", "flow", "--format", "pvd", "pc2", "scene", "--out", tmp_path / "out"))
    assert (tmp_path / "out/motion.pvd").exists() and (tmp_path / "out/motion.pc2").exists()
    assert "flow" in done(cli("list")) and "flow" in done(cli("jobs"))
    assert "closed" in done(cli("close", "flow"))
    assert "[NOT_FOUND]" in failed(cli("show", "flow"), 1)


def test_refusals_are_exit_code_1_with_code_and_field(cli, session, tmp_path):
    add = ("add", session.id, "--node", 1, "--frame", 600, "--displacement", 0, 0, 1)
    message = failed(cli(*add), 1)
    assert "edits[0].add.constraint.frame" in message and "[OUT_OF_RANGE]" in message
    error = json.loads(failed(cli(*add, "--json"), 1))
    assert error["code"] == "ERROR_CODE_OUT_OF_RANGE" and error["field"] == "edits[0].add.constraint.frame"
    assert "mesh.path" in failed(cli("open", write(tmp_path / "s.json", '{"mesh": {"path": "none.msh"}}')), 1)
    for command in ("open", "validate", "tetrahedralize"):
        assert "[IO]" in failed(cli(command, tmp_path / "none.obj"), 1), "a file that is not there is refused alike"
    assert "[IO]" in failed(cli("edit-script", session.id, tmp_path / "none.jsonl"), 1)
    assert "[NOT_FOUND]" in failed(cli("undo", "nobody"), 1)


def test_what_has_no_effect_is_reported_on_stderr(cli, session):
    process = cli("add", session.id, "--node", 0, "--frame", 59, "--displacement", 0, 0, 0.1)
    assert "revision 1" in done(process)
    assert re.findall(r"^warning: (\S+):", process.stderr, re.MULTILINE) == ["edits[0].add.constraint.frame",
                                                                             "edits[0].add.constraint.nodes"]
    assert re.search(r"^constraint error .*; of exact ones 0 at most$", done(cli("wait", session.id)), re.MULTILINE)


def write(path, text):
    path.write_text(text)
    return path


def test_a_wait_that_runs_out_is_exit_code_4(cli, session):
    assert "[TIMEOUT]" in failed(cli("wait", session.id, "--revision", 99, "--wait", 0.2), 4)


def test_edit_script(cli, session, tmp_path):
    script = write(tmp_path / "edits.jsonl", "\n".join([
        "# drag the tip",
        '{"add": {"constraint": {"frame": 30, "nodes": [62], "displacement": {"z": 0.2}}}}',
        "",
        '{"edits": [{"add": {"constraint": {"frame": 40, "nodes": [62], "displacement": {"y": 0.2}, "exact": true}}},'
        ' {"set_ends": {"first_end": "END_CONDITION_FREE", "last_end": "END_CONDITION_FREE"}}]}',
        '{"undo": {}}']))
    lines = [json.loads(line) for line in done(cli("edit-script", session.id, script, "--json")).splitlines()]
    assert [line["revision"] for line in lines] == ["1", "1", "2", "2", "3", "3"]
    assert len(session.constraints()) == 1
    assert "revision 4" in done(cli("edit-script", session.id, "-", "--wait", "none", input='{"redo": {}}\n'))
    message = failed(cli("edit-script", session.id, "-", input='{"undo": {}}\n{"nonsense": 1}\n'), 1)
    assert "line 2" in message
    assert session.status().revision == 5
    message = failed(cli("edit-script", session.id, "-", input='{"undo": {}}\n{"remove": {"id": 77}}\n'), 1)
    assert "line 2: edits[0].remove.id" in message
    message = failed(cli("edit-script", session.id, "-", input='{"move": {"id": 1, "target": {"x": "a"}}}\n'), 1)
    assert "Cannot find field" not in message and "line 1" in message
    for line, field in (('{"move": {"id": 1, "id": 2, "target": {"x": 1}}}', "move.id"),
                        ('{"edits": [{"undo": {}}, {"remove": {"id": 1, "id": 1}}]}', "edits[1].remove.id")):
        message = failed(cli("edit-script", session.id, "-", input=line + "\n"), 1)
        assert "given twice" in message and f"line 1: {field})" in message
    twice = '{"add": {"constraint": {"frame": 3, "nodes": [62], "axes": ["AXIS_X", "AXIS_X"], "position": {"x": 1}}}}'
    message = failed(cli("edit-script", session.id, "-", input=twice + "\n"), 1)
    assert "AXIS_X is given twice" in message and "edits[0].add.constraint.axes[1]" in message
    assert session.status().revision == 6


@pytest.mark.parametrize("text, field, words", [
    ("[]", "", "a JSON object is expected"), ('{"frames": 1.5}', "frames", "whole number"),
    ('{"frames": 30, "frames": 40}', "frames", "given twice"), ('{"fram": 3}', "fram", "no such field"),
    ('{"constraints": [{"frame": 1, "frame": 2}]}', "constraints[0].frame", "given twice")])
def test_scene_files_that_are_none(cli, server, tmp_path, text, field, words):
    """Both commands and Python name the field once, in one sentence."""
    file = write(tmp_path / "s.json", text)
    reported = failed(cli("validate", file), 1)
    assert cli("validate", file).stdout.startswith(f"error: {field or file}: ")
    message = failed(cli("open", file), 1)
    assert words in message and "::" not in message.replace(": :", "::") and "\n" not in message.strip()
    assert f"(field {'scene.' + field if field else 'scene'})" in message, reported
    with pytest.raises(limber.LimberError) as caught:
        server.open(file)
    assert caught.value.field.startswith("scene")
    if words == "given twice":
        assert caught.value.field == f"scene.{field}" and words in caught.value.message


def test_limits_are_named_once(cli, tmp_path):
    file = write(tmp_path / "s.json", '{"mesh": {"sample": "beam"}, "frames": 200000}')
    assert cli("validate", file).stdout.startswith("error: frames: 200000 frames: more than the limit of 100000 [")


@pytest.mark.parametrize("arguments", [("--node", 3, 4, "SESSION", "--frame", 20, "--displacement", 0, 0, 0.1),
                                       ("--frame", 20, "--nodes", 3, 4, "SESSION", "--displacement", 0, 0, 0.1),
                                       ("--displacement", 0, 0, 0.1, "SESSION", "--frame", 20, "--node", 3, 4),
                                       ("--displacement", 0, 0, 0.1, "--frame", 20, "--node", 3, 4, "SESSION"),
                                       ("--node=3", "--node=4", "SESSION", "--frame=20", "--displacement", 0, 0, -0.1)])
def test_the_session_may_stand_behind_options_of_several_values(cli, session, arguments):
    done(cli("add", *(session.id if word == "SESSION" else word for word in arguments)))
    [held] = session.constraints()
    assert (held.nodes, held.frame, abs(held.target[2])) == ((3, 4), 20, 0.1)
    done(cli("replace", "--node", 5, session.id, held.id, "--frame", 21, "--displacement", 0, 0, 0.1))
    [held] = session.constraints()
    assert (held.nodes, held.frame) == ((5,), 21)


def test_formats_before_the_session(cli, session, tmp_path):
    done(cli("export", "--format", "scene", "pc2", session.id, "--out", tmp_path))
    assert {file.suffix for file in tmp_path.iterdir()} >= {".json", ".pc2"}


def test_dynamics_keep_what_is_not_named(cli, session):
    assert "revision 1" in done(cli("dynamics", session.id, "--period-frames", 33))
    assert "revision 2" in done(cli("dynamics", session.id, "--damping-ratio", 0.125, "--frames-per-second", 24))
    now = session.scene().dynamics
    assert (now.frames_per_second, now.period_frames, now.damping_ratio) == (24, 33, 0.125)
    done(cli("dynamics", session.id, "--force-smoothing", 0.25, "--inertia", 2))
    now = session.scene().dynamics
    assert (now.damping_ratio, now.force_smoothing, now.inertia) == (0.125, 0.25, 2)
    done(cli("dynamics", session.id, "--discretisation", "differences", "--inertia", 0))
    now = session.scene().dynamics
    assert now.discretisation == scene_messages.TIME_DISCRETISATION_DIFFERENCES
    done(cli("undo", session.id))
    done(cli("ends", session.id, "--first", "cyclic", "--last", "cyclic"))
    done(cli("undo", session.id))
    now = session.scene().dynamics
    assert (now.damping_ratio, now.inertia) == (0.125, 2)
    failed(cli("dynamics", session.id), 2)
    assert "damping_ratio" in failed(cli("dynamics", session.id, "--damping-ratio", 2), 1)


def test_what_a_model_has_otherwise_than_requested_is_reported(cli, scene_file):
    scene = json.loads(scene_file.read_text())
    del scene["fixed_nodes"]
    scene["model"]["basis_size"] = 5000
    scene_file.write_text(json.dumps(scene))
    assert re.search(r"^warning: model.basis_size: is 5000, more than the 189 degrees", done(cli("validate", scene_file)),
                     re.MULTILINE)
    text = done(cli("open", scene_file, "--session", "free"))
    assert "model.modes: 14 used, the 8 requested and 6 rigid motions" in text
    assert re.search(r"model.basis_size: \d+ used, 5000 requested", text)
    assert "model.modes: 14 used" in done(cli("show", "free"))
    done(cli("close", "free"))


def test_numbers_without_a_leading_zero(cli, session):
    done(cli("add", session.id, "--node", 62, "--frame", 30, "--displacement", 0, "-.1", ".2"))
    target = session.constraints()[0].message.displacement
    assert (target.x, target.y, target.z) == (0, -0.1, 0.2)


def test_velocities(cli, session):
    tip = tip_of(session)
    done(cli("add", session.id, "--node", tip, "--frame", 30, "--velocity", 0, 3, 0, "--weight", "0.05"))
    shown = done(cli("show", session.id))
    assert re.search(r"velocity +\(0, 3, 0\) +0.05", shown), shown
    assert re.search(r"velocity error +[0-9.e-]+ a second at most; of exact ones 0 at most", done(cli("wait", session.id)))
    done(cli("replace", session.id, 1, "--node", tip, "--frame", 31, "--velocity", 0, 2, 0, "--exact"))
    done(cli("move", session.id, 1, 0, 1, 0))
    done(cli("wait", session.id))
    motion = session.frames()
    assert abs((motion[32, tip] - motion[30, tip])[1] * 15 - 1) < 2e-4
    assert "--velocity" in failed(cli("add", session.id, "--node", tip, "--frame", 30, "--velocity", 0, 1), 2)
    both = ("--velocity", 0, 1, 0, "--displacement", 0, 1, 0)
    failed(cli("add", session.id, "--node", tip, "--frame", 30, *both), 2)


def test_what_the_command_line_does_not_know_is_named(cli):
    assert "no command 'frobnicate'" in failed(cli("frobnicate"), 2)
    message = failed(cli("ends", "s", "--first", "loose", "--last", "free"), 2)
    assert "loose not in {cyclic,free,position,position_velocity}" in message


@pytest.mark.parametrize("arguments", [("info", "--timeout", "nan"), ("info", "--connect-timeout", "inf"),
                                       ("watch", "s", "--silence", "nan"), ("wait", "s", "--wait", "-1")])
def test_times_that_are_none_are_wrong_usage(cli, arguments):
    assert "seconds" in failed(cli(*arguments), 2)


def test_infinity_is_a_number_that_the_server_refuses(cli, session):
    for number in ("-inf", "inf", "-nan"):
        assert "not a finite number" in failed(cli("move", session.id, 1, number, 0, 0), 1)


def test_a_revision_that_is_not_there_yet(cli, session):
    message = failed(cli("wait", session.id, "--revision", 999, "--wait", 1), 4)
    assert "no revision 999 yet, the newest is 0" in message and "solving" not in message


def test_no_folder_is_made_for_frames(cli, session, tmp_path):
    assert "there is no folder" in failed(cli("frames", session.id, "--out", tmp_path / "none" / "f.npy"), 1)
    assert not list(tmp_path.iterdir())


def test_a_comma_that_nothing_follows_is_no_json_to_anybody(cli, tmp_path):
    scene = tmp_path / "scene.json"
    scene.write_text('{"mesh": {"path": "a.msh"}, "frames": 100,}')
    for arguments in (("validate", scene), ("open", scene)):
        process = cli(*arguments)
        assert process.returncode == 1 and "not JSON: nothing follows the comma" in process.stdout + process.stderr
    with pytest.raises(limber.LimberError, match="not JSON"):
        limber.scenes.load_scene(scene)


def test_what_is_no_place_is_not_reported_as_empty(cli):
    for endpoint in ("tcp://127.0.0.1:99999", "tcp://nobody.invalid:7801"):
        message = failed(cli("--connect-timeout", 0.2, "info", endpoint=endpoint), 3)
        assert "name of its host" in message and "nothing listens" not in message
        with pytest.raises(limber.ServerUnreachable, match="name of its host"):
            limber.connect(endpoint, connect_timeout=0.2)


def test_watch(cli, server, session):
    process = subprocess.Popen([str(find_binary("limber")), "--endpoint", server.connection.endpoint, "--json", "watch",
                                session.id, "--silence", "20"], stdout=subprocess.PIPE, text=True)
    try:
        assert json.loads(process.stdout.readline())["revision"] == "0"
        session.add(node=tip_of(session), frame=30, displacement=(0, 0, 0.2))
        for line in process.stdout:
            result = json.loads(line)
            if result["revision"] == "1" and result["converged"]:
                break
        process.send_signal(signal.SIGINT)
        assert process.wait(10) == 130
    finally:
        process.kill()
        process.wait()
    assert failed(cli("watch", session.id, "--count", 5, "--silence", 0.3), 4)


def test_watch_reports_that_the_server_is_gone(launch):
    server = launch(transport="tcp")
    session = server.open(small_scene(), progress=False)
    process = subprocess.Popen([str(find_binary("limber")), "--endpoint", server.connection.endpoint, "--json", "watch",
                                session.id], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert json.loads(process.stdout.readline())["revision"] == "0"
        server.process.kill()
        _, message = process.communicate(timeout=15)
        assert process.returncode == 3 and server.connection.endpoint in message
    finally:
        process.kill()
        process.wait()


def test_wait_reports_that_the_server_is_gone(launch):
    """Within 8 s, and not before it has been asked whether it is there."""
    server = launch(transport="tcp")
    session = server.open(small_scene(), progress=False)
    process = subprocess.Popen([str(find_binary("limber")), "--endpoint", server.connection.endpoint, "wait", session.id,
                                "--revision", "7"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert "no revision 7 yet" in process.stderr.readline()
        server.process.kill()
        since = time.monotonic()
        _, message = process.communicate(timeout=15)
        assert process.returncode == 3 and server.connection.endpoint in message
        assert time.monotonic() - since < 9
    finally:
        process.kill()
        process.wait()


@pytest.mark.parametrize("stores, sign", [(False, signal.SIGTERM), (True, signal.SIGINT)])
def test_watch_reports_that_the_server_was_stopped(launch, tmp_path, stores, sign):
    """At once: no other run is to take its place."""
    server = launch(*(("--data", str(tmp_path / "data")) if stores else ()), transport="tcp")
    session = server.open(small_scene(), progress=False)
    process = subprocess.Popen([str(find_binary("limber")), "--endpoint", server.connection.endpoint, "--json", "watch",
                                session.id], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert json.loads(process.stdout.readline())["revision"] == "0"
        server.process.send_signal(sign)
        _, message = process.communicate(timeout=15)
        assert process.returncode == 3 and "was stopped" in message
    finally:
        process.kill()
        process.wait()


def test_a_misspelt_option_is_named_before_what_is_missing(cli):
    assert "no option --fisrt; `limber ends --help`" in failed(cli("ends", "s", "--fisrt", "free"), 2)


def test_a_malformed_endpoint_shows_how_one_looks(cli):
    assert "endpoints look like tcp://HOST:PORT" in failed(cli("info", "--endpoint", "foo"), 1)


def test_frames_that_the_ends_leave_nothing_of_are_reported_at_once(cli, scene_file):
    scene = json.loads(scene_file.read_text())
    scene.update(frames=2, first_end="END_CONDITION_PINNED_POSITION_VELOCITY", last_end="END_CONDITION_PINNED_POSITION_VELOCITY", constraints=[])
    assert "must be at least 5, as the ends hold 4, is 2" in cli("validate", write(scene_file, json.dumps(scene))).stdout


def test_validate(cli, scene_file):
    assert "can be opened" in done(cli("validate", scene_file))
    scene = json.loads(scene_file.read_text())
    scene["frames"] = 1
    scene["fixed_nodes"] = [5000]
    process = cli("validate", write(scene_file, json.dumps(scene)))
    assert process.returncode == 1
    assert "frames" in process.stdout and "fixed_nodes" in process.stdout, "everything that is wrong, not the first thing"
    assert re.search(r"^error: fixed_nodes\[0\]: .*\[OUT_OF_RANGE\]$", process.stdout, re.MULTILINE)
    assert re.search(r"^error: frames: .*\[INVALID_ARGUMENT\]$", process.stdout, re.MULTILINE)


@pytest.mark.parametrize("scene, fields", [
    ({"mesh": {"sample": "beam"}, "frames": 20, "constraints": [
        {"frame": 10, "nodes": [77777], "displacement": {"x": 1}}, {"frame": 10, "nodes": []},
        {"frame": 500, "nodes": [9], "displacement": {"x": 1}}]},
     ["constraints[0].nodes[0]", "constraints[1].nodes", "constraints[1].target", "constraints[2].frame"]),
    ({"mesh": {"path": "nope.msh"}, "frames": 2, "material": {"density": -1}},
     ["frames", "material.density", "mesh.path"]),
    ({"mesh": {"sample": "beam"}, "frames": 20,
      "material_groups": [{"tets": [0, 99999]}, {"tets": [0], "material": {"youngs_modulus": -1}}]},
     ["material_groups[0].tets[1]", "material_groups[1].material.youngs_modulus", "material_groups[1].tets[0]"]),
    ({"mesh": {"sample": "beam"}, "frames": 20, "dynamics": {"period_frames": 1e300, "frames_per_second": 1e-300}},
     ["dynamics.frames_per_second", "dynamics.period_frames"]),
    ({"mesh": {"sample": "beam"}, "frames": 100000, "model": {"modes": 500, "basis_size": 100000}}, ["scene"])],
    ids=["constraints", "no mesh", "groups", "dynamics", "memory"])
def test_validate_lists_everything(cli, server, tmp_path, scene, fields):
    file = write(tmp_path / "s.json", json.dumps(scene))
    process = cli("validate", file)
    assert process.returncode == 1
    complaints = [line for line in process.stdout.splitlines() if not line.startswith("warning: ")]
    assert sorted(re.match(r"error: ([^ ]*): ", line).group(1) for line in complaints) == fields, process.stdout


def test_tetrahedralize(cli, tmp_path):
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    rings = [(r * np.cos(angle), r * np.sin(angle), np.full(24, z)) for z, r in zip(np.linspace(-0.9, 0.9, 9),
                                                                                   np.sqrt(1 - np.linspace(-0.9, 0.9, 9) ** 2))]
    points = np.concatenate([np.column_stack(ring) for ring in rings] + [[[0, 0, -1], [0, 0, 1]]])
    faces = []
    for ring in range(8):
        for i in range(24):
            a, b = 24 * ring + i, 24 * ring + (i + 1) % 24
            faces += [[a, b, b + 24], [a, b + 24, a + 24]]
    faces += [[216, (i + 1) % 24, i] for i in range(24)] + [[217, 192 + i, 192 + (i + 1) % 24] for i in range(24)]
    with open(tmp_path / "ball.obj", "w") as out:
        out.writelines(f"v {x} {y} {z}\n" for x, y, z in points)
        out.writelines("f {} {} {}\n".format(*(np.array(face) + 1)) for face in faces)
    done(cli("tetrahedralize", tmp_path / "ball.obj", "-o", tmp_path / "ball.msh", "--tets", 1500))
    report = json.loads(done(cli("--json", "tetrahedralize", tmp_path / "ball.obj", "-o", tmp_path / "ball.msh", "--tets", 1500)))
    assert 0 < report["distance_share"] < 0.02 == report["within"] and report["share_beyond"] == 0
    assert report["mesh_volume"] == pytest.approx(report["surface_volume"], rel=0.1)
    text = failed(cli("tetrahedralize", tmp_path / "ball.obj", "-o", tmp_path / "x.msh", "--tets", 100, "--within", 0.01), 1)
    assert re.search(r"100 tets come within .* not 1 %. About \d+ tets keep it", text), text
    mesh = meshio.read(tmp_path / "ball.msh")
    tets = mesh.cells_dict["tetra"]
    edges = mesh.points[tets[:, 1:]] - mesh.points[tets[:, :1]]
    volumes = np.linalg.det(edges) / 6
    assert 500 < len(tets) < 4500 and (volumes > 0).all()
    assert volumes.sum() == pytest.approx(4.0, rel=0.1)  # of this polyhedron
    for surface, out in (("garbage", "x.msh"), ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "x.msh"), ("", "x.foo")):
        text = failed(cli("tetrahedralize", write(tmp_path / "bad.obj", surface), "-o", tmp_path / out), 1)
        assert "limberd" not in text and re.search("^limber: ", text, re.MULTILINE), "the program that was called"


def test_sample_files_can_be_opened(cli, tmp_path):
    assert set(done(cli("sample")).split()) >= {"beam", "flower", "bird", "dino"}
    path = done(cli("sample", "beam", "--out", tmp_path)).strip()
    assert "can be opened" in done(cli("validate", path))
    assert "unicorn" in failed(cli("sample", "unicorn"), 1)


def test_start_and_stop(cli, limberd, tmp_path):
    endpoint = f"ipc://{tmp_path}/r"
    environment = {"endpoint": endpoint}
    started = done(cli("start", "--log", tmp_path / "log", "--", "--no-cache", **environment))
    try:
        assert "started" in started
        assert "already runs" in done(cli("start", **environment))
        info = json.loads(done(cli("info", "--json", **environment)))
        assert info["protocol_versions"] == [1] and info["limits"]["frames"] > 0
        assert "protocol 1" in done(cli("info", **environment))
    finally:
        assert "stopped" in done(cli("stop", **environment))
    assert failed(cli("info", "--timeout", 0.2, **environment), 3)
    message = failed(cli("start", "--log", tmp_path / "log", "--", "--no-such-option", **environment), 1)
    assert "did not start" in message and "no-such-option" in message


def test_start_hands_over_where_the_stream_is(cli, limberd, tmp_path):
    environment = {"endpoint": f"ipc://{tmp_path}/r"}
    log = ("--log", tmp_path / "log")
    done(cli("start", *log, "--", f"--stream=ipc://{tmp_path}/elsewhere", "--no-cache", **environment))
    try:
        assert f"ipc://{tmp_path}/elsewhere" in done(cli("info", **environment))
    finally:
        done(cli("stop", **environment))
    for twice in (("--stream", f"ipc://{tmp_path}/a", *log, "--", "--stream", f"ipc://{tmp_path}/b"),
                  (*log, "--", "--bind", f"ipc://{tmp_path}/c")):
        assert "--stream" in (message := failed(cli("start", *twice, **environment), 1)) or "--endpoint" in message


def test_progress_bar_on_a_terminal_and_lines_elsewhere(cli, launch):
    server = launch("--no-cache")
    endpoint = server.connection.endpoint
    plain = cli("open", "--sample", "beam", "--session", "lines", endpoint=endpoint)
    done(plain)
    assert "%" in plain.stderr and "\r" not in plain.stderr
    main, follower = pty.openpty()
    process = subprocess.Popen([str(find_binary("limber")), "--endpoint", endpoint, "open", "--sample", "beam"],
                               stderr=follower, stdout=subprocess.DEVNULL)
    os.close(follower)
    seen = read_terminal(main, lambda text: False)
    assert process.wait(10) == 0
    assert "\r" in seen and "###" in seen and "100 %" in seen


def test_tetrahedralize_shows_a_bar_and_warns_once(cli, tmp_path):
    write(tmp_path / "box.obj", "".join(f"v {x} {y} {z}\n" for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
          + "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n")
    arguments = ["tetrahedralize", str(tmp_path / "box.obj"), "-o", str(tmp_path / "box.msh"), "--tets", "600"]
    main, follower = pty.openpty()
    process = subprocess.Popen([str(find_binary("limber")), *arguments], stderr=follower, stdout=subprocess.DEVNULL)
    os.close(follower)
    seen = read_terminal(main, lambda text: False)
    assert process.wait(10) == 0
    assert "\r" in seen and "###" in seen and "100 %" in seen
    plain = cli(*arguments)
    done(plain)
    assert "\r" not in plain.stderr and plain.stderr.count("polygons are cut") == 1


def read_terminal(descriptor, enough, timeout=50):
    """What a process writes to a pseudo terminal, until it ends or enough has come."""
    seen, end = "", time.monotonic() + timeout
    while time.monotonic() < end and not enough(seen):
        if not select.select([descriptor], [], [], 0.2)[0]:
            continue
        try:
            data = os.read(descriptor, 4096)
        except OSError:
            break
        if not data:
            break
        seen += data.decode()
    return seen


def test_ctrl_c_while_opening_closes_the_session(launch):
    server = launch("--no-cache")
    process = subprocess.Popen([str(find_binary("limber")), "--endpoint", server.connection.endpoint, "open", "--sample",
                                "flower", "--session", "gone"], stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 20
    while not any(s.session == "gone" for s in server.sessions()) and time.monotonic() < deadline:
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, message = process.communicate(timeout=30)
    assert process.returncode == 130 and "session gone is closed" in message
    assert server.sessions() == []


def test_cancel(cli, launch):
    server = launch("--no-cache")
    endpoint = server.connection.endpoint
    done(cli("open", "--sample", "flower", "--session", "c", "--no-wait", endpoint=endpoint))
    done(cli("cancel", "c", endpoint=endpoint))
    with pytest.raises(limber.LimberError) as caught:
        server.session("c").wait(timeout=30)
    assert caught.value.code in ("CANCELLED", "FAILED_PRECONDITION")


def test_a_material_beside_a_mesh_file_that_brings_its_own_warns(cli, tmp_path):
    message = ("the scene's material (youngs_modulus 500000 Pa) is ignored: "
               "the mesh file brings its own (youngs_modulus 7e+06 Pa)")
    scene = tmp_path / "scene.json"
    for material, is_reported in scenes_beside_a_material_file(scene):
        text = cli("validate", scene).stdout
        assert (message in text) == is_reported, text
        assert "0 cells" not in text


def test_python_warns_of_a_material_beside_a_mesh_file_that_brings_its_own(server, tmp_path):
    scene = tmp_path / "scene.json"
    for material, is_reported in scenes_beside_a_material_file(scene):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", limber.MaterialWarning)
            server.open(scene, wait=False).close()
        reported = [w for w in caught if w.category is limber.MaterialWarning]
        assert len(reported) == is_reported, (material, reported)
        for warning in reported:
            assert "youngs_modulus 500000 Pa) is ignored" in str(warning.message)
            assert warning.filename == __file__  # names the line that opened the scene


def scenes_beside_a_material_file(scene):
    """Writes to `scene` one after the other; yields each one's material and whether it has no effect."""
    folder = scene.parent
    (folder / "a.mesh").write_text("MeshVersionFormatted 2\nDimension 3\nVertices\n4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n"
                                  "Triangles\n0\nTetrahedra\n1\n1 2 3 4 0\nEnd\n")
    (folder / "a.elastic").write_text("*MATERIAL, NAME=A\n*ELASTIC\n7e+06, 0.45\n*DENSITY 100")
    for material, is_reported in (({"youngs_modulus": 5e5}, True), ({}, False),
                              ({"youngs_modulus": 7e6, "poissons_ratio": 0.45, "density": 100}, False)):
        scene.write_text(json.dumps({"mesh": {"path": "a.mesh"}, "frames": 20, "material": material,
                                     "model": {"modes": 5}}))
        yield material, is_reported
