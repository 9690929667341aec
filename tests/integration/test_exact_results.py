"""Final results of bodies are of the full map; bases grow and are fetched by their hash; explanations of sessions."""

import json

import limber
import numpy as np
import pytest
from conftest import tip_of
from linkage_inputs import linkage  # noqa: F401
from limber.messages import service


def test_final_results_are_exact_and_others_are_not(session):
    session.wait(until="checked")
    with session.stream(timeout=30, snapshot=False) as stream:
        revision = session.add(node=tip_of(session), frame=30, displacement=(0, 0, 0.6)).session.revision
        read = []
        while not read or read[-1].result.revision < revision or not read[-1].result.final:
            read.append(next(stream))
    assert read[-1].result.exact
    assert all(one.result.exact == one.result.final for one in read), [(one.result.revision, one.result.sequence) for one in read]
    checked = session.wait(until="checked")
    assert checked.motion_error.shape_error < 0.01, "shown by full reconstruction"
    assert checked.motion_error.max_constraint_error == pytest.approx(checked.max_error, abs=1e-4), "both are of the body"


def test_a_grown_basis_comes_as_its_new_columns(session):
    session.wait()
    before = session.geometry()
    session.add(node=tip_of(session), frame=30, displacement=(0.3, 1.2, 0.9))
    assert session.wait().exact
    whole = session.connection.call("get_geometry", service.GetGeometryRequest(session=session.reference))
    assert whole.basis_hash != before.basis_hash and whole.known_columns == 0
    rest = session.connection.call("get_geometry", service.GetGeometryRequest(
        session=session.reference, known_basis_hash=before.basis_hash))
    columns = before.basis.shape[2]
    assert rest.known_columns == columns and rest.basis.shape[2] == whole.basis.shape[2] - columns
    grown = session.geometry()
    np.testing.assert_array_equal(grown.basis[:, :, :columns], before.basis)
    older = session.geometry(before.basis_hash)
    np.testing.assert_array_equal(older.basis, before.basis)
    with pytest.raises(limber.LimberError, match="no such basis"):
        session.geometry("0123")


def test_a_second_client_reads_frames_while_the_basis_grows(session):
    """Each frame is decoded with its own basis."""
    session.wait()
    reader = limber.connect(session.connection.endpoint).session(session.reference)
    tip = tip_of(session)
    with reader.stream(timeout=30) as stream:
        held = session.add(node=tip, frame=30, displacement=(0, 0, 0.6))
        hashes = set()
        for step in range(1, 6):
            target = (0.1 * step, 0.4 * step, 0.6 - 0.2 * step)
            held.move(target)
            revision = session.wait().revision
            for message in stream:
                if message.result.revision >= revision and message.result.final:
                    break
            hashes.add(message.raw.basis_hash)
            rest = np.asarray(session.geometry().rest)
            miss = np.linalg.norm(message.positions[30, tip] - rest[tip] - target)
            assert miss == pytest.approx(message.result.max_error, rel=1e-3, abs=1e-5), "in the frames a client gets"
    assert len(hashes) > 1


# --- What a final result says of other optima, and of targets beyond reach


def test_a_wide_motion_says_how_many_starts_were_compared_and_how_far_apart_they_were(session):
    for node, frame, displacement in ((59, 10, (-2.47, -0.26, 0.25)), (49, 22, (0.11, -1.62, 1.9)),
                                      (46, 34, (0.7, -1.79, 1.6)), (57, 46, (-0.85, 1.49, -1.82))):
        session.add(node=node, frame=frame, displacement=displacement)
    result = session.wait(until="checked")
    starts = result.starts
    assert result.converged and starts.budget == 7
    assert 1 <= starts.optima and starts.optima + starts.unconverged <= starts.compared <= starts.budget
    assert result.energy == pytest.approx(starts.lowest_energy, rel=1e-3), "the lowest one is shown"
    # Several optima are told; starts that agree are counted alone.
    told = f"{starts.compared} starts were compared and ended in {starts.optima} different optima" in result.message
    assert told == (starts.optima > 1) == (starts.largest_distance > 1e-3)


def test_starts_that_agree_are_counted_and_small_motions_are_not_compared(session):
    ids = [session.add(node=tip_of(session), frame=frame, displacement=(0, reach, 0))
           for frame, reach in ((15, 0.3), (30, -0.3))]
    assert session.wait(until="checked").starts is None
    for held, reach in zip(ids, (1.5, -1.5)):
        held.move((0, reach, 0))
    result = session.wait(until="checked")
    assert result.starts.optima == 1 and result.starts.compared == result.starts.budget
    assert result.starts.largest_distance < 1e-4 and "starts were compared" not in result.message


def test_a_target_beyond_reach_is_told_with_its_constraint_and_what_is_left(session):
    session.add(node=tip_of(session), frame=15, displacement=(0, 0.1, 0))
    far = session.add(node=tip_of(session), frame=30, displacement=(0, 60, 0), weight=1e-3)
    result = session.wait(until="checked")
    missed, = result.out_of_reach
    assert missed.constraint == far.id and missed.distance == pytest.approx(result.max_error, rel=1e-6)
    assert f"Constraint {far.id} in frame 30 is out of reach" in result.message


def test_explains_a_body(session):
    session.wait(until="checked")
    said = session.explain()
    choices = {choice.name: choice for choice in said.choices}
    model = session.status().model
    assert choices["modes (r)"].number == model.modes
    assert choices["cubature tets (T)"].number == model.cubature_size
    assert all(choice.reason for choice in said.choices)
    errors = {error.quantity: error for error in said.errors}
    shapes = errors["shapes of the shown motion"]
    assert shapes.value == session.status().result.motion_error.shape_error and "reconstructions" in shapes.method
    assert said.advice


def test_the_command_line_explains(cli, session):
    session.wait(until="checked")
    text = cli("explain", session.id).stdout
    assert "modes (r): " in text and "cost: " in text and "Which error to expect" in text
    parsed = json.loads(cli("--json", "explain", session.id).stdout)
    assert {"choices", "errors", "advice"} <= parsed.keys()


def test_explains_a_linkage(linkage, cli):  # noqa: F811
    linkage.wait(until="checked")
    said = linkage.explain()
    choices = {choice.name: choice for choice in said.choices}
    error = linkage.status().result.discretisation_error
    assert choices["edges per segment"].number > 2 and "equilibria" in choices["path of the solve"].value
    positions = next(one for one in said.errors if one.quantity == "positions")
    assert positions.value == error.position_error > 0 and "halved" in positions.method
    assert any("edges_per_segment" in advice.change for advice in said.advice)
    assert "positions: " in cli("explain", linkage.id).stdout


def test_explains_beams(server, cli):
    session = server.open(server.sample("arch"), progress=False)
    session.wait(until="checked")
    said = session.explain()
    error = session.status().result.discretisation_error
    assert {choice.name for choice in said.choices} >= {"elements", "path of the solve"}
    positions = next(one for one in said.errors if one.quantity == "positions")
    assert positions.value == error.position_error > 0
    assert any("elements_per_member" in advice.change for advice in said.advice)
    assert "Which error to expect" in cli("explain", session.id).stdout
    session.close()
