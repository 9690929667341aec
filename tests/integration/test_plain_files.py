"""Files that are opened without a scene: what they are is known, and what is assumed is reported."""

import contextlib
import itertools
import pathlib
import re

import limber
import numpy as np
import pytest

CELLS = 2  # along each side of a cube


def split_cube():
    """Gmsh 2.2: each cell as six tets around its diagonal."""
    def node(*place):
        return 1 + place[0] + (CELLS + 1) * (place[1] + (CELLS + 1) * place[2])

    side = range(CELLS + 1)
    nodes = [f"{node(x, y, z)} {x} {y} {z}" for z in side for y in side for x in side]
    tets = []
    for cell in itertools.product(range(CELLS), repeat=3):
        for order in itertools.permutations(range(3)):
            corners = [np.array(cell)]
            for axis in order:
                corners.append(corners[-1] + np.eye(3, dtype=int)[axis])
            tets.append(f"{len(tets) + 1} 4 2 0 0 " + " ".join(str(node(*corner)) for corner in corners))
    return "\n".join(["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(nodes)), *nodes, "$EndNodes", "$Elements",
                      str(len(tets)), *tets, "$EndElements", ""])


@pytest.fixture
def mesh(tmp_path):
    path = tmp_path / "cube.msh"
    path.write_text(split_cube())
    return path


@pytest.fixture
def surface(tmp_path):
    points = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 3)]
    faces = [(1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6)]
    triangles = [face for a, b, c, d in faces for face in ((a, b, c), (a, c, d))]
    path = tmp_path / "box.obj"
    path.write_text("".join(f"v {x} {y} {z}\n" for x, y, z in points)
                    + "".join(f"f {a} {b} {c}\n" for a, b, c in triangles))
    return path


@pytest.fixture
def lines(tmp_path):
    """Two rods by two: a scissor that opens."""
    path = tmp_path / "scissor.obj"
    points = [(0, 0), (2, 0), (4, 0), (1, 1), (3, 1), (0, 2), (2, 2), (4, 2)]
    path.write_text("".join(f"v {x} {y} 0\n" for x, y in points) + "l 1 4 7\nl 2 5 8\nl 6 4 2\nl 7 5 3\n")
    return path


def test_a_mesh_opens_with_defaults_that_are_reported(cli, server, mesh):
    opened = cli("open", mesh, "--session", "cube")
    assert opened.returncode == 0, opened.stderr
    assert "cube.msh is opened as an elastic body of which nothing is fixed, 120 frames" in opened.stderr
    assert "Young's modulus 1e+06 Pa" in opened.stderr
    server.session("cube").close()
    with contextlib.closing(server.open(mesh)) as session:
        assert any("an elastic body of which nothing is fixed, 120 frames" in issue for issue in session.issues)
        assert session.frames().shape == (120, (CELLS + 1) ** 3, 3)


def test_a_surface_is_filled_with_tets(cli, server, surface):
    opened = cli("open", surface, "--session", "box")
    assert opened.returncode == 0, opened.stderr
    assert "box.obj is opened as an elastic body" in opened.stderr
    assert re.search(r"note: \d+ tets fill the surface; distance: surface to mesh [0-9.e-]+, mesh to surface", opened.stderr)
    attached = server.session("box")
    assert np.allclose(np.ptp(attached.geometry().rest, axis=0), [3, 1, 1], atol=0.1)
    attached.close()
    with contextlib.closing(server.open(surface)) as session:
        assert len(session.geometry().tets) > 100


def test_how_many_tets_fill_a_surface_is_chosen(cli, server, surface, mesh):
    opened = cli("open", surface, "--session", "coarse", "--tets", 300, "--within", 0.3)
    assert opened.returncode == 0, opened.stderr
    attached = server.session("coarse")
    coarse = len(attached.geometry().tets)
    attached.close()
    with contextlib.closing(server.open(surface, tets=3000)) as session:
        assert coarse < 900 < len(session.geometry().tets)
    refused = cli("open", mesh, "--tets", 300)
    assert refused.returncode == 1 and "for a closed surface" in refused.stderr
    with pytest.raises(limber.LimberError, match="for a closed surface"):
        server.open(mesh, within=0.1)


@pytest.mark.parametrize("tets", [3, 100_000_000])
def test_a_number_of_tets_that_is_refused_is_named_as_it_was_typed(cli, surface, tets):
    refused = cli("open", surface, "--tets", tets)
    assert refused.returncode == 1 and "(field --tets)" in refused.stderr, refused.stderr
    assert "target_tets" not in refused.stderr


def test_lines_of_a_job_are_pointed_to_its_folder(cli, server, tmp_path):
    (tmp_path / "SimulationJob.json").write_text("{}")
    lines = tmp_path / "roof.ply"
    lines.write_text("ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
                     "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n0 0 0\n1 0 0\n0 1\n")
    refused = cli("open", lines)
    assert refused.returncode == 1 and f"{tmp_path} is a job of the public relaxation code" in refused.stderr
    with pytest.raises(limber.LimberError, match="open the folder"):
        server.open(lines)


def test_lines_open_as_a_linkage(cli, server, lines):
    opened = cli("open", lines, "--session", "scissor")
    assert opened.returncode == 0, opened.stderr
    assert "scissor.obj is opened as a rod linkage of laths 0.141 wide and 0.0707 high" in opened.stderr
    server.session("scissor").close()
    with contextlib.closing(server.open(lines)) as session:
        assert any("a rod linkage of laths 0.141 wide" in issue for issue in session.issues)


def test_optimise_may_be_spelt_with_z_and_unknown_options_are_named(cli, server, mesh):
    opened = cli("open", mesh, "--session", "z", "--optimize", "dynamics")
    assert opened.returncode == 0, opened.stderr
    server.session("z").close()
    refused = cli("open", mesh, "--optimist", "all")
    assert refused.returncode == 2
    assert "--optimist" in refused.stderr


def test_other_files_are_still_reported_to_be_no_scene(cli, server, tmp_path):
    path = pathlib.Path(tmp_path / "notes.txt")
    path.write_text("not a scene")
    refused = cli("open", path)
    assert refused.returncode == 1
    assert "notes.txt" in refused.stderr
