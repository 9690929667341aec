"""Masses, stiffness and modes that the client makes are those of the session."""

import contextlib

import limber
import numpy as np
import pytest
from conftest import bar, small_scene, tip_of, two_material_scene
from limber.bodies import strains

pytest.importorskip("scipy")


def test_frequencies_are_those_that_the_session_reports(server):
    opened = server.open(small_scene(period_frames=0.0), progress=False)
    modal = opened.modal()
    assert modal.frequencies == pytest.approx(modal.reported, rel=1e-5) and modal.speed == pytest.approx(1, rel=1e-6)
    swung = [mode.frequency for mode in opened.material().initial]
    assert modal.reported == pytest.approx(swung, rel=1e-6)
    opened.close()


def test_published_differences_swing_a_little_faster(server):
    opened = server.open(small_scene(period_frames=0.0, discretisation="differences"), progress=False)
    reported, swung = opened.modal().reported, [mode.frequency for mode in opened.material().initial]
    assert np.arcsin(np.pi * reported / 30) / np.pi * 30 == pytest.approx(swung, rel=1e-6)
    opened.close()


@pytest.mark.parametrize("options", [{"period_frames": 25.0}, {"period_frames": 0.0, "fixed_nodes": []},
                                     {"period_frames": 0.0, "length_unit_in_metres": 0.01, "frames_per_second": 2000.0}])
def test_with_a_speed_free_and_in_another_unit(server, options):
    opened = server.open(small_scene(**options), progress=False)
    modal = opened.modal()
    assert modal.frequencies * modal.speed == pytest.approx(modal.reported, rel=1e-5)
    assert (abs(modal.speed - 1) > 0.1) == (options["period_frames"] > 0)
    opened.close()


def test_bodies_of_several_materials(server):
    with contextlib.closing(server.open(two_material_scene(period_frames=0.0), progress=False)) as opened:
        modal = opened.modal()
        assert modal.frequencies == pytest.approx(modal.reported, rel=1e-5) and modal.speed == pytest.approx(1, rel=1e-6)
        assert modal.lumped_mass.sum() == pytest.approx(3 * 1.5 * (1000 + 3000))


def test_materials_of_mesh_files(server, tmp_path):
    """The session reports them as groups."""
    with contextlib.closing(server.open(small_scene(), progress=False)) as opened:
        opened.export(tmp_path, ("scene",), stem="mixed")
    halves = np.array_split(np.arange(len(bar()[1])), 2)
    (tmp_path / "mixed.elastic").write_text("*groups 2\n\n" + "".join(
        f"*MATERIAL, NAME=M{density}\n*ELASTIC\n{young}, 0.3\n*DENSITY {density}\n*num_of_tets {len(tets)}\n\n"
        for young, density, tets in zip((1e5, 1e6), (1000, 3000), halves)) + "".join(
        f"*ELSET, ELSET=M{density}\n{', '.join(map(str, tets.tolist()))}\n\n" for density, tets in zip((1000, 3000), halves)))
    scene = limber.scene_from_mesh(tmp_path / "mixed.vtu", modes=8, tolerance=0.05, frames=60, period_frames=0.0)
    assert not scene.material_groups
    with contextlib.closing(server.open(scene, progress=False)) as opened:
        modal = opened.modal()
        assert modal.frequencies == pytest.approx(modal.reported, rel=1e-5)
        assert modal.lumped_mass.sum() == pytest.approx(3 * 1.5 * (1000 + 3000))


def test_stresses_of_several_materials(server):
    with contextlib.closing(server.open(two_material_scene(), progress=False)) as opened:
        opened.add(node=tip_of(opened), frame=30, displacement=(0, 0.4, 0))
        opened.wait()
        geometry, positions = opened.geometry(), opened.frames(30, 1)[0]
        groups, shown = opened.settings().material_groups, opened.coloured("stress", 30)
        tets = strains.tets_of(shown.faces, geometry.tets)
        for face in (0, len(tets) - 1):
            tet = tets[face]
            (material,) = [group.material for group in groups if tet in group.tets]
            young, poisson = material.youngs_modulus, material.poissons_ratio
            gradient = strains.gradients(geometry.rest, geometry.tets[[tet]], positions)[0]
            strain = (gradient.T @ gradient - np.eye(3)) / 2
            second = young / (1 + poisson) * (strain + poisson / (1 - 2 * poisson) * np.trace(strain) * np.eye(3))
            stress = gradient @ second @ gradient.T / np.linalg.det(gradient)
            deviator = stress - np.trace(stress) / 3 * np.eye(3)
            assert shown.values[face] == pytest.approx(np.sqrt(1.5 * (deviator ** 2).sum()), rel=1e-4)
        assert {group.material.youngs_modulus for group in groups} == {1e5, 1e6}


