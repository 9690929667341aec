"""What LinkageSession.solution() tells balances, and agrees with sections and energies."""

import limber
import numpy as np
import pytest
from linkage_inputs import linkage  # noqa: F401
from refusals import refusal


def imbalance(solution):
    """What acts on the linkage from outside, summed: nothing in equilibrium."""
    return (solution.reaction_forces.sum(axis=0) + solution.loads.sum(axis=0) + solution.spring_forces.sum(axis=0)
            + solution.weights.sum(axis=0))


def fine(server, edges):
    scene = server.sample("hyperboloid")
    scene.linkage.edges_per_segment = edges
    opened = server.open(scene, progress=False)
    opened.deploy(60)
    opened.pin(3, "motion")
    return opened


def test_reactions_balance_loads(server):
    left = []
    for edges in (10, 20):
        opened = fine(server, edges)
        opened.load(10, force=(0, 0, -5))
        assert opened.wait().converged
        solution = opened.solution()
        assert solution.converged and np.flatnonzero(np.abs(solution.reaction_forces).sum(axis=1)).tolist() == [3]
        assert solution.loads[10].tolist() == [0, 0, -5]
        left.append(np.abs(imbalance(solution)).max())
        assert np.abs(solution.unbalanced_forces).max() < 0.002 * np.abs(solution.end_forces).max()
        # Moments about the pinned joint.
        arm = solution.positions[10] - solution.positions[3]
        assert np.allclose(solution.reaction_moments[3] + np.cross(arm, solution.loads[10]), 0, atol=0.02)
        opened.close()
    assert left[0] < 0.03 and left[1] < left[0] / 3  # of 5 N: it falls with the square of the edges' length


def test_reactions_balance_weight_and_springs(server):
    opened = fine(server, 30)
    opened.gravity((0, 0, -9.81))
    opened.wait()
    heavy = opened.solution()
    section, length = 0.02 * 0.005, heavy.rest_lengths.sum()
    assert heavy.weights.sum(axis=0) == pytest.approx([0, 0, -600 * section * length * 9.81])
    assert np.abs(imbalance(heavy)).max() < 0.01 * abs(heavy.weights.sum(axis=0)[2])

    opened.attach(20, position=opened.shape().joints[20] + (0, 0, 0.2), stiffness=50)
    opened.attach(segment=100, share=0.4, position=opened.shape().centrelines[100][10] + (0.2, 0, 0.1), stiffness=20)
    opened.wait()
    pulled = opened.solution()
    assert pulled.spring_forces.shape == (2, 3) and (np.linalg.norm(pulled.spring_forces, axis=1) > 0.5).all()
    assert np.abs(imbalance(pulled)).max() < 0.01 * abs(pulled.weights.sum(axis=0)[2])
    opened.close()


def test_segments_balance_and_stresses_are_of_their_sections(linkage):  # noqa: F811
    linkage.deploy(60)
    linkage.wait()
    solution = linkage.solution(yield_stress=40e6)
    assert len(solution.first) == len(solution.lengths) + 1 and solution.first[-1] == len(solution.points)
    assert np.allclose(solution.end_forces.sum(axis=1), 0, atol=1e-9)  # it weighs nothing
    assert solution.angles == pytest.approx(linkage.shape().angles, abs=1e-4)
    assert solution.mean_angle == pytest.approx(60, abs=1e-4)
    assert solution.energy == pytest.approx(linkage.wait().energy, rel=1e-6)
    # A rectangle of E = 10 GPa: N / A and the sum of M / W at its corners.
    width, height = 0.02, 0.005
    assert solution.axial_forces == pytest.approx(1e10 * width * height * solution.axial_strains, rel=1e-5, abs=1e-6)
    bending = np.abs(solution.bending_moments) / (np.array([height * width ** 2, width * height ** 2]) / 6)
    expected = solution.axial_forces / (width * height) + bending.sum(axis=1)
    assert solution.normal_stresses[:, 0] == pytest.approx(expected, rel=1e-3, abs=10)
    assert (solution.von_mises_stresses >= np.abs(solution.normal_stresses).max(axis=1) * (1 - 1e-6)).all()
    for s in (0, 77):
        assert solution.stresses[s] == solution.von_mises_stresses[solution.stations(s)].max()
    assert solution.utilisations == pytest.approx(solution.stresses / 40e6)
    assert not linkage.solution().utilisations.any()
    assert refusal(lambda: linkage.solution(yield_stress=0)) == ("INVALID_ARGUMENT", "yield_stress")


def test_forces_in_another_unit(server):
    """The same linkage drawn in millimetres."""
    found = []
    for scale, unit in ((1.0, 1.0), (1000.0, 0.001)):
        points = np.array([(-1, 0, 0), (0, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0)]) * scale
        scene = limber.linkage_scene(points, [(0, 1), (1, 2), (3, 1), (1, 4)], length_unit_in_metres=unit,
                                     section={"tube": (0.02 * scale, 0.002 * scale)}, edges_per_segment=20)
        opened = server.open(scene, progress=False)
        opened.pin(0, "both")
        opened.gravity((0, 0, -9.81))
        opened.load(0, force=(1, 2, 3))
        opened.wait()
        found.append(opened.solution())
        opened.close()
    one, other = found
    assert np.abs(one.reaction_forces).max() > 1
    assert np.allclose(one.reaction_forces, other.reaction_forces, atol=1e-3)
    assert np.allclose(one.reaction_moments, other.reaction_moments, atol=1e-3)
    assert one.stresses == pytest.approx(other.stresses, rel=1e-3)
