"""Constraints on points of surfaces: where the frames of a server show them, of the mesh's surface and of an artist's."""

import contextlib
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import limber
import numpy as np
import pytest
from conftest import small_scene, tip_of

ROOT = Path(__file__).resolve().parents[2]
SPOT = Path(os.environ.get("LIMBER_SHARED", ROOT.parent / "shared")) / "data" / "surfaces" / "spot.obj"
WEIGHTS = np.array((0.5, 0.2, 0.3))


def triangle_of_end(session):
    """Of the free end's face, the first."""
    geometry = session.geometry()
    return int(np.flatnonzero((geometry.rest[geometry.surface, 0] > 2.99).all(axis=1))[0])


def shown_on_mesh(session, triangle, weights, frame):
    corners = session.geometry().surface[triangle]
    return np.asarray(weights) @ session.frames()[frame][corners].astype(float)


def shown_vertices(session, frame):
    """Of the artist's mesh, as the server streams it."""
    return session.frames(frame, 1, encoding="surface")[0].astype(float)


def test_a_point_of_the_mesh_is_met_where_it_is_shown(session):
    triangle = triangle_of_end(session)
    rest = shown_on_mesh(session, triangle, WEIGHTS, 0)
    held = session.add(frame=30, surface_point=(triangle, WEIGHTS), position=rest + (0, 0.4, 0.1), exact=True)
    assert held.issues == () and held.nodes == () and held.surface_vertex is None
    assert (held.surface_point.triangle, held.surface_point.weights) == (triangle, tuple(WEIGHTS))
    assert session.wait().status == "CONVERGED"
    np.testing.assert_allclose(shown_on_mesh(session, triangle, WEIGHTS, 30) - rest, (0, 0.4, 0.1), atol=2e-6)
    for corner in np.eye(3):
        assert np.abs(shown_on_mesh(session, triangle, corner, 30) - rest - (0, 0.4, 0.1)).max() > 0.05, "a node was held"
    held.move(displacement=(0, 0.2, 0))
    session.wait()
    np.testing.assert_allclose(shown_on_mesh(session, triangle, WEIGHTS, 30) - rest, (0, 0.2, 0), atol=2e-6)
    tip = tip_of(session)
    held.replace(frame=30, node=tip, displacement=(0, -0.1, 0), exact=True)
    session.wait()
    assert held.surface_point is None and held.nodes == (tip,)
    session.undo()
    session.wait()
    np.testing.assert_allclose(shown_on_mesh(session, triangle, WEIGHTS, 30) - rest, (0, 0.2, 0), atol=2e-6)
    [now] = session.constraints()
    assert (now.surface_point.triangle, now.surface_point.weights) == (triangle, tuple(WEIGHTS))
    session.redo()
    assert session.constraints()[0].nodes == (tip,)


def test_velocities_and_soft_weights_of_points(session):
    triangle = triangle_of_end(session)
    session.add(frame=20, surface_point=(triangle, WEIGHTS, "mesh"), velocity=(0, 2, 0), exact=True)
    soft = session.add(frame=40, surface_point=(triangle, WEIGHTS), displacement=(0, -0.3, 0), weight=0.5)
    assert soft.surface_point.surface == "shown"
    result = session.wait()
    after, before = (shown_on_mesh(session, triangle, WEIGHTS, frame) for frame in (21, 19))
    np.testing.assert_allclose((after - before) / 2 * 30, (0, 2, 0), atol=4e-4)
    missed = shown_on_mesh(session, triangle, WEIGHTS, 40) - shown_on_mesh(session, triangle, WEIGHTS, 0) - (0, -0.3, 0)
    assert result.max_error == pytest.approx(np.linalg.norm(missed), abs=2e-5) and result.max_error > 1e-3


