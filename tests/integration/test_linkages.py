"""Rod linkages through the Python package and a real limberd."""

import os
import signal
import subprocess
import sys
import time
import warnings

import limber
import numpy as np
import pytest
from conftest import ROOT, small_scene
from limber.launching import find_binary
from limber.v1 import scene_pb2 as scenes
from limber.v1 import service_pb2 as service
from linkage_inputs import RECTANGLE, grid, linkage, strip  # noqa: F401
from refusals import refusal


def test_samples_are_listed_beside_the_bodies(server):
    assert {"beam", "flower", "grid", "hyperboloid", "dome"} <= set(server.samples())
    for name in ("grid", "hyperboloid", "dome"):
        scene = server.sample(name)
        assert scene.linkage.lines.sample == name and not scene.HasField("mesh")
        assert server.validate(scene) == []


def test_deploy_and_push_while_another_client_watches(server, linkage):
    with limber.connect(server.connection.endpoint) as second:
        watched = second.session(linkage.id)
        assert isinstance(watched, limber.LinkageSession)
        with watched.stream(timeout=20) as stream:
            first = next(stream)
            assert first.result.revision == 0
            linkage.deploy(50)
            deployed = linkage.wait()
            assert deployed.converged and deployed.status == "CONVERGED" and not deployed.solve_failed
            assert deployed.mean_angle == pytest.approx(50, abs=1e-6)
            seen = next(frames for frames in stream if frames.result.revision == 1 and frames.result.final)
            assert seen.result == deployed
            path = seen.positions
            assert path.shape == (deployed.steps, watched.geometry().nodes, 3) and deployed.steps > 10
            np.testing.assert_array_equal(path, linkage.frames())

            joint = int(np.argmax(linkage.shape().joints[:, 2]))
            at = linkage.shape().joints[joint]
            target = linkage.attach(joint, position=at + (0, 0, 0.2), stiffness=1e5)
            pushed = linkage.wait()
            assert pushed.spring_energy >= 0 and pushed.mean_angle == pytest.approx(50, abs=1e-6)
            seen = next(frames for frames in stream if frames.result.revision == 2 and frames.result.final)
            assert seen.result == pushed and seen.missed == 0
            moved = watched.shape().joints[joint]
            np.testing.assert_allclose(moved, at + (0, 0, 0.2), atol=1e-3)
            target.remove()
            assert linkage.wait().energy == pytest.approx(deployed.energy, rel=1e-6)


def test_pins_loads_and_undo(linkage):
    linkage.deploy(40)
    before = linkage.wait()
    shape = linkage.shape()
    low, high = int(np.argmin(shape.joints[:, 2])), int(np.argmax(shape.joints[:, 2]))
    linkage.pin(low, "motion")
    linkage.load(high, force=(0, 0, -20))
    loaded = linkage.wait()
    assert loaded.converged and not loaded.solve_failed and loaded.load_potential != 0
    now = linkage.shape()
    np.testing.assert_allclose(now.joints[low], shape.joints[low], atol=1e-5)
    assert now.joints[high][2] < shape.joints[high][2] - 1e-4, "the load pushes its joint down"
    linkage.undo()
    assert linkage.wait().energy == pytest.approx(before.energy, rel=1e-5)
    linkage.redo()
    assert linkage.wait().energy == pytest.approx(loaded.energy, rel=1e-5)
    conditions = linkage.conditions()
    assert [pin.joint for pin in conditions.pins] == [low] and [load.joint for load in conditions.loads] == [high]
    linkage.release(low)
    assert not linkage.conditions().pins


def test_encodings_and_shapes_agree(linkage):
    linkage.deploy(30)
    linkage.wait()
    geometry, status = linkage.geometry(), linkage.status()
    assert (status.segments, status.joints) == (len(geometry.edges), len(geometry.vertex_of_joint)) == (144, 84)
    by_coordinates = linkage.frames(final=True)
    by_positions = linkage.frames(final=True, encoding="positions")
    np.testing.assert_allclose(by_coordinates, by_positions, atol=1e-5)
    raw = linkage.raw_frames(final=True, encoding="quantised")
    assert 0 < raw.quantisation_error < 1e-3
    assert np.abs(linkage.frames(final=True, encoding="quantised") - by_positions).max() <= 1.01 * raw.quantisation_error
    shape = linkage.shape()
    assert shape.angles.mean() == pytest.approx(30, abs=1e-3)
    assert np.isfinite(shape.joints).all() and geometry.surface.max() < geometry.nodes
    for line, directors in zip(shape.centrelines, shape.directors):
        edges = np.diff(line, axis=0)
        np.testing.assert_allclose(np.linalg.norm(directors, axis=1), 1, atol=1e-5)
        assert np.abs((edges * directors).sum(axis=1)).max() < 1e-5
    # The two rods of a joint meet in it.
    for segment, ends in enumerate(geometry.joints_of_segment):
        for joint, (a, b) in zip(ends, ((0, 1), (-1, -2))):
            line = shape.centrelines[segment]
            np.testing.assert_allclose((line[a] + line[b]) / 2, shape.joints[joint], atol=1e-5)


