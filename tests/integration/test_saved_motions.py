"""Files that the Python client makes of motions hold what the session holds."""

import contextlib
import csv
import os
import re
import struct
from pathlib import Path

import limber
import numpy as np
import pytest
from conftest import ROOT, small_scene, tip_of
from glb_files import played, read, shown, validate
from linkage_inputs import linkage  # noqa: F401
from refusals import refusal

SHARED = Path(os.environ.get("LIMBER_SHARED", ROOT.parent / "shared"))


@pytest.fixture
def flower(server):
    opened = server.open(sample="flower", progress=False)
    opened.wait()
    yield opened
    opened.close()


def surface_frames(session):
    nodes = np.unique(session.geometry().surface)
    return nodes, session.frames()[:, nodes]


def farthest(one, other):
    return np.linalg.norm(one - other, axis=2).max()


def test_glb_plays_the_motion_of_a_body(flower, tmp_path):
    saved = flower.save(tmp_path / "motion.glb")
    nodes, expected = surface_frames(flower)
    faces, positions, times = played(tmp_path / "motion.glb")
    size = np.linalg.norm(np.ptp(expected.reshape(-1, 3), axis=0))
    off = farthest(positions, expected)
    assert off == pytest.approx(saved.error, rel=1e-3, abs=1e-7 * size) and off <= 1e-4 * size
    assert (saved.frames, saved.vertices) == expected.shape[:2] and 1 < saved.targets < 60
    assert np.array_equal(nodes[faces], flower.geometry().surface)
    assert times == pytest.approx(np.arange(len(expected)) / flower.scene().dynamics.frames_per_second)
    document, values = read(tmp_path / "motion.glb")
    weights = values(document["animations"][0]["samplers"][0]["output"])
    assert 0 <= weights.min() and weights.max() == pytest.approx(1)
    report, = validate(tmp_path / "motion.glb")
    assert report["info"]["hasMorphTargets"] and report["info"]["animationCount"] == 1
    names = [document[kind][0]["name"] for kind in ("nodes", "meshes", "animations")]
    assert names == 3 * [flower.status().name] and document["scenes"][0]["name"] == flower.id


def test_glb_is_shaded_by_the_moved_surface(flower, tmp_path):
    """Normals are those of the triangles around a vertex, up to its sharp edges, in every frame."""
    flower.save(tmp_path / "motion.glb")
    faces, positions, _, normals = shown(tmp_path / "motion.glb")
    for frame in range(0, len(positions), 10):
        corners = positions[frame][faces]
        areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        sums = np.zeros(positions.shape[1:])
        np.add.at(sums, faces, areas[:, None])
        along = np.einsum("vi,vi->v", sums, normals[frame])
        off = np.degrees(np.arccos(np.clip(along / np.linalg.norm(sums, axis=1) / np.linalg.norm(normals[frame], axis=1), -1, 1)))
        assert np.quantile(off, 0.99) < 2 and off.max() < 20, frame
        assert 0.9 < np.linalg.norm(normals[frame], axis=1).min()


def test_short_motions_need_no_more_targets_than_frames(server, tmp_path):
    with contextlib.closing(server.open(small_scene(frames=8), progress=False)) as opened:
        opened.add(node=tip_of(opened), frame=4, displacement=(0, 0.4, 0.1))
        opened.wait()
        saved = opened.save(tmp_path / "short.glb", tolerance=1e-12)
        _, expected = surface_frames(opened)
        assert 0 < saved.targets < len(expected) == 8
        assert farthest(played(tmp_path / "short.glb")[1], expected) < 1e-6
        validate(tmp_path / "short.glb")


def test_tolerance_and_axes(session, tmp_path):
    session.add(node=tip_of(session), frame=30, displacement=(0, 0.3, 0.1))
    session.wait()
    coarse = session.save(tmp_path / "coarse.glb", tolerance=0.02, up="z")
    fine = session.save(tmp_path / "fine.glb", tolerance=1e-6, frames_per_second=10)
    _, expected = surface_frames(session)
    size = np.linalg.norm(np.ptp(expected.reshape(-1, 3), axis=0))
    assert coarse.targets < fine.targets and fine.error <= 1e-6 * size < coarse.error <= 0.02 * size
    assert farthest(played(tmp_path / "coarse.glb")[1], expected) == pytest.approx(coarse.error, rel=1e-3)
    assert farthest(played(tmp_path / "fine.glb")[1], expected) <= 1e-6 * size
    assert played(tmp_path / "fine.glb")[2][-1] == pytest.approx((len(expected) - 1) / 10)
    nodes = [read(tmp_path / name)[0]["nodes"][0] for name in ("coarse.glb", "fine.glb")]
    x, y, z, w = nodes[0]["rotation"]
    up = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])  # of (0, 0, 1)
    assert up == pytest.approx([0, 1, 0]) and nodes[1]["rotation"] == [0, 0, 0, 1] and nodes[0]["scale"] == [1, 1, 1]
    validate(tmp_path / "coarse.glb", tmp_path / "fine.glb")


