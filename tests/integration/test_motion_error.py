"""The error of the motion that is shown: final results are followed by an amendment that tells it."""

import json
import warnings

import limber
import numpy as np
import pytest
from conftest import small_scene, tip_of
from linkage_inputs import linkage  # noqa: F401


def test_a_final_result_is_followed_by_its_error(session):
    session.wait(until="checked")
    with session.stream(timeout=30, snapshot=False) as stream:
        edited = session.add(node=tip_of(session), frame=30, displacement=(0, 0, 0.6)).session.revision
        read = []
        while not read or read[-1].result.revision < edited or read[-1].result.motion_error is None:
            read.append(next(stream))
    checked = read[-1]
    assert checked.result.final
    final = [one for one in read if one.result.final and one.result.motion_error is None and one.result.revision == edited]
    # Where the check was quicker than the stream, the amendment came in place of the final result.
    assert len(final) == 1 or checked.missed > 0 or read[-2].result.sequence == checked.result.sequence - 2
    for one in final:
        assert (checked.result.revision, checked.result.sequence) == (one.result.revision, one.result.sequence + 1)
        assert checked.result.since_edit_ms == one.result.since_edit_ms and checked.result.energy == one.result.energy
        np.testing.assert_array_equal(checked.positions, one.positions)
    error = checked.result.motion_error
    assert 0 < error.shape_error <= error.worst_frame_error < 1 and error.inverted_tets == 0
    assert error.frames == 17, "16 spread over 60 frames, and the constrained one, which is not among them"
    assert error.tolerance == pytest.approx(0.05) and error.within_tolerance == (error.shape_error <= 0.05)
    assert error.max_distance == pytest.approx(3 * error.max_distance_share), "the bar is 3 units long"
    assert session.status().result.HasField("motion_error")
    assert session.wait().motion_error == error, "what is there already is returned by later waits, too"


def test_waits_for_the_check_of_an_undone_edit(session):
    tip = tip_of(session)
    session.add(node=tip, frame=30, displacement=(0, 0, 0.6))
    before = session.wait(until="checked")
    assert before.revision == 1 and before.max_error != before.motion_error.max_constraint_error
    session.add(node=tip, frame=45, displacement=(0, 0.9, 0))
    assert session.wait(until="checked").motion_error.shape_error != before.motion_error.shape_error
    session.undo()
    back = session.wait(until="checked")
    assert back.revision == 3
    assert back.motion_error.shape_error == pytest.approx(before.motion_error.shape_error, rel=1e-3)


def test_a_linkage_has_no_motion_to_check(linkage):  # noqa: F811
    checked = linkage.wait(until="checked")
    assert checked.revision == linkage.revision and checked.motion_error is None


def test_targets_beyond_reach_are_reported(session, cli):
    session.dynamics(discretisation="differences", damping_ratio=0, force_smoothing=0)
    tip = tip_of(session)
    for frame, target in ((15, (0, 0, 30)), (30, (0, 12, -30)), (45, (10, -20, 0))):
        session.add(node=tip, frame=frame, displacement=target)
    result = session.wait(until="checked")
    # The mean over the motion may be within the tolerance, the worst frame is not.
    assert result.motion_error.inverted_tets > 0 and result.motion_error.worst_frame_error > 0.05
    for words in ("inverted in frame", "far outside of what the model was trained for", "Move targets nearer"):
        assert words in result.message
    printed = cli("wait", session.id, "--until", "checked")
    assert printed.returncode == 0 and "motion error" in printed.stdout and "Move targets nearer" in printed.stdout
    assert f"inverted tets     {result.motion_error.inverted_tets} in frame" in printed.stdout
    printed = json.loads(cli("--json", "wait", session.id, "--until", "checked").stdout)
    error = printed.get("motionError", printed.get("motion_error"))
    assert int(error.get("invertedTets", error.get("inverted_tets"))) == result.motion_error.inverted_tets
    assert "tets inverted" in cli("watch", session.id, "--count", "1").stdout


def test_a_model_that_misses_its_tolerance_warns(server, cli, tmp_path):
    scene = small_scene(tolerance=0.01)
    scene.model.basis_size = 4
    scene.model.cubature_size = 4
    with pytest.warns(limber.AccuracyWarning, match="misses its tolerance: mean relative error"):
        session = server.open(scene, progress=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = session.wait()
    assert "The model misses its tolerance: mean error" in result.message and "model.tolerance is 1 %" in result.message
    assert "above the tolerance" in session.status().message
    shown = cli("show", session.id)
    assert "tolerance NOT met" in shown.stdout and "The model misses its tolerance" in shown.stdout
    with pytest.warns(limber.AccuracyWarning):
        server.session(session.id)
    session.close()
    later = server.open(scene, wait=False)
    with pytest.warns(limber.AccuracyWarning):
        later.wait()
    session_file = tmp_path / "scene.json"
    later.export(tmp_path, formats=("scene",), stem="scene", progress=False)
    later.close()
    opened = cli("open", session_file)
    assert opened.returncode == 0, opened.stderr
    assert "warning: the model misses its tolerance" in opened.stderr and "tolerance NOT met" in opened.stdout


def test_a_model_within_its_tolerance_does_not_warn(server):
    with warnings.catch_warnings():
        warnings.simplefilter("error", limber.AccuracyWarning)
        session = server.open(small_scene(tolerance=0.1), progress=False)
        assert session.status().model.met_tolerance
        assert "misses its tolerance" not in session.wait().message
    session.close()