def test_a_scene_of_arrays_and_of_an_obj_file(server, tmp_path):
    points, edges = grid()
    path = tmp_path / "grid.obj"
    path.write_text("".join(f"v {x} {y} {z}\n" for x, y, z in points) +
                    "".join(f"l {a + 1} {b + 1}\n" for a, b in edges))
    angles = []
    for scene in (limber.linkage_scene(points, edges, section=RECTANGLE, edges_per_segment=6),
                  limber.linkage_scene(path, section=RECTANGLE, edges_per_segment=6)):
        session = server.open(scene, progress=False)
        session.set_angle(4, 70)
        assert session.wait().converged
        angles.append(session.shape().angles)
        assert angles[-1][4] == pytest.approx(70, abs=1e-3)
        assert session.geometry().edges == (6,) * len(edges)
        session.close()
    np.testing.assert_array_equal(*angles)


def test_lines_that_touch_without_a_joint_are_reported(server, cli, tmp_path):
    (tmp_path / "cross.obj").write_text("v -1 0 0\nv 1 0 0\nv 0 -1 0\nv 0 1 0\nl 1 2\nl 3 4\n")
    scene = limber.linkage_scene(str(tmp_path / "cross.obj"), section=RECTANGLE)
    message = ("edges 0 and 1 cross without a vertex (from 0), at (0, 0, 0) m: nothing joins them there")
    assert [issue.split(": ", 2)[::2] for issue in server.validate(scene)] == [["warning", message]]
    opened = server.open(scene, progress=False)
    assert [issue.split(": ", 2)[::2] for issue in opened.issues] == [["warning", message]]
    opened.close()
    file = tmp_path / "cross.json"
    file.write_text('{"linkage": {"lines": {"path": "cross.obj"}, "section": {"ellipse": {"width": 0.1, "height": 0.1}}}}')
    process = cli("open", file, "--session", "cross")
    assert process.returncode == 0 and "warning: scene.linkage.lines.file: " + message in process.stderr
    process = cli("validate", file)
    assert process.returncode == 0 and "warning: linkage.lines.path: " + message in process.stdout
    server.session("cross").close()
    vertices, edges = grid()
    assert server.validate(limber.linkage_scene(vertices, edges, section=RECTANGLE)) == []


def test_a_client_that_dies_in_the_middle_leaves_the_session_alive(server, linkage):
    script = ("import limber, os, sys\n"
              f"linkage = limber.connect({server.connection.endpoint!r}).session({linkage.id!r})\n"
              "stream = linkage.stream()\nnext(stream)\nlinkage.deploy(60)\nprint('sent', flush=True)\n"
              "import time\ntime.sleep(60)\n")
    child = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "sent\n"
    os.kill(child.pid, signal.SIGKILL)
    child.wait()
    child.stdout.close()
    result = linkage.wait(1)
    assert result.converged and result.mean_angle == pytest.approx(60, abs=1e-6)
    linkage.deploy(20)
    assert linkage.wait().mean_angle == pytest.approx(20, abs=1e-6)


def spoiled(change):
    points, edges = grid()
    points, edges = change(points, edges.copy()) or (points, edges)
    return limber.linkage_scene(points, edges, section=RECTANGLE)


def with_edge(edges, i, edge):
    edges[i] = edge
    return edges


