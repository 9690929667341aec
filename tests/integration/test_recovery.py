"""Recovery of materials, as users reach it."""

import json
import os
import re
import subprocess
import sys

import limber
import meshio
import numpy as np
import pytest
from conftest import ROOT, bar, small_scene
from limber.bodies import recoveries

FRAMES = 60
CANDIDATES = 40


@pytest.fixture(scope="module")
def swinging(server):
    """A bar that was let go of, damped, with the motion of its simulation."""
    scene = small_scene(FRAMES, modes=2, candidate_modes=CANDIDATES, youngs_modulus=4e6)
    made = server.simulate(scene, limber.simulation(modes=[0.1], steps_per_frame=2, mass_damping=0.5), progress=False)
    scene.base_motion.CopyFrom(limber.base_motion(made.positions))
    return scene, made.positions


def refusal(call):
    with pytest.raises(limber.LimberError) as caught:
        call()
    return caught.value


def test_the_first_half_foretells_the_second(server, swinging):
    scene, truth = swinging
    found = server.recover(scene, progress=False)
    assert found.positions.shape == truth.shape and found.positions.dtype == np.float32
    assert (found.recovered_frames, found.converged, found.frames_per_second) == (FRAMES // 2, True, 30)
    assert len(found.modes) == 2 and found.mixing.shape == (CANDIDATES, 2)
    rest = np.array(bar()[0])
    moved, wanted = found.positions[30:] - rest, truth[30:] - rest
    off = np.linalg.norm(moved - wanted) / np.linalg.norm(wanted)
    assert found.continued_error == pytest.approx(off, rel=1e-3) and off < 0.05 and found.final_frame_error < 0.05
    assert found.recovered_error < 0.02 and found.projection_error < 0.02 and found.message == ""


def test_frequency_and_damping_are_those_of_the_simulated_body(server):
    """Of a small swing: fitted to its tip by hand, with no mode of limber's."""
    scene = small_scene(90, modes=1, candidate_modes=CANDIDATES, youngs_modulus=4e6)
    made = server.simulate(scene, limber.simulation(modes=[0.02], steps_per_frame=4, mass_damping=0.5), progress=False)
    scene.base_motion.CopyFrom(limber.base_motion(made.positions))
    mode, = server.recover(scene, progress=False).modes
    tip = (made.positions[:, -1] - np.array(bar()[0])[-1]).astype(np.float64)
    x = tip @ tip[0] / np.linalg.norm(tip[0])
    (a, b), *_ = np.linalg.lstsq(np.stack([x[1:-1], x[:-2]], 1), x[2:], rcond=None)
    rate = np.log(np.roots([1, -a, -b])[0]) * 30
    assert mode.frequency == pytest.approx(abs(rate) / (2 * np.pi), rel=0.01)
    assert mode.damping_ratio == pytest.approx(-rate.real / abs(rate), rel=0.05)
    assert -rate.real == pytest.approx(0.25, rel=0.05), "mass damping, halved"


def test_what_may_change_says_how_well_it_goes(server, swinging):
    scene, _ = swinging
    all_ = server.recover(scene, progress=False)
    dynamics = server.recover(scene, variables="dynamics", progress=False)
    motion = server.recover(scene, variables="motion", progress=False)
    assert dynamics.mixing.tolist() == np.eye(CANDIDATES, 2).tolist() == motion.mixing.tolist()
    assert dynamics.force_energy < motion.force_energy
    assert all_.constraint_energy < dynamics.constraint_energy
    spectrum = server.recover(scene, start="spectrum", progress=False)
    assert spectrum.modes[0].frequency == pytest.approx(all_.modes[0].frequency, rel=0.02)
    one = server.recover(scene, modes=1, candidate_modes=5, progress=False)
    assert one.mixing.shape == (5, 1)


def test_the_motion_continues_behind_its_end(server, swinging):
    scene, truth = swinging
    found = server.recover(scene, recovered_frames=FRAMES, driven_frames=4, total_frames=2 * FRAMES, progress=False)
    assert found.positions.shape == (2 * FRAMES, *truth.shape[1:])
    assert found.continued_error == found.final_frame_error == 0
    assert np.ptp(found.positions[FRAMES:]) < 1.2 * np.ptp(truth), "it is damped"


def test_constraints_are_not_looked_at(server, swinging):
    scene = type(swinging[0])()
    scene.CopyFrom(swinging[0])
    scene.constraints.add(frame=10_000, nodes=[1])
    assert server.recover(scene, progress=False).converged


def test_what_cannot_be_recovered_is_refused_by_its_field(server, swinging):
    scene, _ = swinging
    assert refusal(lambda: server.recover(small_scene())).field == "scene.base_motion"
    for options, field in (({"recovered_frames": 7}, "recovered_frames"),
                           ({"recovered_frames": FRAMES + 1}, "recovered_frames"),
                           ({"recovered_frames": 20, "driven_frames": 13}, "recovered_frames"),
                           ({"recovered_frames": 2 ** 32 - 1}, "recovered_frames"),
                           ({"total_frames": 20}, "total_frames"), ({"total_frames": 10 ** 6}, "total_frames"),
                           ({"weight": 0}, "weight"), ({"column_weight": -1}, "column_weight"),
                           ({"candidate_modes": 1}, "scene.model.candidate_modes"),
                           ({"modes": 1000, "candidate_modes": 0}, "scene.model.modes"), ({"modes": 0.5}, "modes"),
                           ({"variables": "some"}, "variables"), ({"start": "end"}, "start")):
        assert refusal(lambda: server.recover(scene, progress=False, **options)).field == field, options
    short = small_scene(15, base_motion=np.array(swinging[1][:15]))
    caught = refusal(lambda: server.recover(short))
    assert caught.field == "recovered_frames" and "there are 7 frames (half of the base motion)" in caught.message


def test_no_motion_has_no_material(server):
    rest = np.tile(np.array(bar()[0]), (20, 1, 1))
    found = server.recover(small_scene(20, base_motion=rest, candidate_modes=10), progress=False)
    assert "the motion is zero" in found.message and found.recovered_error == found.final_frame_error == 0
    assert np.abs(found.positions - rest).max() < 1e-6 and all(mode.frequency == 0 for mode in found.modes)


def test_a_long_recovery_can_be_cancelled(server, swinging):
    _, truth = swinging
    frames = 6000
    long = small_scene(frames, modes=12, candidate_modes=100, base_motion=truth[np.arange(frames) % FRAMES])
    request = recoveries.request(long, variables="all", modes=None, candidate_modes=None, recovered_frames=frames,
                                 driven_frames=0, total_frames=0, weight=1, column_weight=1e-8, start="principal")
    job = server.connection.call("recover", request, timeout=60.0).job
    assert [status.kind for status in server.jobs() if status.job == job] == ["recover"]
    assert "still runs" in refusal(lambda: frames_of(server, job)).message
    server.cancel_job(job)
    assert refusal(lambda: server.wait_job(job, progress=False, timeout=30)).code == "CANCELLED"
    assert "ended without a motion" in refusal(lambda: frames_of(server, job)).message
    assert refusal(lambda: server.recover(long, progress=False, timeout=0.01)).code == "TIMEOUT"


def frames_of(server, job):
    from limber.messages import service
    return server.connection.call("get_frames", service.GetFramesRequest(job=job))


def test_files_of_a_recovery(server, swinging):
    from limber.messages import service
    scene, _ = swinging
    found = server.recover(scene, total_frames=FRAMES + 5, progress=False)

    def files(format_):
        request = service.ExportRequest(job=found.job, format=format_, stem="found")
        return {file.name: file.content for file in server.connection.call("export", request).files}

    cache = files(service.EXPORT_FORMAT_PC2)["found.pc2"]
    assert (np.frombuffer(cache[32:], "<f4").reshape(found.positions.shape) == found.positions).all()
    assert len(files(service.EXPORT_FORMAT_PVD)) == FRAMES + 6
    exported = json.loads(files(service.EXPORT_FORMAT_SCENE)["found.json"])
    assert exported["frames"] == FRAMES + 5 and exported["base_motion"] == {"path": "found_base.pc2"}


@pytest.fixture(scope="module")
def scene_file(swinging, tmp_path_factory):
    folder = tmp_path_factory.mktemp("recover")
    nodes, tets = bar()
    truth = swinging[1]
    meshio.write(folder / "bar.vtk", meshio.Mesh(nodes, [("tetra", tets)]))
    header = b"POINTCACHE2\0" + np.array([1, len(nodes)], "<i4").tobytes() + np.array([0, 1], "<f4").tobytes()
    (folder / "motion.pc2").write_bytes(header + np.array([FRAMES], "<i4").tobytes() + truth.astype("<f4").tobytes())
    (folder / "scene.json").write_text(json.dumps({
        "mesh": {"path": "bar.vtk"}, "frames": FRAMES, "fixed_nodes": list(range(9)),
        "model": {"modes": 2, "candidate_modes": CANDIDATES}, "base_motion": {"path": "motion.pc2"}}))
    return folder / "scene.json"


def test_limber_recover_prints_modes_and_writes_the_motion(cli, server, swinging, scene_file):
    out = scene_file.parent / "continued.pc2"
    process = cli("recover", scene_file, "-o", out, "--frames", 30, "--total", 80, endpoint="tcp://127.0.0.1:1")
    assert process.returncode == 0, process.stderr
    found = server.recover(swinging[0], recovered_frames=30, total_frames=80, progress=False)
    lines = process.stdout.splitlines()
    assert lines[0] == str(out) and lines[1].split() == ["mode", "frequency", "[Hz]", "damping", "ratio", "decay", "[1/s]"]
    assert float(lines[2].split()[1]) == pytest.approx(found.modes[0].frequency, rel=1e-3)
    assert re.search(r"^continued to 80 frames: off by \S+ %, the last by \S+ %$", process.stdout, re.MULTILINE)
    positions = np.frombuffer(out.read_bytes()[32:], "<f4").reshape(80, -1, 3)
    assert np.abs(positions - found.positions).max() < 1e-3
    report = json.loads(cli("--json", "recover", scene_file, "--modes", 1, "--variables", "dynamics").stdout)
    assert len(report["modes"]) == 1 and report["recovered_frames"] == FRAMES // 2
    assert cli("recover", scene_file, "--out", scene_file.parent / "series.vtu", "--json").returncode == 0
    assert len(list(scene_file.parent.glob("series_*.vtu"))) == FRAMES


def test_limber_recover_says_what_is_wrong(cli, scene_file):
    for arguments, code, text in (((), 2, "scene"), ((scene_file, "-o", "x.foo"), 1, "output"),
                                  ((scene_file, "-o", scene_file.parent / "none" / "x.pc2"), 1, "there is no folder"),
                                  ((scene_file, "--modes", 1000), 1, "model.modes"),
                                  ((scene_file, "--candidate-modes", 1), 1, "model.candidate_modes"),
                                  ((scene_file, "--frames", 61), 1, "recovered_frames"),
                                  ((scene_file, "--weight", -1), 1, "weight"),
                                  ((scene_file, "--variables", "some"), 2, "--variables"),
                                  ((scene_file, "--frames", "few"), 2, "--frames"),
                                  ((scene_file.parent / "none.json",), 1, "[IO]")):
        process = cli("recover", *arguments)
        assert process.returncode == code and text in process.stderr, (arguments, process.stderr)
    plain = scene_file.parent / "plain.json"
    plain.write_text(json.dumps({key: value for key, value in json.loads(scene_file.read_text()).items()
                                 if key != "base_motion"}))
    process = cli("recover", plain)
    assert process.returncode == 1 and "base_motion" in process.stderr
    assert "limber recover scene.json --frames 150" in cli("recover", "--help").stdout


def test_the_command_in_the_guide_works(cli, scene_file):
    command, = re.findall(r"^    limber (recover scene\.json .*)$", (ROOT / "docs" / "guide.md").read_text(), re.MULTILINE)
    process = cli(*command.split(), cwd=scene_file.parent)
    assert process.returncode == 0 and "Hz" in process.stdout, process.stderr


def test_the_example_foretells_the_second_half(limberd, tmp_path):
    process = subprocess.run([sys.executable, str(ROOT / "examples" / "recover_material.py"), "60"], capture_output=True,
                             text=True, timeout=60, env=dict(os.environ, XDG_CACHE_HOME=str(tmp_path)))
    assert process.returncode == 0, process.stderr
    found = re.findall(r"^ +(\S+) Hz +(\S+) % of critical damping$", process.stdout, re.MULTILINE)
    assert len(found) == 3
    errors = re.search(r"frames 30 to 60 off by (\S+) %, the last by (\S+) %", process.stdout)
    assert float(errors[1]) < 10 and float(errors[2]) < 10
