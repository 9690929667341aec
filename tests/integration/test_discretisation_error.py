"""What the edges of a linkage are worth: final results are followed by an amendment that tells it."""

import json

import pytest
from linkage_inputs import linkage  # noqa: F401


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