@pytest.mark.parametrize("change, code, field", [
    (lambda p, e: (p, with_edge(e, 3, (3, 99))), "OUT_OF_RANGE", "scene.linkage.lines.arrays.edges[3]"),
    (lambda p, e: (p, with_edge(e, 3, e[1][::-1])), "INVALID_ARGUMENT", "scene.linkage.lines.arrays.edges[3]"),
    (lambda p, e: (p, with_edge(e, 2, (4, 4))), "INVALID_ARGUMENT", "scene.linkage.lines.arrays.edges[2]"),
    (lambda p, e: (p, np.vstack([e, [(0, 4)]])), "INVALID_ARGUMENT", "scene.linkage.lines.arrays.vertices[4]"),
], ids=["edge out of range", "duplicate edge", "edge without length", "valence above 4"])
def test_bad_lines_name_the_edge_or_vertex(server, change, code, field):
    scene = spoiled(change)
    assert refusal(lambda: server.open(scene, progress=False)) == (code, field)
    assert any(field in issue for issue in server.validate(scene))


def test_bad_scenes_name_their_field(server):
    points, edges = grid()
    scene = limber.linkage_scene(points, edges, section={"tube": {"diameter": 0.02, "wall_thickness": -1}})
    assert refusal(lambda: server.open(scene)) == ("INVALID_ARGUMENT", "scene.linkage.section.tube.wall_thickness")
    scene = limber.linkage_scene(points, edges, section=RECTANGLE)
    scene.mesh.sample = "beam"
    assert refusal(lambda: server.open(scene)) == ("INVALID_ARGUMENT", "scene.mesh")
    scene = limber.linkage_scene(points, edges, section=RECTANGLE)
    scene.frames = 30
    assert refusal(lambda: server.open(scene)) == ("INVALID_ARGUMENT", "scene.frames")
    scene = limber.linkage_scene(points, edges, section=RECTANGLE)
    scene.linkage.conditions.pins.add(joint=400)
    assert refusal(lambda: server.open(scene)) == ("OUT_OF_RANGE", "scene.linkage.conditions.pins[0].joint")
    for kind, request in (("simulate", service.SimulateRequest), ("recover", service.RecoverRequest)):
        assert refusal(lambda: server.connection.call(kind, request(scene=scene))) == (
            "INVALID_ARGUMENT", "scene.linkage")
    assert not server.sessions(), "nothing of them is left"


def test_bad_edits_name_their_field_and_change_nothing(linkage):
    linkage.deploy(30)
    good = linkage.wait(until="checked")
    shape = linkage.shape()
    assert refusal(lambda: linkage.pin(84)) == ("OUT_OF_RANGE", "edits[0].pin_joint.pin.joint")
    assert refusal(lambda: linkage.deploy(180)) == ("OUT_OF_RANGE", "edits[0].set_mean_angle.angle_degrees")
    assert refusal(lambda: linkage.set_angle(3, -200)) == ("OUT_OF_RANGE", "edits[0].set_joint_angle.angle_degrees")
    assert refusal(lambda: linkage.attach(segment=144, position=(0, 0, 0))) == (
        "OUT_OF_RANGE", "edits[0].add_target.target.segment.segment")
    assert refusal(lambda: linkage.attach(3, position=(0, 0, 0), stiffness=0)) == (
        "INVALID_ARGUMENT", "edits[0].add_target.target.stiffness")
    assert refusal(lambda: linkage.attach(3, position=(0, 0, 1e9))) == (
        "OUT_OF_RANGE", "edits[0].add_target.target.position")
    assert refusal(lambda: linkage.pin(3, position=(0, 0, 1e9))) == ("OUT_OF_RANGE", "edits[0].pin_joint.pin.position")
    assert refusal(lambda: linkage.move(7, (0, 0, 0))) == ("NOT_FOUND", "edits[0].move_target.id")
    pin = scenes.JointPin(joint=3, held=scenes.HELD_ANGLE)
    contradiction = [service.Edit(pin_joint=service.PinJoint(pin=pin)),
                     service.Edit(set_joint_angle=service.SetJointAngle(joint=3, angle_degrees=10))]
    assert refusal(lambda: linkage.edit(contradiction)) == ("INVALID_ARGUMENT", "edits[1].set_joint_angle.joint")
    assert refusal(lambda: linkage.edit([limber.add(node=1, frame=1, displacement=(0, 0, 0))])) == (
        "INVALID_ARGUMENT", "edits[0].add")
    assert linkage.status().revision == 1 and linkage.status().result.sequence == good.sequence
    np.testing.assert_array_equal(linkage.shape().joints, shape.joints)


