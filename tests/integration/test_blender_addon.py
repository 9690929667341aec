"""The Blender add-on: its thread without Blender, and all of it in Blender without a display."""

import json
import os
import shutil
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import limber
import numpy as np
import pytest
from conftest import ROOT

sys.path.insert(0, str(ROOT / "clients" / "blender"))
SHARED = Path(os.environ.get("LIMBER_SHARED", ROOT.parent / "shared"))


def box(cells=(8, 3, 3), size=(4.0, 1.0, 1.0)):
    """Vertices and outward triangles of a box."""
    corners, triangles = {}, []

    def vertex(*at):
        return corners.setdefault(at, len(corners))

    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, cells[axis]):
            for i, j in np.ndindex(cells[u], cells[v]):
                square = []
                for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
                    at = [0, 0, 0]
                    at[axis], at[u], at[v] = side, i + a, j + b
                    square.append(vertex(*at))
                square = square if side else square[::-1]
                triangles += [square[:3], [square[0], square[2], square[3]]]
    return np.array(list(corners), dtype=float) * (np.array(size) / cells), np.array(triangles)


def wait_for(condition, live, seconds=100):
    deadline = time.monotonic() + seconds
    while not condition():
        assert live.state != "failed", live.error
        assert time.monotonic() < deadline, live.state
        time.sleep(0.01)


@pytest.fixture
def live_box(server):
    from limber_blender import live
    vertices, triangles = box()
    body = live.Body("box", vertices, triangles, frames=50, rate=25, fixed=np.flatnonzero(vertices[:, 0] == 0), tets=400,
                     period=1.0, modes=8, tolerance=0.2)
    made = live.Live(body, endpoint=server.connection.endpoint)
    wait_for(lambda: made.picture, made)
    yield made
    made.stop(wait=True)
    assert made.state == "closed"


def test_the_motion_follows_wishes(server, live_box):
    from limber_blender.live import Wish
    before = live_box.picture
    assert before.shapes().shape == (50, len(live_box.body.vertices), 3)
    assert np.allclose(before.shape(10), live_box.body.vertices, atol=1e-5)
    tip = int(live_box.nodes.sum(axis=1).argmax())
    at = live_box.nodes[tip]
    for up in np.linspace(0.1, 0.5, 9):  # as empties are dragged: nobody waits
        number = live_box.wish([Wish("a", 25, tip, tuple(at + (0, 0, up)))])
    wait_for(lambda: live_box.settled(number), live_box)
    (session,) = [server.session(status.session) for status in server.sessions() if status.name == "box"]
    (constraint,) = session.constraints()
    assert constraint.frame == 25 and constraint.target == pytest.approx(at + (0, 0, 0.5), abs=1e-6)
    assert session.frames()[25, tip] == pytest.approx(at + (0, 0, 0.5), abs=0.05)
    # The surface is where the server has it.
    assert np.allclose(live_box.picture.shapes(), session.frames(encoding="surface"), atol=1e-4)
    assert np.allclose(live_box.picture.shape(20.5), live_box.picture.shapes()[20:22].mean(axis=0), atol=1e-5)

    number = live_box.wish([Wish("a", 25, tip, tuple(at + (0, 0, 0.5)), exact=True), Wish("a", 40, tip, tuple(at))])
    wait_for(lambda: live_box.settled(number), live_box)
    assert sorted((one.frame, one.message.exact) for one in session.constraints()) == [(25, True), (40, False)]
    number = live_box.wish([])
    wait_for(lambda: live_box.settled(number), live_box)
    assert not session.constraints() and np.allclose(live_box.picture.shape(25), live_box.body.vertices, atol=1e-4)


def test_the_manner_of_the_motion_and_holds_are_sent(server, live_box):
    from limber_blender.live import Manner, Wish
    (session,) = [server.session(status.session) for status in server.sessions() if status.name == "box"]
    tip = int(live_box.nodes.sum(axis=1).argmax())
    held = tuple(live_box.nodes[tip] + (0, 0, 0.3))
    number = live_box.wish([Wish("a", 20, tip, held, exact=True, until=24)], Manner(calm=0.25, loop=True))
    wait_for(lambda: live_box.settled(number), live_box)
    for frame in range(20, 25):
        assert session.frames()[frame, tip] == pytest.approx(held, abs=1e-5)
    scene, expected = session.scene(), limber.liveliness(0.25)
    for name, value in expected.items():
        assert getattr(scene.dynamics, name) == pytest.approx(value), name
    assert scene.first_end == scene.last_end != 0
    session.undo()
    assert session.scene().dynamics.damping_ratio > expected["damping_ratio"]


def test_a_refused_wish_is_told_and_the_next_one_works(live_box):
    from limber_blender.live import Wish
    number = live_box.wish([Wish("a", 4000, 0, (0.0, 0.0, 0.0))])
    wait_for(lambda: live_box.settled(number), live_box)
    assert "4000" in live_box.error and live_box.state == "ready"
    number = live_box.wish([])
    wait_for(lambda: live_box.settled(number), live_box)
    assert live_box.error == ""