def test_long_motions(server, tmp_path):
    """More frames than targets are made of at once."""
    opened = server.open(small_scene(frames=900), progress=False)
    for frame, up in ((200, 0.3), (500, -0.4), (777, 0.2)):
        opened.add(node=tip_of(opened), frame=frame, displacement=(0, up, 0.1))
    opened.wait()
    saved = opened.save(tmp_path / "long.glb")
    _, expected = surface_frames(opened)
    assert farthest(played(tmp_path / "long.glb")[1], expected) == pytest.approx(saved.error, rel=1e-3)
    assert saved.error <= 1e-4 * np.linalg.norm(np.ptp(expected.reshape(-1, 3), axis=0))
    opened.close()


def test_glb_of_linkages_and_beams(server, linkage, tmp_path):  # noqa: F811
    linkage.deploy(60)
    linkage.wait()
    saved = linkage.save(tmp_path / "linkage.glb", tolerance=1e-3)
    faces, positions, times = played(tmp_path / "linkage.glb")
    expected = linkage.frames()
    assert np.array_equal(faces, linkage.geometry().surface) and len(times) == len(expected) > 5
    assert farthest(positions, expected) == pytest.approx(saved.error, rel=1e-3)

    beams = server.open(arch(), progress=False)
    beams.move_support(8, x=-0.3)
    beams.wait()
    saved = beams.save(tmp_path / "beams.glb")
    faces, positions, _ = played(tmp_path / "beams.glb")
    points = beams.frames(encoding="coordinates").reshape(len(positions), -1, 7)[:, :, :3]
    # Four corners around each end of each element, w x h apart.
    corners = positions.reshape(len(positions), len(beams.geometry().elements), 2, 4, 3)
    ends = points[:, beams.geometry().elements]
    assert np.abs(corners.mean(axis=3) - ends).max() < 1e-3 * np.ptp(points)
    assert np.linalg.norm(corners[:, :, :, 1] - corners[:, :, :, 0], axis=-1) == pytest.approx(0.04, rel=0.02)
    assert np.linalg.norm(corners[:, :, :, 2] - corners[:, :, :, 1], axis=-1) == pytest.approx(0.004, rel=0.2)
    first = positions[0]
    volume = np.einsum("ti,ti->", first[faces[:, 0]], np.cross(first[faces[:, 1]], first[faces[:, 2]])) / 6
    assert volume == pytest.approx(0.04 * 0.004 * np.linalg.norm(np.diff(ends[0], axis=1), axis=-1).sum(), rel=0.05)
    assert saved.frames > 1 and saved.targets > 0
    validate(tmp_path / "linkage.glb", tmp_path / "beams.glb")
    beams.close()


def arch():
    """Eight elements, held at both ends."""
    held = {f"fix_{kind}{axis}": True for kind in ("", "rotation_") for axis in "xyz"}
    return {"nodes": [{"position": {"x": i / 8, "z": 0.4 * (i / 8) * (1 - i / 8)}} for i in range(9)],
            "sections": [{"rectangle": {"width": 0.04, "height": 0.004}, "young": 10e9, "poisson": 0.3}],
            "elements": [{"start": i, "finish": i + 1} for i in range(8)],
            "supports": [{"node": 0, **held}, {"node": 8, **held}]}


