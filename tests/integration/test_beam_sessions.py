"""Structures of beams that are edited live, over real sockets."""

import json
import os
import pathlib
import signal
import subprocess
import sys
import time
import warnings

import limber
import numpy as np
import pytest
from conftest import small_scene
from limber import beam_edits
from refusals import refusal
from test_beams import CLAMPED, cantilever, job_folder, vtu_array


def opened(server, structure, **options):
    return server.open(limber.beam_scene(structure), progress=False, **options)


@pytest.fixture
def arm(server):
    """The cantilever of 1 m under 1 N, in equilibrium."""
    session = opened(server, cantilever())
    yield session
    try:
        session.close()
    except limber.LimberError as error:
        assert error.code == "NOT_FOUND"


def tip(session):
    return session.frames()[-1][-1]


def test_samples_are_listed_and_bend(server):
    assert {"arch", "gridshell"} <= set(server.samples())
    for name, lowest, highest in (("arch", 0.9, 1.3), ("gridshell", 0.8, 2.0)):
        scene = server.sample(name)
        assert server.validate(scene) == []
        with_name = server.open(sample=name, progress=False)
        assert isinstance(with_name, limber.BeamSession)
        result = with_name.wait()
        assert result.status == "CONVERGED" and not result.solve_failed, result.message
        assert lowest < with_name.frames()[-1][:, 2].max() < highest
        assert 0.01 < result.utilisation < 1
        with_name.close()


def test_edits_settle_from_the_shape_there_is(arm):
    assert abs(tip(arm)[2] + 0.30172) < 1e-4
    arm.load(20, force=(0, 0, -10))
    result = arm.wait()
    assert result.status == "CONVERGED" and result.method == "newton" and result.steps >= 3
    heights = arm.frames()[:, -1, 2]
    assert len(heights) == result.steps and np.all(np.diff(heights) < 0) and heights[0] < -0.3017
    assert abs(heights[-1] + 0.81061) < 1e-4
    arm.move_support(0, z=0.5)
    arm.wait()
    assert abs(tip(arm)[2] - 0.5 + 0.81061) < 1e-4
    arm.move_support(0, position=(0, 0, 0), rotation=(0, 0.3, 0))
    arm.wait()
    solution = arm.solution()
    fresh = arm.server.solve_beams(arm.structure(), progress=False)
    assert np.abs(solution.positions - fresh.positions).max() < 1e-6
    assert np.allclose(solution.reaction_forces[0], (0, 0, 10), atol=1e-5)
    assert np.allclose(arm.rotations()[-1][0], (np.cos(0.15), 0, np.sin(0.15), 0), atol=1e-6)


def test_hold_release_gravity_and_undo(arm):
    before = tip(arm)
    arm.hold(20)
    arm.wait()
    arm.load(20)
    arm.wait()
    assert np.abs(tip(arm) - before).max() < 1e-6, "what holds it holds it without its load, too"
    arm.release(20)
    arm.wait()
    assert abs(tip(arm)[2]) < 1e-6
    arm.undo()
    arm.wait()
    assert np.abs(tip(arm) - before).max() < 1e-6
    arm.redo()
    arm.gravity((0, 0, -9.81))  # without density, nothing
    arm.element_load(19, force=(0, 0, -4))
    result = arm.wait()
    assert result.status == "CONVERGED" and tip(arm)[2] < -0.01
    assert arm.structure().gravity.z == -9.81 and len(arm.structure().distributed_loads) == 1


