"""Morph targets and normals of motions, against shapes that are known."""

import numpy as np
import pytest
from limber import morphs, normals

CUBE = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
FACES = np.array([(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2),
                  (1, 3, 7), (1, 7, 5)])


def played(base, targets, weights):
    return base + np.einsum("fk,kvx->fvx", weights.astype(float), targets)


@pytest.mark.parametrize("frames", [1, 2, 3, 7, 40])
def test_motions_need_fewer_targets_than_frames(frames):
    """Frames that have nothing in common, which any fit needs as many directions for as there are, in both senses."""
    positions = np.random.default_rng(frames).normal(size=(frames, 50, 3))
    base, targets, weights, error = morphs.sliders(positions, 1e-9, 256)
    assert len(targets) == frames - 1 and weights.shape == (frames, frames - 1)
    assert 0 <= weights.min(initial=0) and weights.max(initial=1) == 1
    assert np.abs(played(base, targets, weights) - positions).max() <= error < 1e-6


def test_frames_of_one_shape_share_a_target():
    positions = np.random.default_rng(1).normal(size=(6, 20, 3))
    positions[3], positions[5] = positions[1], positions[0]
    _, targets, weights, _ = morphs.sliders(positions, 1e-9, 256)
    assert len(targets) == 3 and np.array_equal(weights[3], weights[1]) and not weights[5].any()


def test_motions_of_few_shapes_keep_few_targets():
    swing = np.sin(np.linspace(0, 7, 30))[:, None, None]
    base, targets, weights, error = morphs.sliders(CUBE + swing * CUBE[:, (1, 2, 0)], 1e-5, 256)
    assert len(targets) == 2 and error < 1e-5  # up and down


def test_sharp_edges_have_a_normal_for_each_side():
    faces, source = normals.split_creases(FACES, CUBE)
    assert np.array_equal(source[faces], FACES) and np.array_equal(source[:8], np.arange(8)) and len(source) == 24
    of_vertices = normals.of_vertices(faces, CUBE[source])
    for triangle, corners in zip(faces, CUBE[FACES]):
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        assert np.allclose(of_vertices[triangle], normal)
    smooth, source = normals.split_creases(FACES, CUBE, degrees=100)
    assert np.array_equal(smooth, FACES) and len(source) == 8
    assert np.allclose(np.linalg.norm(normals.of_vertices(FACES, CUBE), axis=1), 1)


def test_vertices_without_triangles_have_a_normal():
    assert np.array_equal(normals.of_vertices(FACES[:2], CUBE)[7], (0, 0, 1))


def test_normals_follow_a_turn():
    angles = np.linspace(0, 0.5, 30)
    turns = np.array([[(np.cos(a), -np.sin(a), 0), (np.sin(a), np.cos(a), 0), (0, 0, 1)] for a in angles])
    positions = np.einsum("fij,vj->fvi", turns, CUBE)
    base, targets, weights, _ = morphs.sliders(positions, 1e-6, 256)
    faces, source = normals.split_creases(FACES, CUBE)
    rest, added = normals.fitted(faces, base[source], (shape[source] for shape in positions), weights)
    shown = rest + np.einsum("fk,kvx->fvx", weights, added)
    expected = np.einsum("fij,vj->fvi", turns, normals.of_vertices(faces, CUBE[source]))
    assert np.abs(shown - expected).max() < 1e-5
