"""What the edges of a linkage are worth: final results are followed by an amendment that tells it."""

import json

import pytest
from linkage_inputs import linkage  # noqa: F401
from refusals import refusal


def test_a_final_shape_is_followed_by_the_error_of_its_edges(linkage):  # noqa: F811
    linkage.deploy(50)
    final = linkage.wait()
    checked = linkage.wait(until="checked")
    assert checked.revision == final.revision and checked.sequence > final.sequence or checked == final
    assert checked.energy == final.energy and checked.since_edit_ms == final.since_edit_ms
    error = checked.discretisation_error
    assert error.known and error.message == ""
    assert 0 < error.position_error < 0.01 and 0 < error.energy_error < 0.01
    assert error.elements < error.compared_elements < 2 * error.elements
    assert error.tolerance == 0 and error.within_tolerance and error.check_ms > 0
    assert linkage.status().result.HasField("discretisation_error")
    assert linkage.wait().discretisation_error == error, "what is there already is returned by later waits, too"


def test_twice_as_many_edges_leave_a_quarter(server):
    errors = []
    for edges in (5, 10):
        scene = server.sample("hyperboloid")
        scene.linkage.edges_per_segment = edges
        opened = server.open(scene, progress=False)
        opened.deploy(50)
        errors.append(opened.wait(until="checked").discretisation_error)
        opened.close()
    assert errors[0].elements * 2 == errors[1].elements
    for quantity in ("position_error", "energy_error"):
        coarse, fine = (getattr(error, quantity) for error in errors)
        assert 3 < coarse / fine < 8, quantity


def test_the_command_line_says_it(linkage, cli):  # noqa: F811
    linkage.deploy(50)
    error = linkage.wait(until="checked").discretisation_error
    printed = cli("wait", linkage.id, "--until", "checked")
    assert f"edges             {error.elements}: positions off by" in printed.stdout
    printed = json.loads(cli("--json", "wait", linkage.id, "--until", "checked").stdout)
    told = printed.get("discretisationError", printed.get("discretisation_error"))
    assert float(told.get("positionError", told.get("position_error"))) == pytest.approx(error.position_error)


def test_edges_follow_a_tolerance(server, tmp_path):
    scene = server.sample("hyperboloid")
    scene.linkage.conditions.mean_angle_degrees = 50
    scene.linkage.ClearField("edges_per_segment")
    chosen = []
    for tolerance in (3e-3, 2e-4):
        scene.linkage.tolerance = tolerance
        opened = server.open(scene, progress=False)
        error = opened.wait(until="checked").discretisation_error
        assert error.within_tolerance and error.position_error <= error.tolerance == tolerance
        chosen.append(opened.scene().linkage.edges_per_segment)
        if len(chosen) == 2:
            opened.export(tmp_path, formats="scene", stem="chosen", progress=False)
        opened.close()
    assert 3 <= chosen[0] < chosen[1]
    saved = json.loads((tmp_path / "chosen.json").read_text())["linkage"]
    assert saved["edges_per_segment"] == chosen[1] and saved["tolerance"] == 2e-4
    scene.linkage.edges_per_segment = 3  # named, they hold: and what they miss is said
    coarse = server.open(scene, progress=False)
    missed = coarse.wait(until="checked")
    assert missed.discretisation_error.position_error > 2e-4 and not missed.discretisation_error.within_tolerance
    assert "tolerance" in missed.message and coarse.scene().linkage.edges_per_segment == 3
    coarse.close()
    again = server.open(tmp_path / "chosen.json", progress=False)
    assert again.wait().status == "CONVERGED"
    again.close()


def test_a_tolerance_that_is_none_is_refused(server):
    for tolerance, code in ((0, "OUT_OF_RANGE"), (-1, "OUT_OF_RANGE"), (0.2, "OUT_OF_RANGE"),
                            (float("nan"), "INVALID_ARGUMENT")):
        scene = server.sample("hyperboloid")
        scene.linkage.tolerance = tolerance
        assert refusal(lambda: server.open(scene)) == (code, "scene.linkage.tolerance")


def test_an_edit_that_takes_more_edges_is_followed_by_every_client(server):
    """A second client streams while the linkage is cut anew."""
    scene = server.sample("hyperboloid")
    scene.linkage.ClearField("edges_per_segment")
    scene.linkage.conditions.mean_angle_degrees = 15
    scene.linkage.tolerance = 1.5e-4
    opened = server.open(scene, progress=False)
    opened.wait(until="checked")
    coarse = opened.scene().linkage.edges_per_segment
    before = opened.geometry()
    watching = server.session(opened.reference)
    with watching.stream(timeout=60) as stream:
        opened.deploy(85)
        checked = opened.wait(until="checked")
        assert checked.discretisation_error.within_tolerance, checked.message
        assert f"in place of {coarse}" in checked.message
        seen = next(frames for frames in stream if frames.result.sequence >= checked.sequence)
        assert seen.positions.shape[1:] == (watching.geometry().nodes, 3)
    assert opened.scene().linkage.edges_per_segment > coarse
    assert opened.geometry().basis_hash != before.basis_hash
    assert len(opened.shape().centrelines[0]) == opened.geometry().edges[0] + 1 > before.edges[0] + 1
    opened.deploy(84)
    assert opened.wait().status == "CONVERGED"
    opened.close()
