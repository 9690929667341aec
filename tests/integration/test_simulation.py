"""Full simulation and base motions, as users reach them."""

import json
import os
import re
import subprocess
import sys
import time

import limber
import meshio
import numpy as np
import pytest
from conftest import ROOT, bar, small_scene
from limber.bodies import simulations

FRAMES = 24


@pytest.fixture(scope="module")
def pushed(server):
    """A bar pushed at its tip for eight frames, simulated."""
    push = limber.force(len(bar()[0]) - 1, (0, 0, 500), until_frame=8, profile="sine", period_frames=16)
    scene = small_scene(FRAMES, period_frames=0, simulation=limber.simulation(forces=[push], steps_per_frame=2))
    return scene, server.simulate(scene, progress=False)


def refusal(call):
    with pytest.raises(limber.LimberError) as caught:
        call()
    return caught.value


def test_a_free_body_falls_by_half_g_t_squared(server):
    scene = small_scene(FRAMES, fixed_nodes=[])
    fall = limber.simulation(gravity=(0, 0, -9.81), velocity=(2, 0, 0), steps_per_frame=3)
    motion = server.simulate(scene, fall, progress=False)
    assert motion.positions.shape == (FRAMES, len(bar()[0]), 3) and motion.steps == 3 * (FRAMES - 1)
    t = np.arange(FRAMES)[:, None] / 30
    moved = motion.positions - motion.positions[0]
    assert np.abs(moved[:, :, 0] - 2 * t).max() < 1e-5 and np.abs(moved[:, :, 1]).max() < 1e-5
    assert np.abs(moved[:, :, 2] + 0.5 * 9.81 * t ** 2).max() < 1e-5
    assert motion.energy_drift < 1e-9 and motion.message == ""


def test_energy_of_a_pushed_bar_is_the_work_of_the_push(pushed):
    _, motion = pushed
    energy = motion.kinetic + motion.elastic
    assert np.abs(motion.positions - motion.positions[0]).max() > 0.05
    assert np.abs(energy - motion.work).max() < 0.02 * energy.max()
    assert np.ptp(energy[9:]) < 0.02 * energy.max(), "nothing acts any more"
    held = [i for i, node in enumerate(bar()[0]) if node[0] == 0]
    assert (motion.positions[:, held] == motion.positions[0, held]).all()


def test_a_simulated_motion_is_edited(server, pushed, tmp_path):
    scene, motion = pushed
    scene.base_motion.CopyFrom(limber.base_motion(motion.positions))
    session = server.open(scene, progress=False)
    tip, frame = motion.positions.shape[1] - 1, 15
    assert np.abs(session.frames() - motion.positions).max() < 0.02, "the base motion, but for the model's error"
    target = motion.positions[frame, tip] + (0, 0.1, 0)
    session.add(node=tip, frame=frame, position=target, exact=True)
    assert session.wait().max_error < 1e-4
    edited = session.frames()
    assert np.abs(edited[frame, tip] - target).max() < 0.01
    assert np.abs(edited[0] - motion.positions[0]).max() < 0.01, "the ends are those of the base motion"
    session.export(tmp_path, formats=("pc2", "scene"))  # under one stem; the scene brings its base motion along
    session.close()
    again = server.open(str(tmp_path / "motion.json"), progress=False)
    assert again.wait().max_error < 1e-4 and np.abs(again.frames() - edited).max() < 1e-2
    again.close()


def test_large_motions_come_in_several_answers(server, pushed, monkeypatch):
    scene, motion = pushed
    monkeypatch.setattr(simulations, "PART_BYTES", 5 * 12 * 63)
    asked = []
    call = server.connection.call
    monkeypatch.setattr(server.connection, "call", lambda name, *rest, **more: asked.append(name) or call(name, *rest, **more))
    again = server.simulate(scene, progress=False)
    assert asked.count("get_frames") == 5 and (again.positions == motion.positions).all()


