"""Detailed surfaces that bodies carry: with their own vertices in their order, texture coordinates and materials."""

import contextlib
import os
import struct
from pathlib import Path

import limber
import meshio
import numpy as np
import pytest
from design_inputs import write_glb, write_off

ROOT = Path(__file__).resolve().parents[2]
SPOT = Path(os.environ.get("LIMBER_SHARED", ROOT.parent / "shared")) / "data" / "surfaces" / "spot.obj"

BOX = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 3)], dtype=float)
TRIANGLES = np.array([(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2),
                      (1, 3, 7), (1, 7, 5)])
OBJ = """# a box whose corners are split for its texture
mtllib paint.mtl
v 0 0 0
v 3 0 0
v 0 1 0
v 3 1 0
v 0 0 1
v 3 0 1
v 0 1 1
v 3 1 1
v 1.5 0.5 1.02
vt 0 0
vt 1 0
vt 0 1
usemtl red
f 1/1 3/2 4/3 2/1
f 5 6 8 7
f 1 2 6 5
f 3 7 8 4
usemtl blue
f 1 5 7 3
f 2 4 8 6
"""


@pytest.fixture
def box(tmp_path):
    (tmp_path / "paint.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n")
    path = tmp_path / "box.obj"
    path.write_text(OBJ)  # vertex 9 belongs to no face
    return path


def bent(session):
    """Ends held, the middle pushed."""
    rest = session.geometry().rest
    ends = np.flatnonzero((rest[:, 0] < 0.05) | (rest[:, 0] > 2.95))
    middle = int(np.argmin(np.linalg.norm(rest - [1.5, 0.5, 1], axis=1)))
    session.add(frame=20, nodes=ends.tolist(), displacement=(0, 0, 0))
    session.add(frame=20, nodes=[middle], displacement=(0, 0, 0.3))
    session.wait(timeout=120)


def read_pc2(path):
    data = path.read_bytes()
    _, _, points, _, _, samples = struct.unpack_from("<12siiffi", data)
    return np.frombuffer(data, np.float32, offset=32).reshape(samples, points, 3)


def test_a_filled_surface_is_carried_with_its_own_vertices(server, box, tmp_path):
    with contextlib.closing(server.open(box, tets=800)) as session:
        bent(session)
        surface = session.carried_surface()
        assert surface.vertices.shape == (9, 3)
        assert np.allclose(surface.vertices[8], [1.5, 0.5, 1.02])
        nodes = session.frames()
        shown = session.frames(encoding="surface")
        assert shown.shape == (120, 9, 3)
        assert np.allclose(shown, surface.positions(nodes), atol=1e-5)
        assert np.abs(shown[20] - surface.vertices).max() > 0.1, "nothing moved"
        session.export(tmp_path / "out", ("surface",), stem="bent")
        assert (tmp_path / "out" / "bent_detail.obj").read_text() == OBJ
        assert (tmp_path / "out" / "paint.mtl").read_bytes() == box.with_name("paint.mtl").read_bytes()
        assert np.allclose(read_pc2(tmp_path / "out" / "bent_detail.pc2"), shown, atol=1e-5)


def test_a_surface_is_streamed_where_somebody_subscribes(server, box):
    with contextlib.closing(server.open(box, tets=800)) as session:
        with session.stream(encoding="surface", timeout=30) as stream:
            frames = next(iter(stream))
            assert frames.positions.shape == (120, 9, 3)


def test_scenes_are_exported_and_opened_again_with_their_surface(server, cli, box, tmp_path):
    with contextlib.closing(server.open(box, tets=800)) as session:
        session.export(tmp_path / "out", ("scene",), stem="kept")
    with contextlib.closing(server.open(tmp_path / "out" / "kept.json")) as again:
        assert again.carried_surface().vertices.shape == (9, 3)
        again.export(tmp_path / "twice", ("surface",), stem="kept")
        assert (tmp_path / "twice" / "kept_detail.obj").read_text() == OBJ


def test_tetrahedralize_keeps_the_surface_beside_the_tets(server, cli, box, tmp_path):
    made = cli("tetrahedralize", box, "-o", tmp_path / "filled.msh", "--tets", 800)
    assert made.returncode == 0, made.stderr
    assert (tmp_path / "filled.surface.obj").read_text() == OBJ
    opened = cli("open", tmp_path / "filled.msh", "--session", "filled")
    assert opened.returncode == 0, opened.stderr
    with contextlib.closing(server.session("filled")) as session:
        assert len(session.carried_surface().vertices) == 9
        exported = cli("export", "filled", "--format", "surface", "--out", tmp_path / "files")
        assert exported.returncode == 0, exported.stderr
        assert (tmp_path / "files" / "motion_detail.obj").read_text() == OBJ
    with contextlib.closing(server.open(tmp_path / "filled.msh")) as session:
        assert len(session.carried_surface().vertices) == 9