def test_a_snap_is_reported(server):
    arch = {"nodes": [{"position": {"x": i / 16, "z": 0.05 * np.sin(np.pi * i / 16)}} for i in range(17)],
            "sections": [{"rectangle": {"width": 0.02, "height": 0.006}, "young": 1e9, "poisson": 0.3}],
            "elements": [{"start": i, "finish": i + 1} for i in range(16)],
            "supports": [{"node": 0, **CLAMPED}, {"node": 16, **CLAMPED}]}
    session = opened(server, arch)
    session.load(8, force=(0, 0, -0.5))
    assert session.wait().snaps == ()
    receipt = session.load(8, force=(0, 0, -12))
    with pytest.warns(limber.SnapWarning, match=rf"revision {receipt.revision}: the structure snapped .* of the path") as warned:
        result = session.wait()
    assert pathlib.Path(warned[0].filename) == pathlib.Path(__file__), "it points at the line that waited"
    assert result.status == "CONVERGED", result.message
    assert "snapped to another shape at" in result.message and str(result.snaps[0]) in str(warned[0].message)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert session.wait(until="checked").snaps == result.snaps, "said once of a result"
    assert len(result.snaps) == 1 and 0 < result.snaps[0].progress < 1 and 0 < result.snaps[0].node < 16
    assert session.frames()[-1][8, 2] < -0.03
    session.undo()
    session.wait()
    assert session.frames()[-1][8, 2] > 0.03
    session.close()


def test_pushes_choose_a_side(server):
    flat = cantilever(12, 0)
    flat["loads"] = []
    ends = {**CLAMPED, "fix_rotation_y": False}
    flat["supports"] = [{"node": 0, **ends}, {"node": 12, **ends}]
    session = opened(server, flat)
    for side in (1, -1):
        session.edit([beam_edits.push(6, (0, 0, side)), beam_edits.move(12, x=-0.1)])
        assert session.wait().status == "CONVERGED"
        assert side * session.frames()[-1][6, 2] > 0.15
        session.undo()
        session.wait()
        assert abs(session.frames()[-1][6, 2]) < 1e-6
    session.close()


@pytest.mark.parametrize("pushed", [1, 5, 10, 17])
def test_a_push_of_one_newton_at_one_node_chooses_the_side(server, pushed):
    """A hinged rod that buckles at 132 N, brought together by a tenth."""
    hinged = cantilever(20, 0)
    hinged["sections"][0]["young"] = 132 / np.pi ** 2 * 12e8
    hinged["loads"] = []
    ends = {**CLAMPED, "fix_rotation_y": False}
    hinged["supports"] = [{"node": 0, **ends}, {"node": 20, **ends}]
    session = opened(server, hinged)
    for side in (1, -1):
        session.edit([beam_edits.push(pushed, (0, 0, side)), beam_edits.move(20, x=-0.1)])
        assert session.wait().status == "CONVERGED"
        assert side * session.frames()[-1][10, 2] > 0.15
        session.undo()
        session.wait()
    session.close()
    hinged["motions"] = [{"node": 20, "x": -0.1}]
    del hinged["supports"][1]["fix_x"]
    for side in (1, -1):
        hinged["temporary_loads"] = [{"node": pushed, "force": {"z": side}}]
        answer = server.solve_beams(hinged, progress=False)
        assert answer.converged and side * answer.positions[10, 2] > 0.15


def test_an_exported_scene_opens_in_the_same_equilibrium(server, tmp_path):
    """Buckled up as drawn, then pushed down: the scene says up only."""
    rod = cantilever(12, 0)
    rod["loads"] = []
    rod["sections"][0]["rectangle"]["width"] = 0.02
    rod["supports"] = [{"node": 0, **CLAMPED}, {"node": 12, **CLAMPED, "fix_x": False}]
    rod["motions"] = [{"node": 12, "x": -0.1}]
    rod["temporary_loads"] = [{"node": i, "force": {"z": 1}} for i in range(1, 12)]
    session = opened(server, rod)
    assert session.frames()[-1][6, 2] > 0.1
    session.load(6, force=(0, 0, -200))
    assert session.wait().snaps
    session.load(6)
    session.wait()
    below = session.solution().positions
    assert below[6, 2] < -0.1
    exported = session.export(tmp_path, ("scene",), progress=False)
    assert [path.name for path in exported] == ["beams.json"] and exported.result is None
    again = server.open(tmp_path / "beams.json", progress=False)
    assert np.abs(again.solution().positions - below).max() < 1e-9
    assert again.wait().status == "CONVERGED"
    again.close()
    drawn = server.solve_beams(tmp_path / "beams.json", progress=False)
    assert drawn.status == "CONVERGED" and drawn.positions[6, 2] > 0.1, "its own temporary loads are still in the scene"
    scene = json.loads((tmp_path / "beams.json").read_text())
    del scene["beams"]["shape"]["rotations"]
    (tmp_path / "beams.json").write_text(json.dumps(scene))
    assert refusal(lambda: server.open(tmp_path / "beams.json"))[1].startswith("scene.beams.shape.rotations")
    session.close()


