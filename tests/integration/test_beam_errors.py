"""The error of a structure's elements: told behind every final result, and kept below a tolerance."""

import json
import os
from pathlib import Path

import limber
import numpy as np
import pytest
from conftest import ROOT
from refusals import refusal
from test_beam_sessions import opened
from test_beams import cantilever

FINEST = 64  # parts of an element that count as the limit


def tip_of(session):
    return session.solution().positions[-1]


@pytest.fixture
def arm(server):
    """Four elements of 1 m under 10 N: bent by a radian."""
    session = opened(server, cantilever(4, 10))
    yield session
    session.close()


def test_a_final_result_is_followed_by_its_error(arm, server):
    limit = server.open(limber.beam_scene(arm.structure(), elements_per_member=FINEST), progress=False)
    limit.wait()
    with arm.stream(timeout=30, snapshot=False) as stream:
        edited = arm.load(4, force=(0, 0, -9)).revision
        read = []
        while not read or read[-1].result.revision < edited or read[-1].result.discretisation_error is None:
            read.append(next(stream))
    final, checked = read[-2:]
    assert final.result.final and final.result.discretisation_error is None
    assert (checked.result.revision, checked.result.sequence) == (final.result.revision, final.result.sequence + 1)
    assert checked.result.since_edit_ms == final.result.since_edit_ms and checked.result.energy == final.result.energy
    np.testing.assert_array_equal(checked.positions, final.positions)
    limit.load(4, force=(0, 0, -9))
    limit.wait()
    error = checked.result.discretisation_error
    true = np.linalg.norm(tip_of(arm) - tip_of(limit))
    assert true / 3 < error.max_distance < 3 * true, "within a factor of three of the true error"
    assert error.position_error == pytest.approx(error.max_distance), "the arm is 1 m long"
    assert error.worst_node == 4 and error.elements == 4 and error.compared_elements >= 8
    assert error.tolerance == 0 and error.within_tolerance and error.check_ms > 0
    assert arm.wait(until="checked").discretisation_error == error
    limit.close()


def test_a_tolerance_chooses_the_elements(server):
    structure = cantilever(4, 10)
    limit = server.open(limber.beam_scene(structure, elements_per_member=FINEST), progress=False)
    limit.wait()
    session = server.open(limber.beam_scene(structure, tolerance=1e-6), progress=False)
    result = session.wait()
    error = result.discretisation_error
    assert result.final and error is not None, "a final result has met it"
    assert error.tolerance == 1e-6 and error.within_tolerance and 4 < error.elements < 4 * FINEST
    assert np.linalg.norm(tip_of(session) - tip_of(limit)) < 1e-6
    assert session.frames().shape[1] == 5 and len(session.solution().axial_forces) == 4, "of the structure as it came"
    assert session.scene().beams.tolerance == 1e-6
    assert limit.scene().beams.elements_per_member == FINEST
    session.load(4, force=(0, 0, -20))
    assert session.wait().discretisation_error.within_tolerance
    session.close()
    limit.close()


def test_a_solution_tells_its_error_as_a_session_does(server, arm, cli, tmp_path):
    error = server.solve_beams(cantilever(4, 10)).discretisation_error
    known = arm.wait(until="checked").discretisation_error
    for name in ("position_error", "max_distance", "energy_error", "moment_error"):
        assert getattr(error, name) == pytest.approx(getattr(known, name), rel=1e-6), name
    assert (error.worst_node, error.elements) == (4, 4) and error.tolerance == 0
    coarse = server.solve_beams(cantilever(1, 10))
    assert coarse.discretisation_error.position_error > 0.01 and "use shorter elements" in coarse.message
    quick = server.solve_beams(cantilever(1, 10), estimate=False)
    assert quick.discretisation_error is None and "shorter" not in quick.message
    file = tmp_path / "arm.json"
    file.write_text(json.dumps(cantilever(1, 10)))
    assert "elements     positions off by" in cli("beams", str(file)).stdout
    assert "elements     " not in cli("beams", str(file), "--no-estimate").stdout


def test_explicit_elements_win(server, cli):
    scene = limber.beam_scene(cantilever(2), elements_per_member=2, tolerance=1e-9)
    session = server.open(scene, progress=False)
    result = session.wait(until="checked")
    assert result.discretisation_error.elements == 4 and not result.discretisation_error.within_tolerance
    assert "use shorter elements" in result.message
    printed = cli("wait", session.id, "--until", "checked").stdout
    assert "discretisation    positions off by" in printed and "4 elements against" in printed
    assert "% of the size" in cli("watch", session.id, "--count", "1").stdout
    session.close()


def test_an_edit_interrupts_the_estimate(server):
    session = opened(server, cantilever(400))
    session.wait()
    for i in range(1, 6):
        session.load(400, force=(0, 0, -1 - 0.01 * i))
        assert session.wait().discretisation_error is None, "the estimate comes behind"
    checked = session.wait(until="checked")
    assert checked.revision == 5 and checked.discretisation_error.compared_elements == 800
    session.close()


@pytest.mark.parametrize("options, field", [
    ({"elements_per_member": 0}, "scene.beams.elements_per_member"),
    ({"elements_per_member": 65}, "scene.beams.elements_per_member"),
    ({"tolerance": 0.0}, "scene.beams.tolerance"),
    ({"tolerance": 0.2}, "scene.beams.tolerance"),
])
def test_what_is_out_of_range_is_named(server, options, field):
    scene = limber.beam_scene(cantilever(4), **options)
    assert refusal(lambda: server.open(scene, progress=False)) == ("OUT_OF_RANGE", field)


@pytest.mark.timeout(300)
def test_roof_is_refined_until_its_positions_and_moments_hold(server):
    folder = Path(os.environ.get("LIMBER_SHARED", ROOT.parent / "shared")) / "data" / "beams" / "roof"
    if not folder.exists():
        pytest.skip(f"{folder} is not there")
    session = server.open(limber.beam_scene(folder, tolerance=1e-3), progress=False, timeout=280)
    result = session.wait(timeout=280)
    assert result.status == "CONVERGED" and result.discretisation_error.within_tolerance
    assert result.discretisation_error.moment_error < 0.01, "18 % where no element is cut"
    assert 848 < result.discretisation_error.elements < 8 * 848
    session.close()