def test_picking(session):
    rest = session.geometry().rest.astype(float)
    tip = tip_of(session)
    assert session.nearest_node(rest[tip] + (0.01, 0.02, 0)) == tip
    low, high = rest[tip] - (0.1, 2, 2), rest[tip] + (0.1, 2, 2)
    assert session.nodes_in_box(low, high) == np.flatnonzero(rest[:, 0] > 2.99).tolist()
    assert session.nodes_in_box(low + 100, high + 100) == []
    picked = session.nearest_surface_point((5, 0.3, 0.6))
    assert picked.surface == "mesh" and picked.distance == pytest.approx(2, abs=1e-6)
    np.testing.assert_allclose(picked.position, (3, 0.3, 0.6), atol=1e-6)
    np.testing.assert_allclose(shown_on_mesh(session, picked.triangle, picked.weights, 0), (3, 0.3, 0.6), atol=1e-6)
    session.add(frame=30, surface_point=picked, displacement=(0, 0.5, 0), exact=True)
    session.wait()
    again = session.nearest_surface_point((3, 0.8, 0.6), frame=30)
    assert again.distance < 1e-5 and again.triangle == picked.triangle
    assert tip not in session.nodes_in_box(rest[tip] - 0.01, rest[tip] + 0.01, frame=30)
    for field, call in (("position", lambda: session.nearest_node((0, 1))),
                        ("low", lambda: session.nodes_in_box((1, 0, 0), (0, 1, 1))),
                        ("surface", lambda: session.nearest_surface_point((0, 0, 0), surface="other")),
                        ("surface", lambda: session.nearest_surface_vertex((0, 0, 0)))):
        with pytest.raises(limber.LimberError) as caught:
            call()
        assert caught.value.field == field


def test_what_is_wrong_is_named(session):
    triangle = triangle_of_end(session)
    count = len(session.geometry().surface)
    revision = session.status().revision
    prefix = "edits[0].add.constraint."
    for what, field in (({"surface_point": (count, WEIGHTS)}, prefix + "point.triangle"),
                        ({"surface_point": (triangle, (0.5, 0.6, -0.1))}, prefix + "point.weights[2]"),
                        ({"surface_point": (triangle, (0.5, 0.4, 0))}, prefix + "point.weights"),
                        ({"surface_point": (triangle, (0.5, 0.5))}, prefix + "point.weights"),
                        ({"surface_point": (triangle, WEIGHTS, "carried")}, prefix + "point.surface"),
                        ({"surface_vertex": 0}, prefix + "surface_vertex"),
                        ({"surface_point": (triangle, WEIGHTS, "inner")}, "surface_point.surface"),
                        ({"surface_point": 3}, "surface_point"),
                        ({"surface_point": (triangle, WEIGHTS), "node": 3}, "nodes"), ({}, "nodes")):
        with pytest.raises(limber.LimberError) as caught:
            session.add(frame=30, displacement=(0, 0.1, 0), **what)
        assert caught.value.field == field, what
    both = limber.add(frame=30, node=3, displacement=(0, 0.1, 0))
    both.add.constraint.point.MergeFrom(limber.add(frame=30, surface_point=(triangle, WEIGHTS), displacement=(0, 0, 0)).add.constraint.point)
    with pytest.raises(limber.LimberError, match="nodes are given too") as caught:
        session.edit([both])
    assert caught.value.field == prefix + "point"
    assert session.status().revision == revision and session.constraints() == []
    fixed = int(np.flatnonzero((session.geometry().rest[session.geometry().surface, 0] == 0).all(axis=1))[0])
    [issue] = session.add(frame=30, surface_point=(fixed, WEIGHTS), displacement=(0, 0.1, 0)).issues
    assert "fixed" in issue