def test_releases_of_what_is_not_held_are_reported(linkage, cli):
    assert linkage.deploy(None).issues == ()  # the sample has a mean angle
    calls = (lambda: linkage.release(3), lambda: linkage.set_angle(3, None), lambda: linkage.deploy(None),
             lambda: linkage.load(3))
    issues_of_calls = [call().issues for call in calls]
    assert [len(issues) for issues in issues_of_calls] == [1, 1, 1, 1]
    for issues, start in zip(issues_of_calls, ("pin_joint.pin.joint: joint 3 is not pinned",
                                    "set_joint_angle.joint: the angle of joint 3 is not set",
                                    "set_mean_angle.angle_degrees: the mean angle is not set",
                                    "set_joint_load.load.joint: joint 3 carries no load")):
        assert issues[0].startswith("warning: edits[0]." + start)
    assert linkage.pin(3).issues == linkage.release(3).issues == ()
    command = cli("pin", linkage.id, 3, "--held", "nothing")
    assert command.returncode == 0 and "joint 3 is not pinned" in command.stderr


def test_what_has_no_equilibrium_keeps_the_last_good_shape(linkage):
    linkage.deploy(30)
    good = linkage.wait()
    joints = linkage.shape().joints
    linkage.load(0, force=(0, 0, 5))  # nothing holds it
    lost = linkage.wait()
    assert lost.final and not lost.converged and lost.solve_failed and lost.message
    np.testing.assert_allclose(linkage.shape().joints, joints, atol=1e-6)
    linkage.undo()
    assert linkage.wait().energy == pytest.approx(good.energy, rel=1e-6)


def test_what_only_bodies_or_only_linkages_have_is_refused(server, linkage):
    call = server.connection.call
    assert refusal(lambda: call("get_material", service.GetMaterialRequest(session=linkage.id))) == (
        "FAILED_PRECONDITION", "session")
    assert refusal(lambda: call("solve_cold", service.SolveColdRequest(session=linkage.id))) == (
        "FAILED_PRECONDITION", "session")
    export = service.ExportRequest(session=linkage.id, format=service.EXPORT_FORMAT_PC2)
    assert refusal(lambda: call("export", export)) == ("INVALID_ARGUMENT", "format")
    body = server.open(small_scene(), progress=False)
    edit = service.Edit(set_mean_angle=service.SetMeanAngle(angle_degrees=10))
    assert refusal(lambda: body.edit([edit])) == ("INVALID_ARGUMENT", "edits[0].set_mean_angle")
    listed = {status.session: status.segments for status in server.sessions()}
    assert listed == {linkage.id: 144, body.id: 0}
    body.close()


def test_cancel_and_close_while_it_deploys(server, linkage):
    linkage.deploy(70)
    linkage.cancel()
    linkage.deploy(25)
    assert linkage.wait().mean_angle == pytest.approx(25, abs=1e-6)
    linkage.deploy(70)
    with linkage.stream() as stream:
        linkage.close()
        deadline = time.monotonic() + 10
        for _ in stream:
            assert time.monotonic() < deadline
    assert refusal(linkage.status) == ("NOT_FOUND", "session")


