"""Weaves and great circles are solved as they are drawn; sections lie as they are given."""

import itertools
import math

import limber
import numpy as np
import pytest
from linkage_inputs import RECTANGLE, grid
from refusals import refusal

GOLDEN = (1 + 5 ** 0.5) / 2


def six_great_circles():
    """The edges of an icosidodecahedron, all of length 2."""
    points = [sign * np.roll((2 * GOLDEN, 0, 0), k) for sign in (1, -1) for k in range(3)]
    points += [np.roll((a, b * GOLDEN, c * GOLDEN ** 2), k) for a, b, c in itertools.product((1, -1), repeat=3) for k in range(3)]
    vertices = np.array(points, dtype=float)
    apart = np.linalg.norm(vertices[:, None] - vertices[None], axis=2)
    return vertices, np.array([(i, j) for i in range(30) for j in range(i) if abs(apart[i, j] - 2) < 1e-6])


def test_great_circles_have_the_energy_of_circles(server):
    vertices, edges = six_great_circles()
    scene = limber.linkage_scene(vertices, edges, section={"rectangle": (0.06, 0.06)}, edges_per_segment=8, youngs_modulus=1e10)
    opened = server.open(scene, progress=False)
    result = opened.wait()
    assert result.status == "CONVERGED" and not result.solve_failed, result.message
    energy = result.bending_energy + result.twisting_energy + result.stretching_energy
    assert energy == pytest.approx(6 * 2 * math.pi ** 2 * 1e10 * 0.06 ** 4 / 12 / 20, rel=2e-3)
    laths = opened.laths("m")
    assert [len(lath.parts) for lath in laths] == [10] * 6 and all(lath.closed for lath in laths)
    radii = np.linalg.norm(opened.shape(final=True).joints - opened.shape(final=True).joints.mean(axis=0), axis=1)
    assert radii == pytest.approx(20 / (2 * math.pi), rel=2e-3)
    # What opens one joint closes the next.
    assert opened.geometry().mixed_angles
    assert any("no mean opening angle can be asked for" in str(issue) for issue in opened.issues)
    assert refusal(lambda: opened.deploy(40)) == ("INVALID_ARGUMENT", "edits[0].set_mean_angle.angle_degrees")
    scene.linkage.conditions.mean_angle_degrees = 40
    assert refusal(lambda: server.open(scene, progress=False)) == ("INVALID_ARGUMENT", "scene.linkage.conditions.mean_angle_degrees")
    opened.set_angle(0, 45)
    assert opened.wait().status == "CONVERGED"
    opened.close()


def test_given_normals_say_which_side_is_up(server, tmp_path):
    vertices, edges = grid(4)
    down = np.tile((0.0, 0.0, -2.0), (len(vertices), 1))
    opened = server.open(limber.linkage_scene(vertices, edges, section=RECTANGLE, normals=down), progress=False)
    opened.wait()
    assert np.allclose(opened.solution().normals, (0, 0, -1), atol=1e-6)
    opened.export(tmp_path, formats=("scene",))
    opened.close()
    (stored,) = tmp_path.glob("*.json")
    again = server.open(stored, progress=False)
    again.wait()
    assert np.allclose(again.solution().normals, (0, 0, -1), atol=1e-6)
    again.close()
    down[5] = (0, 0, 1)
    assert refusal(lambda: server.open(limber.linkage_scene(vertices, edges, section=RECTANGLE, normals=down),
                                       progress=False))[0] == "INVALID_ARGUMENT"


@pytest.mark.parametrize("size", [(0.004, 0.016), (0.016, 0.004)])
def test_a_section_lies_as_it_is_given(server, size):
    """A cantilever between two joints: width across, height along the normal."""
    vertices = np.array([(0, 0, 0), (1, 0, 0), (0, -0.1, 0), (0, 0.1, 0), (1, -0.1, 0), (1, 0.1, 0)], dtype=float)
    edges = np.array([(0, 1), (2, 0), (0, 3), (4, 1), (1, 5)])
    scene = limber.linkage_scene(vertices, edges, section={"rectangle": size}, youngs_modulus=1e10, edges_per_segment=40)
    opened = server.open(scene, progress=False)
    opened.pin(0)
    assert np.ptp(opened.geometry().outline, axis=0) == pytest.approx(size)
    opened.load(1, force=(0, 0, 0.01))
    opened.wait()
    width, height = size
    right = 0.01 / (3 * 1e10 * width * height ** 3 / 12)
    assert opened.solution().positions[1, 2] == pytest.approx(right, rel=0.01)
    laths = opened.laths("mm")
    assert (laths[0].width, laths[0].height) == pytest.approx((1000 * width, 1000 * height))
    assert laths.section == f"rectangle {1000 * width:g} x {1000 * height:g}"
    opened.close()
