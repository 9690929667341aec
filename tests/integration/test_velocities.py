"""Constraints on the velocity of nodes: what the frames of a server do, by differences of their positions."""

import json

import limber
import numpy as np
import pytest
from conftest import small_scene, tip_of


def velocity_of(session, node, frame):
    """The central difference of the frames that a client gets, one-sided at the ends [length unit / s]."""
    motion = session.frames()
    since, until = max(0, frame - 1), min(len(motion) - 1, frame + 1)
    rate = session.scene().dynamics.frames_per_second or 30
    return (motion[until, node].astype(float) - motion[since, node]) / (until - since) * rate


def test_an_exact_velocity_is_that_of_the_frames(session):
    tip = tip_of(session)
    held = session.add(node=tip, frame=30, velocity=(0.5, 2, -1), exact=True)
    assert held.kind == "velocity" and held.issues == ()
    result = session.wait()
    assert result.status == "CONVERGED"
    np.testing.assert_allclose(velocity_of(session, tip, 30), (0.5, 2, -1), atol=2e-4)
    assert result.max_exact_velocity_error < 1e-6 and result.max_error == 0 == result.max_exact_error
    held.move((0, 3, 0))
    session.wait()
    np.testing.assert_allclose(velocity_of(session, tip, 30), (0, 3, 0), atol=2e-4)
    held.replace(nodes=[tip, tip - 1], frame=20, velocity=(0, 1, 1), axes="yz", exact=True)
    session.wait()
    mean = (velocity_of(session, tip, 20) + velocity_of(session, tip - 1, 20)) / 2
    np.testing.assert_allclose(mean[1:], (1, 1), atol=2e-4)
    session.undo()
    session.wait()
    np.testing.assert_allclose(velocity_of(session, tip, 30), (0, 3, 0), atol=2e-4)
    session.dynamics(frames_per_second=60)
    session.wait()
    np.testing.assert_allclose(velocity_of(session, tip, 30), (0, 3, 0), atol=4e-4)
    held.remove()
    assert session.wait().energy == pytest.approx(0, abs=1e-12)


def test_a_soft_velocity_is_missed_by_the_reported_error(session):
    tip = tip_of(session)
    session.add(node=tip, frame=30, displacement=(0, 0.3, 0))
    session.add(node=tip, frame=30, velocity=(0, 3, 0), weight=0.05)
    result = session.wait(until="checked")
    missed = np.linalg.norm(velocity_of(session, tip, 30) - (0, 3, 0))
    assert result.max_velocity_error == pytest.approx(missed, abs=2e-4) and missed > 0.01
    assert result.max_exact_velocity_error == 0 < result.max_error
    # Of the full shapes: off by as much as the model is, which was asked for 5 % only.
    assert result.motion_error.max_velocity_error == pytest.approx(missed, abs=0.05 * 3)
    assert result.motion_error.max_velocity_error != result.max_velocity_error


def test_another_kind_of_target(session):
    tip = tip_of(session)
    held = session.add(node=tip, frame=30, displacement=(0, 0.3, 0), exact=True)
    held.move(velocity=(0, 1, 0))
    assert held.kind == "velocity" and session.constraints()[0].kind == "velocity"
    session.wait()
    np.testing.assert_allclose(velocity_of(session, tip, 30), (0, 1, 0), atol=2e-4)
    held.move(displacement=(0, 0.2, 0))
    result = session.wait()
    assert result.max_exact_error < 1e-6 and result.max_velocity_error == 0


def test_what_has_no_effect_is_reported(session):
    [issue] = session.add(node=tip_of(session), frame=0, velocity=(0, 1, 0)).issues
    assert "frames 0 and 1, whose difference is the velocity, are held by the end" in issue
    fixed = int(session.scene().fixed_nodes[0])
    [issue] = session.add(node=fixed, frame=30, velocity=(0, 1, 0)).issues
    assert "fixed" in issue


def test_what_is_wrong_is_named(session):
    tip = tip_of(session)
    for given in ({}, {"velocity": (1, 0, 0), "displacement": (0, 0, 0)}):
        with pytest.raises(limber.LimberError, match="give one of position, displacement and velocity") as caught:
            session.add(node=tip, frame=30, **given)
        assert caught.value.field == "target"
    with pytest.raises(limber.LimberError) as caught:
        session.add(node=tip, frame=60, velocity=(1, 0, 0))
    assert (caught.value.code, caught.value.field) == ("OUT_OF_RANGE", "edits[0].add.constraint.frame")


def test_scenes_carry_velocities(server, tmp_path):
    scene = small_scene()
    made = server.open(scene, progress=False)
    tip = tip_of(made)
    made.add(node=tip, frame=30, velocity=(0, 2, 0), exact=True)
    energy = made.wait().energy
    [path] = [path for path in made.export(tmp_path / "saved", formats=("scene",)) if str(path).endswith(".json")]
    made.close()
    [held] = json.loads(open(path, encoding="utf-8").read())["constraints"]
    assert held["velocity"]["y"] == 2 and held["exact"] is True
    again = server.open(str(path), progress=False)
    assert again.wait().energy == pytest.approx(energy, rel=1e-6)
    np.testing.assert_allclose(velocity_of(again, tip, 30), (0, 2, 0), atol=2e-4)
    again.close()