def test_caches(flower, tmp_path):
    _, expected = surface_frames(flower)
    for name in ("a.mdd", "b.pc2"):
        saved = flower.save(tmp_path / name)
        content = saved.files[0].read_bytes()
        if name.endswith(".mdd"):
            assert struct.unpack_from(">ii", content) == expected.shape[:2]
            times = np.frombuffer(content, ">f4", len(expected), 8)
            assert times[1] == pytest.approx(1 / flower.scene().dynamics.frames_per_second)
            shapes = np.frombuffer(content, ">f4", offset=8 + 4 * len(expected)).reshape(expected.shape)
        else:
            assert struct.unpack_from("<12siiffi", content) == (b"POINTCACHE2\0", 1, expected.shape[1], 0, 1, len(expected))
            shapes = np.frombuffer(content, "<f4", offset=32).reshape(expected.shape)
        assert np.array_equal(shapes, expected)
        words = [line.split() for line in saved.files[1].read_text().splitlines()]
        assert np.allclose(np.array([word[1:] for word in words if word[0] == "v"], dtype=float), expected[0], rtol=1e-7)
        assert sum(word[0] == "f" for word in words) == len(flower.geometry().surface)


def test_series_for_paraview(server, session, tmp_path):
    meshio = pytest.importorskip("meshio")
    session.add(node=tip_of(session), frame=30, displacement=(0, 0.3, 0.1))
    session.wait()
    saved = session.save(tmp_path / "body.pvd")
    _, expected = surface_frames(session)
    listed = re.findall(r'timestep="(.*?)" file="(.*?)"', saved.files[0].read_text())
    assert [tmp_path / name for _, name in listed] == list(saved.files[1:]) and len(listed) == len(expected)
    assert float(listed[30][0]) == pytest.approx(30 / session.scene().dynamics.frames_per_second)
    mesh = meshio.read(saved.files[31])
    assert np.array_equal(mesh.points, expected[30]) and len(mesh.cells_dict["triangle"]) == len(session.geometry().surface)
    assert np.allclose(mesh.point_data["displacement"], expected[30] - expected[0])
    beams = server.open(arch(), progress=False)
    beams.move_support(8, x=-0.3)
    beams.wait()
    assert len(beams.save(tmp_path / "beams.pvd").files) == 1 + len(beams.frames())
    beams.close()


def test_tables(session, linkage, tmp_path):  # noqa: F811
    tip = tip_of(session)
    session.save(tmp_path / "tip.csv", nodes=[tip, 0])
    rows = list(csv.DictReader(open(tmp_path / "tip.csv")))
    expected, rate = session.frames(), session.scene().dynamics.frames_per_second
    assert len(rows) == 2 * len(expected)
    for row in rows:
        frame, node = int(row["frame"]), int(row["node"])
        assert [float(row[axis]) for axis in "xyz"] == pytest.approx(expected[frame, node], rel=1e-6, abs=1e-9)
        assert float(row["time_s"]) == pytest.approx(frame / rate)
    saved = linkage.save(tmp_path / "joints.csv")
    assert saved.vertices == linkage.joint_count() and (tmp_path / "joints.csv").read_text().startswith("frame,time_s,joint,")


def test_what_is_refused(session, tmp_path):
    assert refusal(lambda: session.save(tmp_path / "motion.abc")) == ("INVALID_ARGUMENT", "path")
    assert refusal(lambda: session.save(tmp_path / "motion.glb", tolerance=0)) == ("INVALID_ARGUMENT", "tolerance")
    assert refusal(lambda: session.save(tmp_path / "motion.glb", up="x")) == ("INVALID_ARGUMENT", "up")
    assert refusal(lambda: session.save(tmp_path / "motion.csv", nodes=[10 ** 6])) == ("OUT_OF_RANGE", "nodes")
    assert refusal(lambda: session.save(tmp_path / "motion.glb", nodes=[1])) == ("INVALID_ARGUMENT", "nodes")
    assert refusal(lambda: session.save(tmp_path / "no" / "motion.glb")) == ("IO", "path")