def test_a_painted_group_makes_tets_stiffer(server):
    from limber_blender import live
    vertices, triangles = box()
    factors = np.where(vertices[:, 0] > 2.1, 20.0, 1.0)
    made = live.Live(live.Body("painted", vertices, triangles, frames=20, rate=25, tets=400, modes=6, tolerance=0.5,
                               stiffness=factors), endpoint=server.connection.endpoint)
    wait_for(lambda: made.picture, made)
    (session,) = [server.session(status.session) for status in server.sessions() if status.name == "painted"]
    geometry, groups = session.geometry(), session.scene().material_groups
    centres = geometry.rest[geometry.tets].mean(axis=1)[:, 0]
    assert sorted(round(group.material.youngs_modulus) for group in groups) == [100000, 2000000]
    for group in groups:
        of_group = centres[np.array(group.tets)]
        assert of_group.min() > 1.7 if group.material.youngs_modulus > 1e6 else of_group.max() < 2.6
    made.stop(wait=True)


def test_a_surface_that_cannot_be_filled_fails_in_words(server):
    from limber_blender import live
    made = live.Live(live.Body("none", np.zeros((3, 3)), np.array([[0, 1, 2]]), frames=10, rate=25),
                     endpoint=server.connection.endpoint)
    made._thread.join(60)
    assert made.state == "failed" and made.error and made.picture is None


def test_a_server_is_found_or_started(server, monkeypatch):
    from limber_blender import live
    for given in ({"endpoint": server.connection.endpoint}, {}):
        monkeypatch.setenv("LIMBER_ENDPOINT", server.connection.endpoint)
        with live.find_server(**given) as found:
            assert found.connection.endpoint == server.connection.endpoint
    monkeypatch.setenv("LIMBER_ENDPOINT", "tcp://127.0.0.1:9")  # nobody answers there
    with live.find_server() as started:
        assert isinstance(started, limber.LaunchedServer) and started.process.poll() is None
    assert started.process.poll() is not None
    with pytest.raises(limber.ServerUnreachable):
        live.find_server("tcp://127.0.0.1:9")


@pytest.mark.parametrize("start, scene_rate, rate", [(1, 24, 24), (11, 30, 30), (1, 48, 24), (101, 23.976, 60)])
def test_frames_of_the_timeline(start, scene_rate, rate):
    from limber_blender.frames import Clock
    clock = Clock(start, scene_rate, rate, 50)
    assert clock.motion_frame(start) == 0 and clock.motion_frame(start - 5) == 0 and clock.motion_frame(1e6) == 49
    for frame in (0, 7, 49):
        assert clock.motion_frame(clock.timeline_frame(frame)) == pytest.approx(frame)
        assert clock.edited_frame(clock.timeline_frame(frame)) == frame
    for frame in (-1, 50, 1000):
        assert clock.edited_frame(clock.timeline_frame(frame)) is None
    assert clock.motion_frame(start + 0.5 * scene_rate) == pytest.approx(0.5 * rate)


def make_zip(folder):
    done = subprocess.run([sys.executable, ROOT / "clients" / "blender" / "make_zip.py", folder / "addon.zip"],
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder / "addon.zip"


def test_the_zip_has_the_add_on_and_the_client(tmp_path):
    names = zipfile.ZipFile(make_zip(tmp_path)).namelist()
    assert {"limber_blender/__init__.py", "limber_blender/lib/limber/v1/service_pb2.py", "limber_blender/LICENSE"} <= set(names)
    assert all(name.startswith("limber_blender/") for name in names)


@pytest.mark.timeout(280)
def test_in_blender(server, tmp_path):
    """tests/integration/blender_session.py does what an artist would, and tells what it saw."""
    blender = shutil.which("blender")
    if blender is None:
        pytest.skip("blender is not installed (apt-get install blender)")
    drawn = SHARED / "data" / "surfaces" / "spot.obj"
    if not drawn.is_file():
        pytest.skip(f"no {drawn} (set LIMBER_SHARED)")
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    environment |= {"BLENDER_USER_SCRIPTS": str(tmp_path / "scripts"), "BLENDER_USER_CONFIG": str(tmp_path / "config")}
    (tmp_path / "scripts" / "addons").mkdir(parents=True)
    done = subprocess.run([blender, "--background", "--factory-startup", "--python-exit-code", "1", "--python",
                           ROOT / "tests" / "integration" / "blender_session.py", "--", make_zip(tmp_path), drawn,
                           server.connection.endpoint, tmp_path], capture_output=True, text=True, timeout=270, env=environment)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    seen = json.loads((tmp_path / "seen.json").read_text())
    assert seen["client"].startswith(str(tmp_path)), "the client in the zip is used"
    assert seen["vertices"] == [2930] * 4
    assert seen["kept"] == {"loops": True, "uv": True, "materials": True}
    # Keys in 30 and 45 of a timeline of 10 to 69; those in 2, 9, 70 and 90 are outside of it.
    assert seen["wished_frames"] == [20, 35] and seen["constraint_frames"] == [20, 35]
    assert seen["wished_outside"] == [20, 35], "the current frame is outside, too"
    assert "outside of the motion" in seen["handle_outside"]
    # The node beside the vertex is held, which turns with the body.
    assert seen["drag_moved"] > 0.3 and seen["miss"] < 0.15 * seen["drag_moved"]
    assert seen["early_states"] <= 0.01 and seen["before_start"] <= 1e-4
    assert seen["keys_error"] <= seen["keys_told"] * 1.05 + 1e-6 and 0 < seen["keys"] <= 40
    assert seen["pc2_error"] < 1e-5 and seen["mdd_error"] < 1e-5 and seen["faster_error"] < 1e-5
    assert seen["stopped"] == 0
    assert not [status for status in server.sessions() if status.name == "spot"]