def test_a_simulation_that_takes_too_long_is_cancelled(server):
    heavy = limber.simulation(gravity=(0, 0, -1), steps_per_frame=1000)
    assert refusal(lambda: server.simulate(small_scene(50_000), heavy, progress=False, timeout=0.1)).code == "TIMEOUT"
    job = server.jobs()[-1]
    assert job.kind == "simulate"
    assert refusal(lambda: server.wait_job(job.job, progress=False, timeout=30)).code == "CANCELLED"


def test_base_motions_of_every_kind_are_the_same(server, pushed, tmp_path):
    scene, motion = pushed
    nodes, tets = bar()
    names = []
    for frame, points in enumerate(motion.positions.astype(np.float64)):
        names.append(str(tmp_path / f"m_{frame:02}.vtu"))
        meshio.write(names[-1], meshio.Mesh(points, [("tetra", tets)]))
    listed = "".join(f'<DataSet timestep="{frame}" file="m_{frame:02}.vtu"/>' for frame in reversed(range(FRAMES)))
    (tmp_path / "m.pvd").write_text(f'<VTKFile type="Collection"><Collection>{listed}</Collection></VTKFile>')
    write_pc2(tmp_path / "m.pc2", motion.positions)
    found = []
    for given in (motion.positions, tmp_path / "m.pc2", tmp_path / "m.pvd", names):
        session = server.open(small_scene(FRAMES, base_motion=given), progress=False)
        found.append(session.frames())
        session.close()
    for frames in found[1:]:
        assert np.abs(frames - found[0]).max() < 1e-6


def test_base_motions_that_do_not_fit_name_the_field(server, pushed, tmp_path):
    _, motion = pushed
    given = motion.positions

    def error(base_motion, frames=FRAMES):
        caught = refusal(lambda: server.open(small_scene(frames, base_motion=base_motion), progress=False))
        return caught.field, caught.message

    field, message = error(given, FRAMES + 1)
    assert field == "scene.base_motion.positions.shape[0]" and f"{FRAMES} frames, expected {FRAMES + 1}" in message
    assert error(given, FRAMES - 1)[0] == "scene.base_motion.positions.shape[0]"
    field, message = error(given[:, 1:])
    assert field == "scene.base_motion.positions.shape[1]" and "nodes" in message
    broken = given.copy()
    broken[3, 7, 1] = np.nan
    assert error(broken)[0].startswith("scene.base_motion.positions.data[")
    write_pc2(tmp_path / "short.pc2", given[:-1])
    assert error(tmp_path / "short.pc2") == ("scene.base_motion.pc2", f"has {FRAMES - 1} frames, the scene has {FRAMES}")
    write_pc2(tmp_path / "nan.pc2", broken)
    assert error(tmp_path / "nan.pc2") == ("scene.base_motion.pc2", "the position of point 7 in sample 3 is not finite")
    names = []
    for frame in range(FRAMES):
        names.append(str(tmp_path / f"n_{frame}.vtu"))
        nodes, tets = bar() if frame != 5 else bar((5, 2, 2))
        meshio.write(names[-1], meshio.Mesh(nodes, [("tetra", tets)]))
    field, message = error(names)
    assert field == "scene.base_motion.vtu_series.files"
    assert re.match(r"frame 5 \(.*n_5.vtu\) has 54 points, the mesh has 63 nodes", message)
    assert error(str(tmp_path / "none.pvd")) == ("base_motion.path", f"cannot read {tmp_path}/none.pvd: "
                                                                     "No such file or directory")
    assert error(names[:5]) == ("scene.base_motion.vtu_series", f"has 5 frames, the scene has {FRAMES}")