def test_commands(cli, server, tmp_path):
    def done(*arguments):
        process = cli(*arguments)
        assert process.returncode == 0, process.stderr
        return process.stdout

    assert "hyperboloid" in done("sample").split()
    for nothing in (cli("open"), cli("open", "hyperbola")):
        assert nothing.returncode in (1, 2) and "grid, hyperboloid, dome" in nothing.stderr
    path = done("sample", "grid", "--out", tmp_path).strip()
    assert "error" not in done("validate", path)
    assert " joints, ready" in done("open", path, "--session", "g")
    assert done("deploy", "g", "--angle", 40).startswith("revision 1")
    assert "mean angle        40.000 degrees" in done("wait", "g")
    assert done("pin", "g", 3, "--held", "motion").startswith("revision 2")
    assert "target 1" in done("attach", "g", "--segment", 2, "--position", 0, 0, 1)
    assert "target 1" in done("attach", "g", "--move", 1, "--position", 0, 0, 0.5)
    assert done("deploy", "g", "--joint", 4, "--free").startswith("revision 5")
    assert "1 targets, revision 5" in done("show", "g")
    done("wait", "g")
    done("frames", "g", "--out", tmp_path / "g.npy", "--final")
    motion = np.load(tmp_path / "g.npy")
    assert motion.shape[1:] == (144 * 11 * 4, 3) and np.isfinite(motion).all()
    listed = done("list")
    assert "144 segments, " in listed and "1 targets" in listed and "mean angle" in listed
    watched = done("watch", "g", "--count", 1).splitlines()
    at = watched[0].index("mean angle")  # numbers are below the end of their heading
    end = at + len("mean angle [deg]")
    assert float(watched[1][:end].split()[-1]) == pytest.approx(server.session("g").wait().mean_angle, abs=0.01)
    assert " files in " in done("export", "g", "--format", "vtp", "obj", "json", "scene", "--out", tmp_path / "files")
    assert len(list((tmp_path / "files").glob("motion_*.vtp"))) == len(motion)
    assert "error" not in done("validate", tmp_path / "files" / "motion.json")
    process = cli("export", "g", "--format", "pvd", "--out", tmp_path)
    assert process.returncode == 1 and "format" in process.stderr and "VTP" in process.stderr
    assert done("attach", "g", "--remove", 1).startswith("revision 6")
    assert "0 targets, revision 6" in done("show", "g")
    process = cli("attach", "g", "--remove", 1)
    assert process.returncode == 1 and "remove_target" in process.stderr, "it is gone already"
    for astray in (("--joint", 3), ("--remove", 1, "--position", 0, 0, 1), ("--remove", 1, "--joint", 2)):
        assert cli("attach", "g", *astray).returncode == 2
    process = cli("pin", "g", 9999)
    assert process.returncode == 1 and "edits[0].pin_joint.pin.joint" in process.stderr
    server.session("g").close()

    (tmp_path / "cross.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nl 1 2\nl 2 3\nl 2 1\n")
    scene = tmp_path / "bad.json"
    scene.write_text('{"linkage": {"lines": {"path": "cross.obj"}, "section": {"ellipse": {"width": 1, "height": 1}}}}')
    process = cli("validate", scene)
    assert process.returncode == 1 and "linkage.lines.path: " in process.stdout
    process = cli("open", scene)
    assert process.returncode == 1 and "scene.linkage.lines.file" in process.stderr


def test_joints_are_loaded_by_a_command(cli, server, linkage):
    def loads():
        return [(load.joint, [load.force.x, load.force.y, load.force.z],
                 [load.moment.x, load.moment.y, load.moment.z], load.torque) for load in linkage.conditions().loads]

    run = [linkage.id, "--joint", 5]
    assert cli("load", *run, "--force", 0, 0, -0.5, "--torque", 0.02).stdout.startswith("revision 1")
    assert loads() == [(5, [0, 0, -0.5], [0, 0, 0], 0.02)]
    assert cli("load", *run, "--moment", 0, 0.01, 0, "--torque", "-.01").returncode == 0
    assert loads() == [(5, [0, 0, 0], [0, 0.01, 0], -0.01)]
    assert cli("load", *run).returncode == 0 and loads() == []
    beyond = cli("load", linkage.id, "--joint", 84, "--torque", 1)
    assert beyond.returncode == 1 and "edits[0].set_joint_load.load.joint" in beyond.stderr
    for wrong in (["--node", 3, "--torque", 1], [*run[1:], "--follows"], [*run[1:], "--node", 3], ["--torque", 1]):
        assert cli("load", linkage.id, *wrong).returncode == 2
    kind = cli("load", linkage.id, "--node", 3, "--force", 0, 0, 1)
    assert kind.returncode == 1 and "rod linkages" in kind.stderr
    explained = cli("load", "--help").stdout
    assert "--joint" in explained and "N m, opens the joint" in explained


def test_the_example_runs(limberd):
    done = subprocess.run([sys.executable, ROOT / "examples" / "push_hyperboloid.py"], capture_output=True, text=True,
                          timeout=50)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0].startswith("deployed: 50.0 degrees in ") and len(lines) == 4
    pushes = [float(line.split()[2]) for line in lines[1:]]
    assert 0 < pushes[0] < pushes[1] < pushes[2]