def test_supports_have_axes_of_their_own(server):
    """A beam along x that slides down a plane of 45 degrees at its far end."""
    structure = cantilever(10, 2)
    slope = {"node": 10, "fix_z": True, "x_axis": {"x": 1, "z": -1}, "y_axis": {"y": 1}}
    structure["supports"].append(slope)
    answer = server.solve_beams(structure, progress=False)
    moved = answer.positions[10] - (1, 0, 0)
    assert answer.converged and abs(moved[0] + moved[2]) < 1e-9 and np.abs(moved[[0, 2]]).max() > 1e-6
    reaction = answer.reaction_forces[10]
    assert abs(reaction[0] - reaction[2]) < 1e-6 and reaction[2] > 0.1, "across the plane"
    session = opened(server, structure)
    assert np.abs(session.solution().positions - answer.positions).max() < 1e-7
    assert session.structure().supports[1].HasField("x_axis")
    assert refusal(lambda: session.move_support(10, x=0.1)) == ("INVALID_ARGUMENT", "edits[0].move_beam_node.motion")
    # The third axis of the support, (-1, 0, -1) / sqrt 2, points up the plane's other side: it lifts the plane.
    plane = ((1, 0, -1), (0, 1, 0))
    session.move_support(10, z=-0.01, axes=plane)
    assert session.wait().status == "CONVERGED"
    lifted = session.solution().positions[10] - (1, 0, 0)
    up = np.cross((1, 0, -1), (0, 1, 0)) / np.sqrt(2)
    assert abs(lifted @ up + 0.01) < 1e-9, "by its own axis, the plane's are free"
    session.move_support(10, rotation_y=-0.1, axes=plane)
    assert session.wait().status == "CONVERGED", "free about both others"
    turned = session.rotations()[-1][10]
    assert abs(2 * np.arctan2(turned[2], turned[0]) + 0.1) < 1e-6
    session.edit([beam_edits.support(10, "", "xz", plane), beam_edits.move(10, rotation_y=-0.2, axes=plane)])
    assert session.wait().status == "CONVERGED"
    turned = session.rotations()[-1][10]
    assert abs(2 * np.arctan2(turned[2], turned[0]) + 0.2) < 1e-6 and np.abs(turned[[1, 3]]).max() < 1e-6
    session.release(10)
    session.support(10, "z", "", axes=((1, 0, 0), (0, 1, 0)))
    assert session.wait().status == "CONVERGED" and abs(session.solution().positions[10, 2]) < 1e-12
    session.close()
    slope["y_axis"] = {"x": -1, "z": 1}
    assert refusal(lambda: server.solve_beams(structure)) == ("INVALID_ARGUMENT", "structure.supports[1].y_axis")


def test_another_client_watches(server, arm):
    with limber.connect(server.connection.endpoint) as second:
        watched = second.session(arm.id)
        assert isinstance(watched, limber.BeamSession)
        with watched.stream(timeout=20) as stream:
            first = next(stream)
            assert first.positions.shape[1:] == (21, 3)
            revision = arm.move_support(0, rotation=(0, -2, 0)).revision
            for shown in stream:
                if shown.result.final and shown.result.revision == revision:
                    break
        assert np.abs(shown.positions[-1] - arm.frames()[-1]).max() < 1e-6
        assert len(shown.positions) == shown.result.steps > 3
        watched.load(20, force=(0, 0, 0))
        assert watched.wait().status == "CONVERGED"
    assert arm.status().revision == 2