def test_what_cannot_be_simulated_is_refused_by_its_field(server):
    assert refusal(lambda: server.simulate(small_scene())).field == "scene.simulation"
    for made, field in ((limber.simulation(forces=[limber.force(63, (1, 0, 0))]), "forces[0].nodes[0]"),
                        (limber.simulation(steps_per_frame=0), "steps_per_frame"),
                        (limber.simulation(displacements=np.ones((63, 3))), "initial.displacements"),
                        (limber.simulation(displacements=np.ones((5, 3))), "initial.displacements.shape[0]"),
                        (limber.simulation(velocities=np.full((63, 3), np.nan)), "initial.velocities.data[0]")):
        assert refusal(lambda: server.simulate(small_scene(), made)).field == f"scene.simulation.{field}"
    assert refusal(lambda: server.simulate(small_scene(), {"gravity": 1})).field == "simulation"
    assert refusal(lambda: limber.simulation(gravity=(1, 2))).field == "gravity"
    assert refusal(lambda: limber.force(1.5, (0, 0, 0))).field == "nodes[0]"


def test_a_long_simulation_can_be_cancelled(server):
    scene = small_scene(50_000)
    job = server.connection.call("simulate", simulations.request(scene, limber.simulation(
        gravity=(0, 0, -1), steps_per_frame=1000))).job
    assert [status.kind for status in server.jobs() if status.job == job] == ["simulate"]
    server.cancel_job(job)
    assert refusal(lambda: server.wait_job(job, progress=False, timeout=30)).code == "CANCELLED"


def scene_file(folder, **more):
    nodes, tets = bar()
    meshio.write(folder / "bar.vtk", meshio.Mesh(nodes, [("tetra", tets)]))
    (folder / "scene.json").write_text(json.dumps({
        "mesh": {"path": "bar.vtk"}, "frames": FRAMES, "fixed_nodes": list(range(9)),
        "material": {"youngs_modulus": 1e6}, "model": {"modes": 8, "tolerance": 0.05},
        "simulation": {"gravity": {"z": -9.81}, "steps_per_frame": 2,
                       "forces": [{"nodes": [62], "force": {"y": 20}, "until_frame": 5}]}} | more))
    return folder / "scene.json"


def test_limber_simulate_writes_what_limber_open_edits(cli, server, tmp_path):
    scene = scene_file(tmp_path, base_motion={"path": "motion.pc2"})  # what is to be made
    out = tmp_path / "motion.pc2"
    process = cli("simulate", scene, "-o", out, "--scene-out", tmp_path / "edited.json", endpoint="tcp://127.0.0.1:1")
    assert process.returncode == 0, process.stderr
    assert "simulating" in process.stderr and re.search(r"^24 frames, 63 nodes; 46 steps", process.stdout, re.MULTILINE)
    motion = server.simulate(str(scene), progress=False)
    assert np.abs(read_pc2(out) - motion.positions).max() < 1e-6
    assert json.loads((tmp_path / "edited.json").read_text())["base_motion"] == {"path": "edited_base.pc2"}
    for file in (tmp_path / "edited.json", scene):
        assert cli("validate", file).returncode == 0
        session = re.match(r"session (\S+?):", cli("open", file).stdout)[1]
        frames = server.session(session).frames()
        assert np.abs(frames - motion.positions).max() < 0.02 * np.ptp(motion.positions)
        server.session(session).close()
    assert cli("simulate", scene, "-o", tmp_path / "series.vtu").returncode == 0
    assert len(list(tmp_path.glob("series_*.vtu"))) == FRAMES and (tmp_path / "series.pvd").is_file()
    scene_file(tmp_path, base_motion={"path": "series.pvd"})
    assert cli("validate", scene).returncode == 0
    session = re.match(r"session (\S+?):", cli("open", scene).stdout)[1]
    assert np.abs(server.session(session).frames() - frames).max() < 1e-5
    server.session(session).close()


