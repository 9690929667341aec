"""Nearest points of triangles, against many points of them."""

import limber
import numpy as np
import pytest
from limber.bodies import picking


def many_points(triangle, steps=60):
    """Of a triangle (3 x 3), evenly spread."""
    b, c = np.meshgrid(np.linspace(0, 1, steps), np.linspace(0, 1, steps))
    inside = b + c <= 1
    weights = np.stack([1 - b[inside] - c[inside], b[inside], c[inside]], axis=1)
    return weights @ triangle


def test_no_point_of_the_triangles_is_nearer():
    random = np.random.default_rng(5)
    vertices = random.normal(size=(12, 3))
    triangles = np.array([[0, 1, 2], [3, 4, 5], [6, 7, 8], [9, 10, 11], [0, 0, 1], [5, 5, 5]])  # the last two without area
    cloud = np.concatenate([many_points(vertices[triangle]) for triangle in triangles])
    for x in random.normal(size=(40, 3)) * 1.5:
        triangle, weights, point = picking.nearest_point(x, vertices, triangles)
        assert (weights >= 0).all() and weights.sum() == pytest.approx(1, abs=1e-12)
        np.testing.assert_allclose(weights @ vertices[triangles[triangle]], point, atol=1e-12)
        least = np.linalg.norm(cloud - x, axis=1).min()
        assert least - 0.05 < np.linalg.norm(point - x) <= least + 1e-12


def test_corners_edges_and_insides():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    for x, weights in (((-1, -1, 2), (1, 0, 0)), ((0.5, -1, 0), (0.5, 0.5, 0)), ((1, 1, 0), (0, 0.5, 0.5)), ((0.25, 0.25, 9), (0.5, 0.25, 0.25))):
        np.testing.assert_allclose(picking.nearest_point(np.array(x, float), vertices, np.array([[0, 1, 2]]))[1], weights, atol=1e-12)


def test_constraints_say_what_they_hold():
    edit = limber.add(frame=3, surface_point=(7, (0.5, 0.25, 0.25), "carried"), displacement=(0, 1, 0))
    point = picking.from_message(edit.add.constraint.point)
    assert (point.triangle, point.weights, point.surface) == (7, (0.5, 0.25, 0.25), "carried")
    assert limber.add(frame=3, surface_point=point, displacement=(0, 1, 0)) == edit
    vertex = limber.add(frame=3, surface_vertex=0, displacement=(0, 1, 0)).add.constraint
    assert vertex.HasField("surface_vertex") and not vertex.HasField("point") and not vertex.nodes