def test_a_drawn_surface_keeps_its_vertices(server, tmp_path):
    """All of an artist's vertices in their order, with texture coordinates and materials."""
    drawn = SHARED / "data" / "surfaces" / "spot.obj"
    if not drawn.is_file():
        pytest.skip(f"no {drawn} (set LIMBER_SHARED)")
    surface = tmp_path / "spot.obj"
    (tmp_path / "spot.mtl").write_text("newmtl coat\nKd 1 0.5 0.25\nnewmtl legs\nd 0.5\n")
    lines = drawn.read_text().splitlines()
    faces = [i for i, line in enumerate(lines) if line.startswith("f ")]
    lines[faces[1000]:faces[1000]] = ["usemtl legs"]
    lines[faces[0]:faces[0]] = ["usemtl coat"]
    surface.write_text("mtllib spot.mtl\n" + "\n".join(lines) + "\n")
    words = [line.split() for line in surface.read_text().splitlines()]
    vertices = np.array([word[1:4] for word in words if word[:1] == ["v"]], dtype=float)
    texcoords = np.array([word[1:3] for word in words if word[:1] == ["vt"]], dtype=float)
    filled = server.tetrahedralize(surface, tets=3000, within=1)
    held = np.flatnonzero(filled.nodes[:, 1] < np.quantile(filled.nodes[:, 1], 0.05))
    opened = server.open(limber.scene_from_arrays(filled.nodes, filled.tets, frames=40, fixed_nodes=held, modes=10,
                                                  tolerance=0.2, youngs_modulus=1e5, surface=surface), progress=False)
    opened.add(node=int(filled.nodes[:, 1].argmax()), frame=20, displacement=(0.2, 0.05, 0))
    opened.wait()

    out = tmp_path / "out"
    out.mkdir()
    saved = opened.save(out / "moving.pc2")
    assert [file.name for file in saved] == ["moving.pc2", "moving_detail.obj", "spot.mtl"] and saved.vertices == 2930
    assert saved.files[1].read_bytes() == surface.read_bytes()
    assert saved.files[2].read_bytes() == (tmp_path / "spot.mtl").read_bytes()
    shapes = np.frombuffer(saved.files[0].read_bytes(), "<f4", offset=32).reshape(40, 2930, 3)
    frames, geometry = opened.frames(), opened.geometry()
    rest = geometry.rest
    assert np.allclose(shapes, opened.frames(encoding="surface"), atol=1e-5)
    assert opened.save(out / "tets.pc2", surface="nodes").vertices == len(np.unique(geometry.surface))
    # They move as the node next to them, nearly.
    nearest = np.array([np.linalg.norm(rest - vertex, axis=1).argmin() for vertex in vertices])
    moved = frames[20, nearest] - rest[nearest]
    assert np.linalg.norm(moved, axis=1).max() > 0.1
    assert np.abs(shapes[20] - vertices - moved).max() < 0.05

    # The client's embedding is the server's, also outside; of tets that are equally near either may count.
    carried, embedded = opened.carried_surface(), limber.Embedding.of(vertices, rest, geometry.tets)
    assert carried.outside_count > 100
    assert embedded.distances.max() == pytest.approx(carried.outside_distance, rel=1e-4)
    apart = np.linalg.norm(embedded.positions(frames) - carried.positions(frames), axis=2).max(axis=0)
    is_same_tet = (np.sort(embedded.nodes, axis=1) == np.sort(carried.nodes, axis=1)).all(axis=1)
    assert is_same_tet.mean() > 0.9 and apart[is_same_tet].max() < 1e-5
    for vertex in np.flatnonzero(~is_same_tet):
        of_server = limber.Embedding.of(vertices[[vertex]], rest, carried.nodes[[vertex]])
        assert of_server.distances[0] == pytest.approx(embedded.distances[vertex], abs=1e-6)

    saved = opened.save(out / "moving.glb")
    document, values = read(out / "moving.glb")
    faces, positions, _, _ = shown(out / "moving.glb")
    coat, legs = document["materials"]
    assert (coat["name"], coat["pbrMetallicRoughness"]["baseColorFactor"]) == ("coat", [1, 0.5, 0.25, 1])
    assert (legs["name"], legs["alphaMode"]) == ("legs", "BLEND")
    parts = document["meshes"][0]["primitives"]
    assert [document["accessors"][part["indices"]]["count"] for part in parts] == [3 * 1000, 3 * 4856]
    coordinates = values(document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"]) * (1, -1) + (0, 1)
    corners = [part.split("/") for word in words if word[:1] == ["f"] for part in word[1:]]
    assert len(coordinates) == positions.shape[1] > 2930 and faces.size == len(corners) == 3 * 5856
    assert np.allclose(coordinates[faces.ravel()], texcoords[[int(t) - 1 for _, t, *_ in corners]], atol=1e-6)
    assert np.abs(positions[:, faces.ravel()] - shapes[:, [int(v) - 1 for v, *_ in corners]]).max() <= 1.01 * saved.error
    validate(out / "moving.glb")
    opened.close()


@pytest.fixture
def box(tmp_path):
    """An artist's .obj around the bar of small_scene(), with its materials."""
    (tmp_path / "coat.mtl").write_text("newmtl coat\nKd 1 0.5 0.25\n")
    path = tmp_path / "box.obj"
    corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 3)]
    faces = ["1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"]
    path.write_text("mtllib coat.mtl\n" + "".join("v {} {} {}\n".format(*corner) for corner in corners) + "usemtl coat\n"
                    + "".join(f"f {face}\n" for face in faces))
    return path


