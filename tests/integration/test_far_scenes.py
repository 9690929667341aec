"""Scenes far from their origin: frames, geometry and files keep the digits of positions."""

import json
import struct
import subprocess

import limber
import numpy as np
import pytest
from conftest import bar, small_scene

OFFSET = np.array([5e5, 4.6e6, 100.0])
SIZE = 3.0


def far_scene(offset=OFFSET, **options):
    nodes, tets = bar()
    nodes = np.array(nodes) + offset
    held = [i for i, node in enumerate(bar()[0]) if node[0] == 0]
    return limber.scene_from_arrays(nodes, tets, frames=40, fixed_nodes=held, modes=8, tolerance=0.05,
                                    youngs_modulus=1e5, period_frames=25, **options), nodes


@pytest.fixture(scope="module")
def far(server):
    scene, nodes = far_scene()
    session = server.open(scene, progress=False)
    tip = len(nodes) - 1
    target = nodes[tip] + [0, 0.5, 0.2]
    session.add(frame=20, node=tip, position=tuple(target), exact=True)
    session.wait(until="checked")
    yield session, nodes, tip, target
    session.close()


@pytest.mark.parametrize("encoding", [None, "positions"])
def test_an_exact_target_is_met_in_the_frames_that_a_client_gets(far, encoding):
    session, _, tip, target = far
    frames = session.frames(encoding=encoding)
    assert frames.dtype == np.float64
    assert np.linalg.norm(frames[20, tip] - target) < 1e-6 * SIZE


def test_quantised_frames_are_off_by_what_they_say(far):
    session, _, tip, target = far
    raw = session.raw_frames(encoding="quantised")
    frames = session.frames(encoding="quantised")
    assert np.abs(frames[20, tip] - target).max() < raw.quantisation_error + 1e-6 * SIZE


def test_the_rest_shape_is_where_it_was_sent(far):
    session, nodes, _, _ = far
    assert np.abs(session.geometry().rest - nodes).max() == 0


def test_streams_are_as_far(far):
    session, nodes, tip, target = far
    for encoding in ("coordinates", "positions"):
        with session.stream(encoding=encoding) as stream:
            shown = next(iter(stream)).positions
        assert np.linalg.norm(shown[20, tip] - target) < 1e-6 * SIZE, encoding


def test_near_the_origin_everything_is_single_precision_as_before(server):
    session = server.open(small_scene(), progress=False)
    assert session.geometry().rest.dtype == session.frames().dtype == np.float32
    assert session.frames(encoding="positions").dtype == session.frames(encoding="quantised").dtype == np.float32
    session.close()


def test_the_motion_is_that_of_the_same_body_at_the_origin(server, far):
    session, nodes, tip, target = far
    scene, rest = far_scene(offset=0)
    near = server.open(scene, progress=False)
    near.add(frame=20, node=tip, position=tuple(target - OFFSET), exact=True)
    near.wait(until="checked")
    assert np.abs(session.frames() - OFFSET - near.frames()).max() < 1e-5 * SIZE
    near.close()


def test_files_are_relative_to_the_body_or_double(far, tmp_path):
    session, nodes, tip, target = far
    session.save(tmp_path / "m.pc2")
    header = (tmp_path / "m_surface.obj").read_text().splitlines()
    line = next(line for line in header if line.startswith("# relative to "))
    origin = np.array([float(word) for word in line.split()[3:]])
    content = (tmp_path / "m.pc2").read_bytes()
    vertices, frames = struct.unpack("<i", content[16:20])[0], struct.unpack("<i", content[28:32])[0]
    shapes = np.frombuffer(content, "<f4", offset=32).reshape(frames, vertices, 3).astype(float) + origin
    assert np.linalg.norm(shapes[20] - target, axis=1).min() < 1e-6 * SIZE
    session.save(tmp_path / "m.glb")
    glb = (tmp_path / "m.glb").read_bytes()
    document = json.loads(glb[20:20 + struct.unpack("<I", glb[12:16])[0]])
    assert np.abs(np.array(document["nodes"][0]["translation"])).max() > 1e5
    assert max(document["accessors"][0]["max"]) < 2 * SIZE
    session.save(tmp_path / "m.csv", nodes=[tip])
    row = (tmp_path / "m.csv").read_text().splitlines()[21].split(",")
    assert np.linalg.norm(np.array([float(word) for word in row[3:]]) - target) < 1e-6 * SIZE