def test_the_cpp_example_runs(cli, server):
    program = find_binary("push_hyperboloid")
    done = subprocess.run([program, server.connection.endpoint], capture_output=True, text=True, timeout=50)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0].startswith("deployed: 50.0 degrees in ") and len(lines) == 4
    # The same as its Python sibling, here with a server that runs.
    python = subprocess.run([sys.executable, ROOT / "examples" / "push_hyperboloid.py"], capture_output=True, text=True,
                            timeout=50)
    for line, other in zip(lines[1:], python.stdout.splitlines()[1:], strict=True):
        ours, theirs = ([float(line.split()[i]) for i in (2, -2)] for line in (line, other))
        assert ours == pytest.approx(theirs, rel=2e-3), done.stdout + python.stdout
    assert not server.sessions()
    done = subprocess.run([program], capture_output=True, text=True, timeout=50,
                          env={**os.environ, "LIMBER_ENDPOINT": "tcp://127.0.0.1:9"})
    assert done.returncode == 1, "it asks where $LIMBER_ENDPOINT says"
    assert done.stderr.startswith("push_hyperboloid: no limberd answers at tcp://127.0.0.1:9"), done.stderr
    done = subprocess.run([program, "nonsense"], capture_output=True, text=True, timeout=50)
    assert done.returncode == 1 and "cannot connect to 'nonsense'" in done.stderr


def test_what_blocked_lengths_can_be_removed(server):
    rods = 5
    points = [(i, j, 0) for i in range(rods) for j in range(rods)]
    edges = ([(i * rods + j, (i + 1) * rods + j) for i in range(rods - 1) for j in range(rods)] +
             [(i * rods + j, i * rods + j + 1) for i in range(rods) for j in range(rods - 1)])
    grid = server.open(limber.linkage_scene(points, edges, section={"rectangle": (0.05, 0.01)}), progress=False)
    corners = (0, rods - 1, rods * (rods - 1), rods * rods - 1)
    for corner in corners:
        grid.pin(corner, "motion")
    grid.set_lengths(np.full(len(edges), 1.05))
    # Whether the grid stays in its plane, where no step leads on, or buckles out of it, is up to the last digits.
    stuck = grid.wait(timeout=60)
    assert "while rod sizes changed to the requested ones" in stuck.message if stuck.solve_failed else stuck.energy > 1
    for corner in corners:
        grid.release(corner)
    free = grid.wait(timeout=60)
    assert not free.solve_failed, free.message
    assert free.energy < 1e-9
    np.testing.assert_array_equal(grid.lengths(), np.full(len(edges), 1.05))
    assert np.linalg.norm(grid.shape().joints[0] - grid.shape().joints[1]) == pytest.approx(1.05, rel=1e-3)
    grid.close()


def test_a_wrecked_shape_recovers_without_its_load(server):
    scene = server.sample("dome")
    scene.linkage.edges_per_segment = 3
    dome = server.open(scene, progress=False)
    dome.deploy(60)
    dome.pin(40, "both")
    sound = dome.wait()
    dome.load(5, force=(0, 0, -1e9))
    assert dome.wait(timeout=120).solve_failed
    dome.load(5)
    back = dome.wait(timeout=120)
    assert not back.solve_failed, back.message
    assert back.energy == pytest.approx(sound.energy, rel=1e-6)
    dome.close()


def test_a_strip_that_snaps_through_warns_and_says_where(server):
    """Clamped at both ends and pushed together it is an arch, which a load through its middle turns over."""
    arch = server.open(strip(), progress=False)
    for joint in (0, 1):
        arch.pin(joint, "both")
    arch.load(2, force=(0, 0, 1))
    arch.wait()
    with warnings.catch_warnings():
        warnings.simplefilter("error", limber.SnapWarning)
        arch.pin(1, "both", position=(0.98, 0, 0))
        arch.load(2)
        above = arch.wait()
        height = arch.shape().joints[2, 2]
        assert above.converged and not above.snaps and height > 0.05
        arch.load(2, force=(0, 0, -10))
        assert not arch.wait().snaps and arch.shape().joints[2] == pytest.approx((0.49, 0, height), abs=1e-3)
    arch.load(2, force=(0, 0, -60))
    with pytest.warns(limber.SnapWarning, match="snapped to another shape at .* % of the path, near a mean angle of") as warned:
        result = arch.wait()
    assert [warning.filename for warning in warned] == [__file__], "it points at the line that waited"
    assert result.converged and arch.shape().joints[2, 2] < -0.05, "the mirror image"
    snap, = result.snaps
    assert snap in result.events and snap.event in ("limit_point", "jump") and 0 < snap.progress < 1
    assert result.message.count("snapped") + result.message.count("jumped") == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error", limber.SnapWarning)
        assert arch.wait().snaps, "it is told once"
        arch.load(2)
        assert not arch.wait().snaps and arch.shape().joints[2, 2] == pytest.approx(-height, rel=1e-6)
    arch.close()
