"""Masses, stiffness and modes that the client makes are those of the session."""

import limber
import numpy as np
import pytest
from conftest import bar, small_scene

pytest.importorskip("scipy")


def test_frequencies_are_those_that_the_session_reports(server):
    opened = server.open(small_scene(period_frames=0.0), progress=False)
    modal = opened.modal()
    assert modal.frequencies == pytest.approx(modal.reported, rel=1e-5) and modal.speed == pytest.approx(1, rel=1e-6)
    swung = [mode.frequency for mode in opened.material().initial]
    assert np.arcsin(np.pi * modal.reported / 30) / np.pi * 30 == pytest.approx(swung, rel=1e-6)
    opened.close()


@pytest.mark.parametrize("options", [{"period_frames": 25.0}, {"period_frames": 0.0, "fixed_nodes": []},
                                     {"period_frames": 0.0, "length_unit_in_metres": 0.01, "frames_per_second": 2000.0}])
def test_with_a_speed_free_and_in_another_unit(server, options):
    opened = server.open(small_scene(**options), progress=False)
    modal = opened.modal()
    assert modal.frequencies * modal.speed == pytest.approx(modal.reported, rel=1e-5)
    assert (abs(modal.speed - 1) > 0.1) == (options["period_frames"] > 0)
    opened.close()


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