def test_scenes_carry_points(server, tmp_path):
    made = server.open(small_scene(), progress=False)
    triangle = triangle_of_end(made)
    made.add(frame=30, surface_point=(triangle, WEIGHTS, "mesh"), displacement=(0, 0.3, 0), exact=True)
    energy = made.wait().energy
    [path] = [path for path in made.export(tmp_path / "saved", formats=("scene",)) if str(path).endswith(".json")]
    made.close()
    content = json.loads(Path(path).read_text(encoding="utf-8"))
    [held] = content["constraints"]
    assert held["point"] == {"triangle": triangle, "weights": WEIGHTS.tolist(), "surface": "POINT_SURFACE_MESH"}
    assert "nodes" not in held
    again = server.open(str(path), progress=False)
    assert again.wait().energy == pytest.approx(energy, rel=1e-6)
    again.close()
    held["point"]["triangle"] = 10 ** 6
    Path(path).write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(limber.LimberError) as caught:
        server.open(str(path))
    assert caught.value.field == "scene.constraints[0].point.triangle"


@pytest.mark.skipif(not SPOT.exists(), reason=f"no {SPOT} (set LIMBER_SHARED)")
def test_vertices_and_points_of_an_artists_mesh(server, cli, tmp_path):
    with contextlib.closing(server.open(SPOT, timeout=300)) as spot:
        surface = spot.carried_surface()
        vertices = surface.vertices.astype(float)
        size = np.ptp(vertices)
        top = int(vertices[:, 1].argmax())
        assert spot.nearest_surface_vertex(vertices[top]) == top
        target = vertices[top] + 0.05 * size * np.array((1, 0.5, 0))
        held = spot.add(frame=60, surface_vertex=top, position=target, exact=True)
        assert held.surface_vertex == top
        spot.wait(timeout=300)
        np.testing.assert_allclose(shown_vertices(spot, 60)[top], target, atol=5e-6 * size)
        corners = surface.triangles[100]
        point = cli("add", spot.id, "--surface-point", "100,0.5,0.25,0.25", "--frame", 40, "--displacement", 0.05, 0, 0.02, "--exact")
        assert point.returncode == 0, point.stderr
        spot.wait(spot.status().revision, timeout=300)  # an edit of another client
        moved = np.array((0.5, 0.25, 0.25)) @ (shown_vertices(spot, 40) - vertices)[corners]
        np.testing.assert_allclose(moved, (0.05, 0, 0.02), atol=5e-6 * size)
        np.testing.assert_allclose(shown_vertices(spot, 60)[top], target, atol=5e-6 * size)
        picked = spot.nearest_surface_point(target, frame=60)
        assert picked.surface == "carried" and picked.distance < 5e-6 * size and top in surface.triangles[picked.triangle]
        listed = cli("show", spot.id)
        assert f"vertex {top}" in listed.stdout and "triangle 100 (0.5, 0.25, 0.25)" in listed.stdout
        for wrong in ("--surface-point=100,0.5,0.5", "--surface-point=x,1,0,0", "--surface-point=1,0.5,0.25,0.25,"):
            assert cli("add", spot.id, wrong, "--frame", 40, "--displacement", 0, 0, 0).returncode != 0
        both = cli("add", spot.id, "--node", 1, "--surface-vertex", 3, "--frame", 40, "--displacement", 0, 0, 0)
        assert both.returncode != 0
        by_vertex = cli("replace", spot.id, held.id, "--surface-vertex", top, "--frame", 60, "--displacement", 0, 0.01, 0)
        assert by_vertex.returncode == 0, by_vertex.stderr
        assert [constraint.surface_vertex for constraint in spot.constraints()] == [top, None]


@pytest.mark.skipif(not SPOT.exists(), reason=f"no {SPOT} (set LIMBER_SHARED)")
def test_the_example_holds_points_of_an_artists_mesh(limberd, tmp_path):
    process = subprocess.run([sys.executable, str(ROOT / "examples" / "hold_surface.py"), str(SPOT)], capture_output=True,
                             text=True, timeout=120, env=dict(os.environ, XDG_CACHE_HOME=str(tmp_path)))
    assert process.returncode == 0, process.stderr
    moved = [re.findall(r"-?\d+\.\d*", line) for line in process.stdout.splitlines()[:2]]
    np.testing.assert_allclose(np.array(moved, float), [[0.1, 0, 0], [0, 0.05, 0]], atol=2e-4)