def test_no_file_of_others_is_replaced(session, box):
    drawn = box.read_bytes()
    saved = session.save(box.with_suffix(".pc2"), surface=box)
    assert [file.name for file in saved] == ["box.pc2", "box_detail.obj", "coat.mtl"] and box.read_bytes() == drawn
    assert [file.name for file in session.save(box.with_suffix(".mdd"))] == ["box.mdd", "box_surface.obj"]
    session.add(node=tip_of(session), frame=30, displacement=(0, 0.3, 0.1))
    session.wait()
    session.save(box.with_suffix(".mdd"))  # its own
    detail, cache = box.with_name("box_detail.obj"), box.with_suffix(".pc2").read_bytes()
    detail.write_bytes(drawn + b"# mine\n")
    assert refusal(lambda: session.save(box.with_suffix(".pc2"), surface=box)) == ("FAILED_PRECONDITION", "path")
    assert detail.read_bytes() == drawn + b"# mine\n" and box.with_suffix(".pc2").read_bytes() == cache
    box.with_name("box_surface.obj").write_bytes(drawn)
    assert refusal(lambda: session.save(box.with_suffix(".pc2"))) == ("FAILED_PRECONDITION", "path")
    assert box.with_name("box_surface.obj").read_bytes() == drawn


def test_carried_surfaces_of_other_formats(server, box):
    """The .obj is of their triangles; the artist's own one of the same vertices has the same motion."""
    words = [line.split() for line in box.read_text().splitlines()]
    vertices = [" ".join(word[1:]) for word in words if word[0] == "v"]
    faces = [f"{len(word) - 1} " + " ".join(str(int(corner) - 1) for corner in word[1:]) for word in words if word[0] == "f"]
    header = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}", *(f"property float {axis}" for axis in "xyz"),
              f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    drawn = box.with_name("drawn.ply")
    drawn.write_text("\n".join([*header, *vertices, *faces]) + "\n")
    with contextlib.closing(server.open(small_scene(surface=drawn), progress=False)) as opened:
        opened.add(node=tip_of(opened), frame=30, displacement=(0, 0.3, 0.1))
        opened.wait()
        saved = opened.save(box.with_name("a.pc2"))
        assert [file.name for file in saved] == ["a.pc2", "a_detail.obj"] and saved.vertices == 8
        again = opened.save(box.with_name("b.pc2"), surface=box)
        assert [file.name for file in again] == ["b.pc2", "b_detail.obj", "coat.mtl"]
        assert again.files[0].read_bytes() == saved.files[0].read_bytes()
        shapes = np.frombuffer(saved.files[0].read_bytes(), "<f4", offset=32).reshape(-1, 8, 3)
        assert np.abs(shapes - opened.frames(encoding="surface")).max() < 1e-5 and np.ptp(shapes, axis=0).max() > 0.2


def test_materials_are_those_beside_the_file_alone(session, box):
    """Names with folders in an .obj read nothing from there."""
    folder = box.parent / "given"
    folder.mkdir()
    (box.parent / "secret.mtl").write_text("newmtl coat\nKd 0 0 1\n")
    (folder / "coat.mtl").write_text("newmtl coat\nKd 0 1 0\n")
    drawn = folder / "box.obj"
    drawn.write_text(box.read_text().replace("mtllib coat.mtl", f"mtllib ../secret.mtl\nmtllib {box.parent}/secret.mtl\n"
                                             "mtllib ..\\coat.mtl\nmtllib ../coat.mtl\nmtllib .."))
    out = box.parent / "out"
    out.mkdir()
    assert [file.name for file in session.save(out / "a.pc2", surface=drawn)] == ["a.pc2", "a_detail.obj", "coat.mtl"]
    assert (out / "coat.mtl").read_bytes() == (folder / "coat.mtl").read_bytes()
    session.save(out / "a.glb", surface=drawn)
    (material,) = read(out / "a.glb")[0]["materials"]
    assert material["pbrMetallicRoughness"]["baseColorFactor"] == [0, 1, 0, 1]