def test_a_client_that_dies_while_it_settles_leaves_the_session_alive(server, arm):
    script = ("import limber, time\n"
              f"arm = limber.connect({server.connection.endpoint!r}).session({arm.id!r})\n"
              "stream = arm.stream()\nnext(stream)\narm.move_support(0, rotation=(0, -9, 0))\n"
              "print('sent', flush=True)\ntime.sleep(60)\n")
    child = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "sent\n"
    os.kill(child.pid, signal.SIGKILL)
    child.wait()
    child.stdout.close()
    result = arm.wait(1)
    assert result.status == "CONVERGED", result.message
    turned = arm.rotations()[-1][0]
    assert abs(abs(turned[0]) - abs(np.cos(4.5))) < 1e-5
    arm.move_support(0, rotation=(0, 0, 0))
    arm.wait()
    assert abs(tip(arm)[2] + 0.30172) < 1e-4


@pytest.mark.parametrize("change, code, field", [
    (lambda s: s["nodes"][2]["position"].update(x=s["nodes"][1]["position"]["x"]), "INVALID_ARGUMENT", "elements[1]"),
    (lambda s: s["elements"].append({"start": 1, "finish": 0}), "INVALID_ARGUMENT", "elements[4]"),
    (lambda s: s["loads"][0].update(node=99), "OUT_OF_RANGE", "loads[0].node"),
    (lambda s: s.update(supports=[]), "FAILED_PRECONDITION", "supports"),
    (lambda s: s["sections"][0].update(young=0), "INVALID_ARGUMENT", "sections[0].young"),
    (lambda s: s["sections"][0].update(shear_modulus=0, poisson=0), "INVALID_ARGUMENT", "sections[0].shear_modulus"),
    (lambda s: s["sections"][0].update(shear_modulus=1e9, poisson=0.3), "INVALID_ARGUMENT", "sections[0].poisson"),
    (lambda s: (s["elements"][3].update(finish_release={"rotations": [1, 2, 3]}),
                s.update(loads=[{"node": 4, "moment": {"y": 1}}])), "INVALID_ARGUMENT", "loads[0].moment"),
    (lambda s: s.update(motions=[{"node": 4, "z": 0.1}, {"node": 4, "z": 0.2}]), "INVALID_ARGUMENT", "motions[1].node"),
])
def test_bad_structures_are_refused_by_name_and_open_nothing(server, change, code, field):
    structure = cantilever(4)
    change(structure)
    before = len(server.sessions())
    assert refusal(lambda: opened(server, structure)) == (code, f"scene.beams.structure.{field}")
    assert server.validate(limber.beam_scene(structure))[0].find(f"scene.beams.structure.{field}") >= 0
    assert len(server.sessions()) == before


@pytest.mark.parametrize("edits, code, field", [
    ([beam_edits.load(99, (0, 0, 1))], "OUT_OF_RANGE", "edits[0].set_beam_load.load.node"),
    ([beam_edits.element_load(20, (0, 0, 1))], "OUT_OF_RANGE", "edits[0].set_beam_element_load.load.element"),
    ([beam_edits.release(0)], "FAILED_PRECONDITION", "edits[0].release_beam_node"),
    ([beam_edits.move(20, z=0.1), beam_edits.support(20)], "INVALID_ARGUMENT", "edits[1].set_beam_support.support"),
    ([beam_edits.move(20)], "INVALID_ARGUMENT", "edits[0].move_beam_node.motion.node"),
    ([beam_edits.move(20, x=1, position=(1, 0, 0))], "INVALID_ARGUMENT", "edits[0].move_beam_node.position"),
    ([limber.redo()], "FAILED_PRECONDITION", "edits[0].redo"),
    ([limber.move(1, (0, 0, 0))], "INVALID_ARGUMENT", "edits[0].move"),
    ([{"pin_joint": {"pin": {"joint": 0}}}], "INVALID_ARGUMENT", "edits[0].pin_joint"),
    ([{"push_beam_node": {}}], "INVALID_ARGUMENT", "edits[0].push_beam_node.load"),
    ([], "INVALID_ARGUMENT", "edits"),
])
def test_bad_edits_name_their_field_and_change_nothing(arm, edits, code, field):
    shape, structure = arm.frames(), arm.structure()
    assert refusal(lambda: arm.edit(edits)) == (code, field)
    assert arm.status().revision == 0 and arm.structure() == structure
    assert np.array_equal(arm.frames(), shape)
    arm.load(20, force=(0, 0, -2))
    assert arm.wait().status == "CONVERGED"