def test_matrices_and_modes(server):
    opened = server.open(small_scene(), progress=False)
    modal = opened.modal(5)
    nodes, _ = bar()
    assert modal.mass.shape == modal.stiffness.shape == (3 * len(nodes),) * 2 and modal.modes.shape == (3 * len(nodes), 5)
    assert modal.lumped_mass.sum() == pytest.approx(3 * 3.0 * 1000) and modal.mass.sum() == pytest.approx(9000)
    for matrix in (modal.mass, modal.stiffness):
        assert abs(matrix - matrix.T).max() < 1e-9 * abs(matrix).max()
    spin = np.cross((0.3, -0.2, 0.5), nodes) + (1, 2, 3)
    assert np.abs(modal.stiffness @ spin.ravel()).max() < 1e-3 * abs(modal.stiffness).max() * 1e-3
    # A bar that is stretched evenly and free to narrow: E times strain times area at its ends.
    pulled = nodes * (0.01, -0.45 * 0.01, -0.45 * 0.01)
    forces = (modal.stiffness @ pulled.ravel()).reshape(-1, 3)
    assert forces[nodes[:, 0] == 3].sum(axis=0) == pytest.approx([1e5 * 0.01, 0, 0], abs=1e-6)
    assert np.abs(forces[(nodes[:, 0] > 0) & (nodes[:, 0] < 3)]).max() < 1e-8
    w, free = modal.modes, modal.free
    assert not w[~free].any() and np.allclose(w.T @ (modal.mass @ w), np.eye(5), atol=1e-8)
    left = (modal.stiffness @ w - modal.mass @ w * (2 * np.pi * modal.frequencies) ** 2)[free]
    assert np.abs(left).max() < 1e-6 * np.abs(modal.stiffness @ w).max()
    with pytest.raises(limber.LimberError):
        opened.modal(10 ** 6)
    opened.close()


def pulled(server, **options):
    """A session whose tip is pulled sideways in one frame."""
    opened = server.open(small_scene(**options), progress=False)
    opened.add(node=tip_of(opened), frame=30, displacement=(0, 0.3, 0))
    return opened, opened.wait()


@pytest.mark.parametrize("options", [{}, {"fixed_nodes": []}, {"damping_ratio": 0.05},
                                     {"optimise": "all", "candidate_modes": 12}, {"length_unit_in_metres": 0.01}])
def test_control_forces_have_the_energy_that_is_reported(server, options):
    opened, result = pulled(server, **options)
    motion = opened.modal().motion
    frames, modes = motion.coordinates.shape
    assert (frames, modes) == (opened.status().frames, motion.mixing.shape[1]) and motion.revision == result.revision
    assert motion.forces.shape == (frames - 2, modes) and motion.candidates.shape[2] == motion.mixing.shape[0]
    assert motion.force_energy == pytest.approx(opened.wait().force_energy) and motion.force_energy > 0
    assert motion.energy == pytest.approx(motion.force_energy, rel=1e-7)
    opened.close()


def test_control_forces_of_published_differences_are_the_equation_of_motion(server):
    opened, _ = pulled(server, damping_ratio=0.05, discretisation="differences")
    motion = opened.modal_motion()
    assert motion.energy == pytest.approx(0.5 * (motion.forces ** 2).sum(), rel=1e-12)
    # One frame and mode at a time.
    frame, mode = 29, int(abs(motion.forces[28]).argmax())
    z, stiffness, damping = motion.coordinates[:, mode], motion.stiffness[mode], motion.damping[mode]
    velocity = z[frame + 1] - z[frame]
    acceleration = z[frame + 1] - 2 * z[frame] + z[frame - 1]
    assert acceleration + damping * velocity + stiffness * z[frame] == pytest.approx(motion.forces[frame - 1, mode], rel=1e-9)
    opened.close()


def test_small_displacements_are_the_sum_of_the_modes(server):
    opened = server.open(small_scene(length_unit_in_metres=0.01), progress=False)
    opened.add(node=tip_of(opened), frame=30, displacement=(0, 0.003, 0))
    opened.wait()
    motion, shown = opened.modal_motion(), opened.frames(30, 1)[0] - opened.geometry().rest
    summed = motion.modes @ motion.coordinates[30]
    assert np.abs(summed - shown).max() < 0.01 * np.abs(shown).max()
    opened.close()


def test_candidates_are_the_modes_that_the_client_finds(server):
    opened, _ = pulled(server, period_frames=0.0)
    modal = opened.modal()
    assert modal.motion.candidate_frequencies == pytest.approx(modal.reported, rel=1e-5)
    candidates = modal.motion.candidates.reshape(-1, modal.motion.candidates.shape[2])
    overlap = np.abs((modal.modes * (modal.mass @ candidates)).sum(axis=0))
    size = np.sqrt((candidates * (modal.mass @ candidates)).sum(axis=0))
    assert overlap == pytest.approx(size, rel=1e-5)
    opened.close()