def test_a_simulation_does_not_look_at_constraints(cli, server, tmp_path):
    late = [{"frame": FRAMES + 6, "nodes": [62], "position": {"x": 1}}, {"frame": 5, "nodes": [4000], "position": {"x": 1}}]
    wrong = scene_file(tmp_path, constraints=late, keyframes=[{"frame": 5, "path": "none.vtk"}])
    process = cli("simulate", wrong, "-o", tmp_path / "wrong.pc2", "--scene-out", tmp_path / "without.json")
    assert process.returncode == 0 and "no constraints and no keyframes" in process.stderr, process.stderr
    assert "constraints" not in json.loads((tmp_path / "without.json").read_text())
    plain = scene_file(tmp_path)
    motion = server.simulate(str(plain), progress=False)
    assert np.abs(read_pc2(tmp_path / "wrong.pc2") - motion.positions).max() < 1e-6
    scene = limber.load_scene(plain)
    scene.constraints.add(frame=FRAMES + 6, nodes=[62]).position.x = 1
    assert np.abs(server.simulate(scene, progress=False).positions - motion.positions).max() < 1e-6
    with pytest.raises(limber.LimberError, match="frame"):
        server.open(scene)
    fits = scene_file(tmp_path, constraints=[{"frame": 5, "nodes": [62], "position": {"x": 1}}])
    assert cli("simulate", fits, "--scene-out", tmp_path / "edited.json").returncode == 0
    assert [one["frame"] for one in json.loads((tmp_path / "edited.json").read_text())["constraints"]] == [5]


def test_limber_simulate_says_what_is_wrong(cli, tmp_path):
    scene = scene_file(tmp_path)
    for arguments, code, text in (((scene,), 2, "--out"), ((scene, "-o", tmp_path / "x.foo"), 1, "output"),
                                  ((scene, "-o", tmp_path / "none" / "x.pc2"), 1, "there is no folder"),
                                  ((tmp_path / "none.json", "-o", tmp_path / "x.pc2"), 1, "[IO]")):
        process = cli("simulate", *arguments)
        assert process.returncode == code and text in process.stderr, process.stderr
    scene_file(tmp_path, simulation={"forces": [{"nodes": [63]}], "steps_per_frame": 0, "mass_damping": -1})
    assert re.findall(r"^error: (\S+):", cli("validate", scene).stdout, re.MULTILINE) == [
        "simulation.forces[0].nodes[0]", "simulation.steps_per_frame", "simulation.mass_damping"]
    process = cli("simulate", scene, "-o", tmp_path / "x.pc2")
    assert process.returncode == 1 and "simulation.forces[0].nodes[0]" in process.stderr
    assert not (tmp_path / "x.pc2").exists()
    scene_file(tmp_path, base_motion={"path": "none.pvd"})
    process = cli("open", scene)
    assert process.returncode == 1 and "(field base_motion.path)" in process.stderr
    assert "base_motion.path" in cli("validate", scene).stdout
    assert "--scene-out" in cli("simulate", "--help").stdout


def test_the_example_prints_a_table_of_errors(limberd, tmp_path):
    process = subprocess.run([sys.executable, str(ROOT / "examples" / "edit_simulation.py"), "24"], capture_output=True,
                             text=True, timeout=60, env=dict(os.environ, XDG_CACHE_HOME=str(tmp_path)))
    assert process.returncode == 0, process.stderr
    rows = [list(map(float, line.split())) for line in process.stdout.splitlines()[2:]]
    assert [row[0] for row in rows] == [0, 0.05, 0.1, 0.2]
    assert rows[0][1] < 1e-5 < rows[3][1] < 0.05 and rows[0][2] < rows[1][2] < rows[2][2] < rows[3][2]


def write_pc2(path, positions):
    frames, nodes, _ = positions.shape
    header = b"POINTCACHE2\0" + np.array([1, nodes], "<i4").tobytes() + np.array([0, 1], "<f4").tobytes()
    path.write_bytes(header + np.array([frames], "<i4").tobytes() + positions.astype("<f4").tobytes())


def read_pc2(path):
    content = path.read_bytes()
    nodes, frames = np.frombuffer(content[16:20], "<i4")[0], np.frombuffer(content[28:32], "<i4")[0]
    return np.frombuffer(content[32:], "<f4").reshape(frames, nodes, 3)
