"""Material optimisation as users reach it."""

import subprocess
import sys

import limber
import numpy as np
import pytest
from conftest import ROOT, small_scene

FPS = 30


def swinging(**options):
    scene = small_scene(60, frames_per_second=FPS, period_frames=24, **options)
    tip = 62
    for frame, height in ((20, 0.5), (30, -0.4), (40, 0.3)):
        constraint = scene.constraints.add(frame=frame, nodes=[tip])
        constraint.displacement.z = height
    return scene


@pytest.fixture()
def fitted(server):
    session = server.open(swinging(optimise="all", modes=6, candidate_modes=12), progress=False)
    yield session
    session.close()


def test_forces_fall_and_the_material_is_reported_in_si_units(server, fitted):
    plain = server.open(swinging(modes=6), progress=False)
    before, after = plain.wait(), fitted.wait()
    assert after.material_iterations > 0 == before.material_iterations
    assert after.unit_force_energy < 0.2 * before.unit_force_energy
    assert after.max_error <= before.max_error * 1.01
    assert after.energy == pytest.approx(after.force_energy + after.constraint_energy + after.column_energy, rel=1e-9)

    material = fitted.material()
    assert len(material.modes) == len(material.initial) == 6 and material.mixing.shape == (12, 6)
    # 24 frames a swing at 30 frames a second; lambda of the difference equation is a little faster.
    assert material.initial[0].frequency == pytest.approx(FPS / 24, rel=0.01)
    assert all(mode.stiffness >= 0 and mode.damping >= 0 and 0 <= mode.frequency <= FPS / 2 for mode in material.modes)
    np.testing.assert_allclose(np.linalg.norm(material.mixing, axis=0), 1, atol=0.05)
    own = plain.material()
    assert own.modes == own.initial and (own.mixing == np.eye(6)).all()
    plain.close()


def test_fitted_motions_do_not_shake(server, fitted):
    result, material = fitted.wait(), fitted.material()
    assert 0 <= result.high_frequency_share <= 1e-5
    # An eighth of the frames per second; the difference equation's own frequency is not above it.
    assert all(mode.frequency <= FPS / 8 * (1 + 1e-9) for mode in material.modes if mode.damping == 0)
    slow = server.open(swinging(optimise="all", modes=6, candidate_modes=12, max_frequency_hz=2.0, slow_steps=3),
                       progress=False)
    slow.wait()
    assert all(mode.frequency <= 2.0 * (1 + 1e-9) for mode in slow.material().modes if mode.damping == 0)
    optimisation = slow.scene().material_optimisation
    assert (optimisation.max_frequency_hz, optimisation.slow_steps) == (2.0, 3)
    slow.close()


def test_freeze_reset_and_undo(fitted):
    first, material = fitted.wait(), fitted.material()
    fitted.freeze_material()
    assert fitted.wait().energy == pytest.approx(first.energy, rel=1e-5)
    assert (fitted.material().mixing == material.mixing).all()
    fitted.reset_material()
    reset = fitted.wait()
    assert reset.energy > first.energy
    assert fitted.material().modes == material.initial
    fitted.undo()
    assert fitted.wait().energy == pytest.approx(first.energy, rel=1e-5)
    assert fitted.material().modes == material.modes
    fitted.optimise("dynamics")
    assert fitted.wait().material_iterations > 0


def test_the_stream_shows_forces_first_and_then_the_material(fitted):
    fitted.wait()
    with fitted.stream() as stream:
        fitted.move(fitted.constraints()[0], (0, 0, 0.6))
        steps = []
        for frames in stream:
            if frames.result.revision < fitted.revision:
                continue
            steps.append(frames.result.material_iterations)
            if frames.result.final:
                break
    assert steps[0] == 0 and steps[-1] > 0 and steps == sorted(steps)


@pytest.mark.parametrize("options, field", [
    (dict(modes=6, candidate_modes=5), "scene.model.candidate_modes"),
    (dict(modes=6, candidate_modes=100000), "scene.model.candidate_modes"),
    (dict(modes=100000), "scene.model.modes"),
    (dict(modes=6, column_weight=-1.0), "scene.material_optimisation.column_weight"),
    (dict(modes=6, max_frequency_hz=0.0), "scene.material_optimisation.max_frequency_hz"),
    (dict(modes=6, max_frequency_hz=15.1, frames_per_second=FPS), "scene.material_optimisation.max_frequency_hz"),
    (dict(modes=6, slow_steps=1001), "scene.material_optimisation.slow_steps"),
    (dict(constraint_tolerance=0.0), "scene.constraint_tolerance"),
    (dict(modes=6, period_frames=-3.0), "scene.dynamics.period_frames"),
])
def test_bad_input_names_its_field(server, options, field):
    scene = small_scene(60, optimise="all", **options)
    with pytest.raises(limber.LimberError) as caught:
        server.open(scene, progress=False)
    assert caught.value.field == field


def test_an_edit_says_what_to_optimise(fitted):
    with pytest.raises(limber.LimberError) as caught:
        fitted.edit([{"set_material": {}}])
    assert caught.value.field == "edits[0].set_material.variables"
    with pytest.raises(limber.LimberError):
        fitted.optimise("everything")


def test_command_line(cli, fitted):
    fitted.wait()
    table = cli("material", fitted.id).stdout
    assert "frequency [Hz]" in table and "optimised: all" in table
    assert "revision 1" in cli("material", fitted.id, "--freeze").stdout
    fitted.revision = 1
    fitted.wait()
    assert "optimised: motion" in cli("material", fitted.id).stdout
    assert "revision 2" in cli("material", fitted.id, "--reset", "--optimise", "dynamics").stdout


def test_the_example():
    process = subprocess.run([sys.executable, str(ROOT / "examples" / "fit_material.py")], capture_output=True, text=True,
                             timeout=120)
    assert process.returncode == 0, process.stderr
    rows = {line.split()[0]: float(line.split()[1]) for line in process.stdout.splitlines()[1:4]}
    assert rows["all"] < rows["dynamics"] < rows["motion"]
    assert rows["all"] < 0.1 * rows["motion"]