def test_what_has_no_equilibrium_keeps_the_last_good_shape(arm):
    good = tip(arm)
    arm.edit([beam_edits.support(0, "xyz", "xz"), beam_edits.load(20)])
    result = arm.wait()
    assert result.solve_failed and result.status == "UNBALANCED" and "node" in result.message
    assert np.abs(tip(arm) - good).max() == 0
    arm.support(0)
    result = arm.wait()
    assert result.status == "CONVERGED" and not result.solve_failed and abs(tip(arm)[2]) < 1e-6


def test_a_structure_without_equilibrium_is_a_session_to_mend(server):
    loose = cantilever(6)
    loose["supports"] = [{"node": 0, **CLAMPED, "fix_rotation_x": False}]  # unloaded, it turns about itself
    loose["loads"] = []
    session = opened(server, loose)
    result = session.wait()
    assert result.solve_failed and "node" in result.message
    assert np.abs(session.frames()[-1][:, 2]).max() == 0, "as drawn"
    assert refusal(session.solution) == ("FAILED_PRECONDITION", "session")
    assert refusal(lambda: session.export("x", ("vtu",))) == ("FAILED_PRECONDITION", "session")
    assert refusal(lambda: session.hold(6)) == ("FAILED_PRECONDITION", "edits[0].hold_beam_node.node")
    session.support(0)
    result = session.wait()
    assert result.status == "CONVERGED" and abs(tip(session)[2]) < 1e-9
    session.close()


def test_a_newer_edit_continues_from_the_path(server):
    """Many edits while it settles: the last one counts, and what is shown never starts again from nothing."""
    session = server.open(sample="gridshell", progress=False)
    assert refusal(lambda: session.edit([beam_edits.gravity((0, 0, 0))], expected_revision=7))[1] == "expected_revision"
    motion = session.structure().motions[0]
    axis = "x" if motion.HasField("x") else "y"
    lowest = session.frames()[-1][:, 2].max()
    with session.stream(timeout=30) as stream:
        for share in np.linspace(1, 0.4, 30):
            revision = session.move_support(motion.node, **{axis: share * getattr(motion, axis)}).revision
        heights = []
        for shown in stream:
            heights.append(shown.positions[-1][:, 2].max())
            if shown.result.final and shown.result.revision == revision:
                break
    assert shown.result.status == "CONVERGED" and min(heights) > 0.5 * lowest
    moved = session.solution().positions[motion.node] - session.geometry().rest[motion.node]
    assert abs(moved["xy".index(axis)] - 0.4 * getattr(motion, axis)) < 1e-6
    session.close()


def test_what_only_others_have_is_refused(server, arm):
    assert refusal(lambda: arm.export("x", ("vtp",)))[1] == "formats"
    call = server.connection.call
    service = limber.messages.service
    assert refusal(lambda: call("get_material", service.GetMaterialRequest(session=arm.id))) == (
        "FAILED_PRECONDITION", "session")
    assert refusal(lambda: call("export", service.ExportRequest(session=arm.id, format=service.EXPORT_FORMAT_PC2))) == (
        "INVALID_ARGUMENT", "format")
    assert refusal(lambda: server.simulate(limber.beam_scene(cantilever(2)))) == ("INVALID_ARGUMENT", "scene.beams")
    scene = limber.beam_scene(cantilever(2))
    scene.frames = 20
    assert refusal(lambda: server.open(scene)) == ("INVALID_ARGUMENT", "scene.frames")
    body = server.open(small_scene(), progress=False)
    assert refusal(lambda: body.edit([beam_edits.release(0)])) == ("INVALID_ARGUMENT", "edits[0].release_beam_node")
    assert refusal(lambda: call("get_beam_solution", service.GetBeamSolutionRequest(session=body.id))) == (
        "FAILED_PRECONDITION", "session")
    body.close()