def test_a_page_of_the_motion_is_relative_to_its_middle(far, tmp_path):
    session, _, _, _ = far
    try:
        saved = session.save_html(tmp_path / "m.html")
    except limber.LimberError as error:
        pytest.skip(str(error))
    assert saved.error < 1e-3 * SIZE


def test_exports_of_the_server_are_relative_or_double(far, tmp_path):
    session, nodes, tip, target = far
    files = session.export(tmp_path, ["pvd", "blender"], stem="e").files
    meshio = pytest.importorskip("meshio")
    frame = next(file for file in files if file.name == "e_00020.vtu")
    assert np.linalg.norm(meshio.read(frame).points[tip] - target) < 1e-6 * SIZE
    obj = (tmp_path / "e_surface.obj").read_text()
    assert obj.startswith("# relative to ")
    origin = np.array([float(word) for word in obj.splitlines()[0].split()[3:]])
    first = np.array([float(word) for word in next(line for line in obj.splitlines() if line.startswith("v ")).split()[1:]])
    assert np.abs(nodes - (first + origin)).sum(axis=1).min() < 1e-6


def test_a_base_motion_comes_back_through_a_scene_file(server, tmp_path):
    scene, nodes = far_scene()
    motion = nodes + 0.01 * np.sin(np.arange(40) / 5)[:, None, None] * (nodes - nodes.min(axis=0))
    scene, _ = far_scene(base_motion=motion)
    session = server.open(scene, progress=False)
    session.export(tmp_path, ["scene"], stem="s")
    again = server.open(limber.load_scene(tmp_path / "s.json"), progress=False)
    assert np.abs(again.frames() - session.frames()).max() < 1e-5 * SIZE
    again.close()
    session.close()


def test_simulated_motions_are_as_far(server):
    scene, nodes = far_scene()
    made = server.simulate(scene, limber.simulation(modes=[0.1], steps_per_frame=2), progress=False)
    near, rest = far_scene(offset=0)
    other = server.simulate(near, limber.simulation(modes=[0.1], steps_per_frame=2), progress=False)
    assert made.positions.dtype == np.float64
    assert np.abs(made.positions - OFFSET - other.positions).max() < 1e-5 * SIZE


def test_the_command_line_writes_all_digits(server, far, tmp_path):
    from limber.launching import find_binary
    session, nodes, tip, target = far
    for name in ("m.npy", "m.csv"):
        subprocess.run([find_binary("limber"), "--endpoint", server.connection.endpoint, "frames", session.id, "-o", tmp_path / name],
                       check=True, capture_output=True)
    assert np.linalg.norm(np.load(tmp_path / "m.npy")[20, tip] - target) < 1e-6 * SIZE
    rows = np.loadtxt(tmp_path / "m.csv", delimiter=",", skiprows=1)
    row = rows[(rows[:, 0] == 20) & (rows[:, 1] == tip)][0]
    assert np.linalg.norm(row[2:] - target) < 1e-6 * SIZE


def linkage_lines(offset):
    vertices = np.array([[x, y, 0.0] for x in range(3) for y in range(3)]) + offset
    edges = [(3 * x + y, 3 * x + y + 1) for x in range(3) for y in range(2)] + \
            [(3 * x + y, 3 * x + y + 3) for x in range(2) for y in range(3)]
    return vertices, np.array(edges)


def test_linkages_are_as_far(server):
    offset = np.array([0.0, 3e3, 0.0])
    shapes = []
    for at in (0 * offset, offset):
        vertices, edges = linkage_lines(at)
        scene = limber.linkage_scene(vertices, edges, section={"rectangle": (0.1, 0.02)})
        opened = server.open(scene, progress=False)
        opened.wait()
        shapes.append((opened.frames()[-1] - at, opened.frames(encoding="positions")[-1] - at,
                       opened.frames(encoding="quantised")[-1] - at))
        opened.close()
    for near, far in zip(*shapes):
        assert far.dtype == np.float64 and np.abs(near - far).max() < 2e-4
