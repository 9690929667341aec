"""Points follow the tet that contains them or the nearest one."""

import numpy as np
import pytest
from limber import Embedding, LimberError


def bar(cells=(5, 3, 2)):
    """Cubes of six tets each."""
    nx, ny, nz = cells
    grid = np.stack(np.meshgrid(*(np.arange(n + 1) for n in cells), indexing="ij"), axis=-1).reshape(-1, 3).astype(float)
    tets = []
    for i, j, k in np.ndindex(nx, ny, nz):
        c = [((i + (b & 1)) * (ny + 1) + j + (b >> 1 & 1)) * (nz + 1) + k + (b >> 2) for b in range(8)]
        tets += [(c[0], c[a], c[b], c[7]) for a, b in ((1, 3), (3, 2), (2, 6), (6, 4), (4, 5), (5, 1))]
    return grid, np.array(tets)


@pytest.fixture
def inside():
    return np.random.default_rng(7).uniform((0, 0, 0), (5, 3, 2), (2000, 3))


def test_points_inside_lie_in_their_tet(inside):
    nodes, tets = bar()
    made = Embedding.of(inside, nodes, tets)
    assert made.weights.min() > -1e-6 and not made.distances.any()
    assert made.weights.sum(axis=1) == pytest.approx(1)
    assert np.allclose(made.positions(nodes), inside, atol=1e-12)
    assert np.array_equal(made.nodes, tets[made.tets])


def test_nodes_themselves_are_found():
    nodes, tets = bar()
    made = Embedding.of(nodes, nodes, tets)
    assert not made.distances.any() and np.allclose(made.positions(nodes), nodes)


def test_points_outside_follow_the_nearest_triangle():
    nodes, tets = bar()
    points = np.array([(2.3, 1.2, 2.25), (-0.5, 1, 1), (5.3, 3.4, 1), (2.5, -20, 1)])
    made = Embedding.of(points, nodes, tets)
    assert made.distances == pytest.approx([0.25, 0.5, 0.5, 20])
    assert np.allclose(made.positions(nodes), points)
    # The same by trying every boundary triangle.
    rng = np.random.default_rng(3)
    cloud = rng.uniform((-1, -1, -1), (6, 4, 3), (500, 3))
    box = np.linalg.norm(np.maximum(np.maximum(-cloud, cloud - (5, 3, 2)), 0), axis=1)
    assert Embedding.of(cloud, nodes, tets).distances == pytest.approx(box, abs=1e-9)


def test_the_nearest_tet_of_uneven_meshes():
    """A large triangle whose middle is farther than those of many small ones beside it."""
    x, y = np.meshgrid(np.arange(31) / 30, np.arange(31) / 30, indexing="ij")
    sheet = np.stack([x.ravel() + 12, y.ravel(), np.zeros(x.size)], axis=1)
    tets = []
    for i, j in np.ndindex(30, 30):
        a, b, c, d = 31 * i + j, 31 * i + j + 1, 31 * (i + 1) + j, 31 * (i + 1) + j + 1
        tets += [(a, c, b, len(sheet)), (d, b, c, len(sheet))]
    nodes = np.concatenate([sheet, [(12.5, 0.5, -1), (-30, -30, 0), (11.5, -30, 0), (11.5, 30, 0), (0, 0, -20)]])
    tets.append(tuple(len(sheet) + np.array((1, 2, 3, 4))))
    made = Embedding.of([(11.4, 0.5, 0.3)], nodes, tets)
    assert made.tets[0] == len(tets) - 1 and made.distances[0] == pytest.approx(0.3)


def test_the_nearest_tet_by_trying_all():
    rng = np.random.default_rng(5)
    nodes, tets = bar((3, 2, 1))
    nodes = nodes * (1, 0.2, 3) + rng.normal(size=nodes.shape) * (0.1, 0.02, 0.3)
    points = rng.uniform(nodes.min(axis=0) - 2, nodes.max(axis=0) + 2, (300, 3))
    made = Embedding.of(points, nodes, tets)
    outside = np.flatnonzero(made.distances > 0)
    assert len(outside) > 200
    for point in outside[:8]:
        single = [Embedding.of(points[[point]], nodes, tets[[tet]]).distances[0] for tet in range(len(tets))]
        assert made.distances[point] == pytest.approx(min(single), abs=1e-12)
        assert single[made.tets[point]] == pytest.approx(min(single), abs=1e-7)


def test_affine_motions_are_followed_exactly(inside):
    nodes, tets = bar()
    matrix = np.array([[1.1, 0.2, 0], [-0.3, 0.9, 0.1], [0, 0.4, 1.2]])
    points = np.concatenate([inside, inside + (0, 0, 1.9)])
    made = Embedding.of(points, nodes, tets)
    frames = np.stack([nodes @ matrix.T + (1, 2, 3), nodes])
    moved = made.positions(frames)
    assert np.allclose(moved[0], points @ matrix.T + (1, 2, 3)) and np.allclose(moved[1], points)
    basis = np.random.default_rng(1).normal(size=(len(nodes), 3, 4))
    coordinates = np.array([0.3, -1, 2, 0.5])
    assert np.allclose(points + made.basis(basis) @ coordinates, made.positions(nodes + basis @ coordinates))


def test_what_cannot_be_embedded():
    nodes, tets = bar()
    for points, mesh in (([(0, 0)], tets), ([(0, 0, np.nan)], tets), ([(0, 0, 0)], tets[:0].reshape(0, 4)),
                         ([(0, 0, 0)], tets + 1000)):
        with pytest.raises(LimberError) as caught:
            Embedding.of(np.array(points, dtype=float), nodes, mesh)
        assert caught.value.code == "INVALID_ARGUMENT"