def test_encodings_agree(arm):
    arm.load(20, force=(0, 0, -5))
    arm.wait()
    frames = arm.frames()
    assert np.abs(frames - arm.frames(encoding="positions")).max() == 0
    assert np.abs(frames - arm.frames(encoding="quantised")).max() < 1e-4
    assert np.abs(np.linalg.norm(arm.rotations(), axis=2) - 1).max() < 1e-6
    assert arm.frames(first=1, count=1).shape == (1, 21, 3)


def test_files_hold_the_latest_state_and_open_again(server, arm, tmp_path):
    arm.load(20, force=(0, 0, -3))
    arm.wait()
    solution = arm.solution()
    names = {path.name for path in arm.export(tmp_path, ("vtu", "csv", "json", "scene"), stem="arm", progress=False)}
    assert names == {"arm.vtu", "arm_nodes.csv", "arm_elements.csv", "arm_stations.csv", "arm_shape.json", "arm.json"}
    exported = arm.export(tmp_path / "named", ("vtu", "scene"), progress=False)
    assert {path.name for path in exported} == {"beams.vtu", "beams.json"}
    assert exported.result.status == "CONVERGED" and exported.result.revision == 1
    assert np.array_equal(vtu_array(tmp_path / "arm.vtu", "Points", "<f8"), solution.positions.ravel())
    table = np.genfromtxt(tmp_path / "arm_nodes.csv", delimiter=",", names=True)
    assert table["reaction_force_z"][0] == pytest.approx(3)
    assert json.loads((tmp_path / "arm_shape.json").read_text())["status"] == "converged"
    again = server.open(tmp_path / "arm.json", progress=False)
    assert np.abs(again.solution().positions - solution.positions).max() < 1e-7
    again.close()


def test_lines_from_files_and_jobs_as_they_are(server, tmp_path):
    folder = job_folder(tmp_path)
    wanted = server.solve_beams(cantilever(10), progress=False).positions
    for source in (folder, folder / "SimulationJob.json"):
        session = server.open(source, progress=False)
        assert np.abs(session.solution().positions - wanted).max() < 1e-6
        assert session.structure().sections[0].rectangle.width == 0.01
        session.close()
    rest = {key: cantilever(10)[key] for key in ("sections", "supports", "loads")}
    session = server.open(limber.beam_scene(rest, lines=folder / "beam.ply"), progress=False)
    assert np.abs(session.solution().positions - wanted).max() < 1e-6
    session.close()
    (tmp_path / "beam.obj").write_text("".join(f"v {i / 10} 0 0\n" for i in range(11)) +
                                       "".join(f"l {i} {i + 1}\n" for i in range(1, 11)))
    scene = tmp_path / "scene.json"
    scene.write_text(json.dumps({"name": "arm", "beams": {"structure": rest, "lines": {"path": "beam.obj"}}}))
    session = server.open(scene, progress=False)
    assert np.abs(session.solution().positions - wanted).max() < 1e-6
    session.close()
    (tmp_path / "beam.obj").write_text("v 0 0 0\nv 1 0 0\nl 1 3\n")
    assert refusal(lambda: server.open(scene)) == ("INVALID_ARGUMENT", "scene.beams.lines.file")


def test_cancel_and_close_while_it_settles(arm):
    arm.move_support(0, rotation=(0, -9, 0))
    arm.cancel()
    arm.move_support(0, rotation=(0, -0.2, 0))
    assert arm.wait().status == "CONVERGED"
    arm.move_support(0, rotation=(0, -9, 0))
    with arm.stream() as stream:
        arm.close()
        deadline = time.monotonic() + 10
        for _ in stream:
            assert time.monotonic() < deadline
    assert refusal(arm.status) == ("NOT_FOUND", "session")