@pytest.mark.parametrize("kind, write", [("off", write_off), ("glb", write_glb)])
def test_other_formats_are_filled_and_carried(server, cli, tmp_path, kind, write):
    """In Python and at the command line; what is exported has the triangles of the file."""
    write(tmp_path / f"box.{kind}", BOX, TRIANGLES)
    with contextlib.closing(server.open(tmp_path / f"box.{kind}", tets=800, progress=False)) as session:
        surface = session.carried_surface()
        assert surface.name == f"box.{kind}" and len(surface.vertices) == 8
        corners = np.asarray(surface.vertices)[surface.triangles]
        volume = np.einsum("ti,ti->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
        assert len(corners) == 12 and volume == pytest.approx(3, rel=1e-6)
        session.export(tmp_path / "out", ("surface", "scene"), stem="box")
        assert sum(line.startswith("f ") for line in (tmp_path / "out" / "box_detail.obj").read_text().splitlines()) == 12
    with contextlib.closing(server.open(tmp_path / "out" / "box.json", progress=False)) as session:
        assert session.carried_surface().name == f"box_surface_given.{kind}"
    made = cli("tetrahedralize", tmp_path / f"box.{kind}", "-o", tmp_path / "filled.msh", "--tets", 800)
    assert made.returncode == 0, made.stderr
    assert (tmp_path / f"filled.surface.{kind}").read_bytes() == (tmp_path / f"box.{kind}").read_bytes()
    for file in ("filled.msh", f"box.{kind}"):
        opened = cli("open", tmp_path / file, "--session", "filled")
        assert opened.returncode == 0, opened.stderr
        with contextlib.closing(server.session("filled")) as session:
            assert len(session.carried_surface().vertices) == 8


def test_a_scene_without_a_surface_says_so(server):
    with contextlib.closing(server.open(sample="beam")) as session:
        for call in (session.carried_surface, lambda: session.frames(encoding="surface"),
                     lambda: session.export("unused", ("surface",))):
            with pytest.raises(limber.LimberError, match="names no surface"):
                call()
    with contextlib.closing(server.open(sample="hyperboloid")) as linkage:
        with pytest.raises(limber.LimberError, match="names no surface"):
            linkage.frames(encoding="surface")


def test_a_surface_beside_the_body_is_warned_of(server, box, tmp_path):
    far = tmp_path / "far.obj"
    far.write_text(OBJ.replace("v 1.5 0.5 1.02", "v 1.5 0.5 9"))
    scene = limber.scene_from_mesh(_tets(server, box), frames=30, surface=far)
    with contextlib.closing(server.open(scene)) as session:
        assert any("surface" in issue and "lie outside the mesh" in issue for issue in session.issues)


def _tets(server, box):
    filled = server.tetrahedralize(box, tets=800)
    return meshio.Mesh(filled.nodes, [("tetra", filled.tets)])


@pytest.mark.parametrize("text,part", [("v 0 0 0\nv 1 0 0\n", "surface"), ("v a b c\n", "surface"),
                                       ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n", "surface")])
def test_a_surface_that_is_none_is_refused_by_its_field(server, box, tmp_path, text, part):
    bad = tmp_path / "bad.obj"
    bad.write_text(text)
    scene = limber.scene_from_mesh(_tets(server, box), frames=30, surface=bad)
    with pytest.raises(limber.LimberError) as refused:
        server.open(scene)
    assert part in refused.value.field


@pytest.mark.skipif(not SPOT.exists(), reason=f"no {SPOT} (set LIMBER_SHARED)")
def test_every_vertex_of_a_public_surface_keeps_its_place(server, tmp_path):
    """2930 vertices, of which a format of nodes would keep none."""
    with contextlib.closing(server.open(SPOT, timeout=300)) as session:
        given = np.array([line.split()[1:4] for line in SPOT.read_text().splitlines() if line.startswith("v ")], float)
        surface = session.carried_surface()
        assert surface.vertices.shape == (2930, 3)
        assert np.allclose(surface.vertices, given, atol=1e-6)
        rest = surface.positions(session.geometry().rest[None])[0]
        assert np.allclose(rest, given, atol=1e-5 * np.ptp(given))
        session.export(tmp_path, ("surface",), stem="spot")
        assert (tmp_path / "spot_detail.obj").read_bytes() == SPOT.read_bytes()
        assert read_pc2(tmp_path / "spot_detail.pc2").shape == (120, 2930, 3)


@pytest.mark.parametrize("name", ["..", "../x.mtl", "kept.vtu", ".mtl", ""])
def test_a_companion_that_is_no_material_file_is_refused(server, box, name):
    scene = limber.scene_from_mesh(_tets(server, box), frames=30, surface=box)
    scene.surface.file.companions[name] = b"x"
    with pytest.raises(limber.LimberError) as refused:
        server.open(scene)
    assert refused.value.field == "scene.surface.file.companions"
