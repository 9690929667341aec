"""What LinkageSession.solution() tells balances, and agrees with sections and energies."""

import dataclasses

import balances
import limber
import numpy as np
import pytest
from limber.beams.structures import structure_of
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
    for edges in (5, 10):
        opened = fine(server, edges)
        opened.load(10, force=(0, 0, -5))
        assert opened.wait().converged
        solution = opened.solution()
        assert solution.converged and np.flatnonzero(np.abs(solution.reaction_forces).sum(axis=1)).tolist() == [3]
        assert solution.loads[10].tolist() == [0, 0, -5]
        assert np.abs(imbalance(solution)).max() < 5e-6
        assert np.abs(solution.unbalanced_forces).max() < 5e-6
        # Moments about the pinned joint.
        arm = solution.positions[10] - solution.positions[3]
        assert np.allclose(solution.reaction_moments[3] + np.cross(arm, solution.loads[10]), 0, atol=2e-5)
        opened.close()


def test_reactions_balance_weight_and_springs(server):
    opened = fine(server, 10)
    opened.gravity((0, 0, -9.81))
    opened.wait()
    heavy = opened.solution()
    section, length = 0.02 * 0.005, heavy.rest_lengths.sum()
    weight = 600 * section * length * 9.81
    assert heavy.weights.sum(axis=0) == pytest.approx([0, 0, -weight])
    assert np.abs(imbalance(heavy)).max() < 1e-6 * weight

    opened.attach(20, position=opened.shape().joints[20] + (0, 0, 0.2), stiffness=50)
    opened.attach(segment=100, share=0.4, position=opened.shape().centrelines[100][4] + (0.2, 0, 0.1), stiffness=20)
    result = opened.wait()
    pulled = opened.solution()
    assert pulled.spring_forces.shape == (2, 3) and (np.linalg.norm(pulled.spring_forces, axis=1) > 0.5).all()
    assert np.abs(imbalance(pulled)).max() < 1e-6 * weight
    stiffnesses = np.array([50, 20])
    assert ((pulled.spring_forces ** 2).sum(axis=1) / (2 * stiffnesses)).sum() == pytest.approx(result.spring_energy, rel=1e-9)
    targets = [(target.position.x, target.position.y, target.position.z) for target in opened.conditions().targets]
    assert pulled.spring_forces == pytest.approx(stiffnesses[:, None] * (targets - pulled.spring_points), abs=1e-9)
    opened.close()


def test_a_spring_has_the_point_and_the_force_of_the_solver(server):
    """At a share of a segment whose neighbour in the rod is of another length, so that its edges differ."""
    points = [[0, -.05, 0], [0, 0, 0], [0, .05, 0], [1, 0, 0], [1, -.05, 0], [1, .05, 0], [1.4, 0, 0]]
    edges = [[0, 1], [1, 2], [1, 3], [3, 4], [3, 5], [3, 6]]
    forces = []
    for count in (5, 10, 40):
        opened = server.open(limber.linkage_scene(points, edges, section={"rectangle": (.02, .005)},
                                                  edges_per_segment=count), progress=False)
        for joint in (0, 1):
            opened.pin(joint, "both")
        opened.wait()
        opened.attach(segment=2, share=.9, position=(.9, 0, .02), stiffness=5.)
        result = opened.wait()
        solution = opened.solution()
        force = np.linalg.norm(solution.spring_forces[0])
        assert force == pytest.approx((2 * 5 * result.spring_energy) ** 0.5, rel=1e-9)
        assert solution.spring_points[0, 0] == pytest.approx(.9, abs=1e-3), "nine tenths of the segment"
        assert np.abs(imbalance(solution)).max() < 1e-6 * force
        forces.append(force)
        opened.close()
    assert forces == pytest.approx([forces[-1]] * 3, rel=1e-2)


def test_the_largest_stress_is_at_the_clamp_with_an_estimate_of_its_own(server):
    points = [[0, -.05, 0], [0, 0, 0], [0, .05, 0], [1, -.05, 0], [1, 0, 0], [1, .05, 0]]
    edges = [[0, 1], [1, 2], [1, 4], [3, 4], [4, 5]]
    for count in (3, 5, 10, 20):
        opened = server.open(limber.linkage_scene(points, edges, section={"rectangle": (.02, .005)},
                                                  edges_per_segment=count), progress=False)
        opened.pin(0, "both")
        opened.pin(1, "angle")
        opened.wait()
        opened.load(1, force=(0, 0, .0125))
        error = opened.wait(until="checked").discretisation_error
        stress = .0125 * .0025 / (.02 * .005 ** 3 / 12)  # M c / I
        assert opened.solution().stresses[2] == pytest.approx(stress, rel=1e-3)
        assert error.stress_error < 2e-3 and error.max_stress_error < 2e-3 * stress
        opened.gravity((0, 0, -9.81))
        error = opened.wait(until="checked").discretisation_error
        assert error.stress_error > 0 and error.worst_stress_segment == 2
        opened.close()


def test_the_balance_of_every_solution_is_checked(server):
    """By balances.py, of linkages and of beams; it fails where a force is left out."""
    opened = fine(server, 5)
    opened.gravity((0, 0, -9.81))
    opened.wait()
    solution = opened.solution()
    balances.check_linkage(solution)
    with pytest.raises(AssertionError, match="sums to"):
        balances.check_linkage(dataclasses.replace(solution, weights=solution.weights * (1 + 1e-5)))
    opened.close()

    section = {"rectangle": {"width": 0.02, "height": 0.01}, "young": 1e9, "poisson": 0.3, "density": 600}
    beams = {"nodes": [{"position": {"x": x}} for x in (0, 0.5, 1)], "sections": [section],
             "elements": [{"start": 0, "finish": 1}, {"start": 1, "finish": 2, "rest_length": 0.501}],
             "supports": [{"node": 0, "fix_x": True, "fix_y": True, "fix_z": True, "fix_rotation_x": True,
                           "fix_rotation_y": True, "fix_rotation_z": True}],
             "loads": [{"node": 1, "force": {"z": 1}}, {"node": 2, "force": {"x": 0.5, "z": 0.5}, "follows": True}],
             "distributed_loads": [{"element": 1, "force": {"y": 1, "z": 2}, "follows": True}], "gravity": {"z": -9.81}}
    structure, answer = structure_of(beams), server.solve_beams(beams, progress=False)
    assert answer.converged and np.abs(answer.rotations[2, 1:]).max() > 0.1, "loads have turned"
    for change in (lambda s: s.gravity.ClearField("z"), lambda s: s.loads[0].ClearField("force"),
                   lambda s: s.loads[1].ClearField("follows"), lambda s: s.distributed_loads[0].ClearField("follows"),
                   lambda s: s.elements[1].ClearField("rest_length")):
        changed = structure_of(beams)
        change(changed)
        with pytest.raises(AssertionError, match="sums to"):
            balances.check_beams(changed, answer)
    balances.check_beams(structure, answer)


def test_segments_balance_and_stresses_are_of_their_sections(linkage):  # noqa: F811
    linkage.deploy(60)
    linkage.wait()
    solution = linkage.solution(yield_stress=40e6)
    assert len(solution.first) == len(solution.lengths) + 1 and solution.first[-1] == len(solution.points)
    # It weighs nothing: balanced as the solver has it, to 1e-8 of forces.
    assert np.abs(solution.end_forces.sum(axis=1)).max() < 1e-7 * np.abs(solution.end_forces).max()
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
