"""Forces, moments and utilisation along elements: loads within a span are part of them, in every client."""

import json

import limber
import numpy as np
import pytest
from limber.beams.solutions import FORCES

Q = 5000.0  # N/m
LENGTH = 6.0
JOIST_MOMENT = Q * LENGTH**2 / 8


def joist(elements=1, **support):
    """Simply supported, 0.1 m by 0.3 m of timber, with an even load."""
    held = {"fix_x": True, "fix_y": True, "fix_z": True, "fix_rotation_x": True}
    return {"nodes": [{"position": {"x": LENGTH * i / elements}} for i in range(elements + 1)],
            "sections": [{"rectangle": {"width": 0.1, "height": 0.3}, "young": 11e9, "poisson": 0.3, "yield_stress": 24e6}],
            "elements": [{"start": i, "finish": i + 1} for i in range(elements)],
            "supports": [{"node": 0, **held, **support}, {"node": elements, "fix_y": True, "fix_z": True, **support}],
            "distributed_loads": [{"element": i, "force": {"z": -Q}} for i in range(elements)]}


def test_a_joist_of_one_element_has_its_moment_within_the_span(server):
    answer = server.solve_beams(joist(), progress=False, stations=21)
    assert answer.converged
    assert answer.utilisation == pytest.approx(0.625, abs=1e-3)
    assert abs(answer.peaks("moment_2")[0]) == pytest.approx(JOIST_MOMENT, rel=1e-3)
    assert answer.governing_places[0] == pytest.approx(0.5, abs=1e-3)
    assert np.allclose(answer.bending_moments, 0, atol=1)
    expected = 4 * JOIST_MOMENT * answer.places * (1 - answer.places)
    moments = answer.along("moment_2")
    assert moments.shape == (1, 21) and np.allclose(np.abs(moments[0]), expected, atol=1e-3 * JOIST_MOMENT)
    assert np.allclose(np.abs(answer.along("shear_3")[0]), Q * LENGTH * np.abs(0.5 - answer.places), atol=20)
    assert answer.along("utilisation").max() == pytest.approx(answer.utilisation, rel=1e-6)
    assert answer.along("stress")[0, 10] == pytest.approx(answer.stresses[0], rel=1e-6)
    least, least_place, largest, largest_place = answer.extremes[0, FORCES.index("moment_2")]
    assert {round(place, 3) for place in (least_place, largest_place)} >= {0.5}
    assert max(-least, largest) == pytest.approx(JOIST_MOMENT, rel=1e-3)


@pytest.mark.parametrize("elements", [1, 2, 4, 16])
def test_clamped_moments_do_not_depend_on_the_number_of_elements(server, elements):
    clamp = {f"fix_{axis}": True for axis in ("x", "rotation_x", "rotation_y", "rotation_z")}
    answer = server.solve_beams(joist(elements, **clamp), progress=False)
    assert abs(answer.bending_moments[0, 0, 0]) == pytest.approx(Q * LENGTH**2 / 12, rel=2e-3)
    assert abs(answer.reaction_moments[0, 1]) == pytest.approx(Q * LENGTH**2 / 12, rel=2e-3)
    assert np.abs(answer.along("moment_2")).max() == pytest.approx(Q * LENGTH**2 / 12, rel=2e-3)


def test_sessions_have_the_same_and_their_error_covers_moments(server):
    session = server.open({"beams": {"structure": joist()}}, progress=False)
    error = session.wait(until="checked").discretisation_error
    assert error.known and error.within_tolerance
    assert error.moment_error < 1e-3 and error.utilisation_error < 1e-3
    assert error.worst_moment_element == error.worst_utilisation_element == 0
    solution = session.solution(stations=5)
    assert solution.along("moment_2").shape == (1, 5) and solution.utilisation == pytest.approx(0.625, abs=1e-3)
    assert session.wait().utilisation == solution.utilisation
    assert session.solution(stations=0).stations.shape == (1, 0, 8)
    for stations in (1, 202):
        with pytest.raises(limber.LimberError) as caught:
            session.solution(stations=stations)
        assert caught.value.field == "stations"
    session.close()


def test_a_portal_of_one_element_a_member_is_within_its_tolerance(server):
    """Slope deflection: a corner turns by (q L^2 / 12) / (2 E I_b / L + 4 E I_c / H), a column takes 4 E I_c / H of that."""
    height, q, side, depth, young, strength = 3.0, 2000.0, 0.2, 0.3, 11e9, 24e6
    column, girder = ({"rectangle": {"width": side, "height": tall}, "young": young, "poisson": 0.3, "yield_stress": strength}
                      for tall in (side, depth))
    clamped = {f"fix_{axis}": True for axis in ("x", "y", "z", "rotation_x", "rotation_y", "rotation_z")}
    portal = {"nodes": [{"position": {"x": x, "z": z}} for x, z in ((0, 0), (0, height), (LENGTH, height), (LENGTH, 0))],
              "sections": [column, girder],
              "elements": [{"start": i, "finish": i + 1, "section": int(i == 1),
                            "normal": {"z": 1} if i == 1 else {"x": 1}} for i in range(3)],
              "supports": [{"node": 0, **clamped}, {"node": 3, **clamped}],
              "distributed_loads": [{"element": 1, "force": {"z": -q}}]}
    inertia_column, inertia_girder = side**4 / 12, side * depth**3 / 12
    of_column = 4 * young * inertia_column / height
    corner = of_column * q * LENGTH**2 / 12 / (2 * young * inertia_girder / LENGTH + of_column)
    expected = (corner * 6 / side**3 + q * LENGTH / 2 / side**2) / strength
    session = server.open(limber.beam_scene(portal, tolerance=1e-3), progress=False)
    error = session.wait(until="checked").discretisation_error
    solution = session.solution(stations=5)
    assert np.asarray(solution.utilisations)[[0, 2]] == pytest.approx(expected, rel=0.02)
    assert error.known and error.within_tolerance and error.utilisation_error < 0.02
    session.close()


def test_a_cut_joist_has_the_functions_of_the_whole(server):
    session = server.open(limber.beam_scene(joist(), elements_per_member=7), progress=False)
    session.wait()
    solution = session.solution()
    expected = 4 * JOIST_MOMENT * solution.places * (1 - solution.places)
    assert np.allclose(np.abs(solution.along("moment_2")[0]), expected, atol=1e-3 * JOIST_MOMENT)
    assert abs(solution.peaks("moment_2")[0]) == pytest.approx(JOIST_MOMENT, rel=1e-3)
    assert solution.governing_places[0] == pytest.approx(0.5, abs=1e-3)
    session.close()


def test_tables_and_the_command_line_have_stations(server, cli, tmp_path):
    answer = server.solve_beams(joist(), files=("csv", "json"), progress=False, stations=5)
    assert {path.name for path in answer.write(tmp_path)} >= {"beams_stations.csv"}
    table = np.genfromtxt(tmp_path / "beams_stations.csv", delimiter=",", names=True)
    assert list(table["place"]) == [0, 0.25, 0.5, 0.75, 1] and set(table["element"]) == {0}
    assert np.allclose(table["moment_2"], answer.along("moment_2")[0])
    assert np.allclose(table["utilisation"], answer.along("utilisation")[0])
    elements = np.genfromtxt(tmp_path / "beams_elements.csv", delimiter=",", names=True)
    assert max(-elements["moment_2_least"], elements["moment_2_largest"]) == pytest.approx(JOIST_MOMENT, rel=1e-3)
    read = json.loads((tmp_path / "beams.json").read_text())
    assert [station["place"] for station in read["elements"][0]["stations"]] == [0, 0.25, 0.5, 0.75, 1]
    assert read["units"]["moment_2"] == "N m"
    scene = tmp_path / "joist.json"
    scene.write_text(json.dumps(joist()))
    printed = cli("beams", scene)
    assert printed.returncode == 0, printed.stderr
    assert "utilisation  0.625, in element 0 at 0.500 of its length" in printed.stdout
    assert "2.25e+04 N m about axis 2, in element 0 at 0.500 of its length" in printed.stdout
    with pytest.raises(limber.LimberError, match="stations"):
        server.solve_beams(joist(), stations=1)


def test_stresses_of_tubes_do_not_depend_on_the_normal(server):
    outer, inner, force = 0.03, 0.025, 1000.0
    expected = force * outer / (np.pi / 4 * (outer**4 - inner**4))
    for angle in (0.0, 0.5, np.pi / 4):
        structure = {"nodes": [{"position": {"x": 0}}, {"position": {"x": 1}}],
                     "sections": [{"tube": {"outer_radius": outer, "inner_radius": inner}, "young": 2.1e11, "poisson": 0.3,
                                   "yield_stress": 2e8}],
                     "elements": [{"start": 0, "finish": 1, "normal": {"y": np.sin(angle), "z": np.cos(angle)}}],
                     "supports": [{"node": 0, **{f"fix_{a}": True for a in
                                                 ("x", "y", "z", "rotation_x", "rotation_y", "rotation_z")}}],
                     "loads": [{"node": 1, "force": {"y": force / np.sqrt(2), "z": force / np.sqrt(2)}}]}
        assert server.solve_beams(structure, progress=False).stresses[0] == pytest.approx(expected, rel=3e-3), angle


def test_the_error_of_sagging_cables_is_unknown(server):
    structure = {"nodes": [{"position": {"x": x}} for x in (0, 10, 20)],
                 "sections": [{"tube": {"outer_radius": 0.01}, "young": 1.6e11, "poisson": 0.3, "density": 7850}],
                 "elements": [{"start": i, "finish": i + 1, "kind": "BEAM_KIND_CABLE", "rest_length": 10.5} for i in (0, 1)],
                 "supports": [{"node": node, "fix_x": True, "fix_y": True, "fix_z": True} for node in (0, 2)],
                 "gravity": {"z": -9.81}}
    session = server.open({"beams": {"structure": structure}}, progress=False)
    result = session.wait(until="checked")
    error = result.discretisation_error
    assert not error.known and not error.within_tolerance and error.position_error is None
    assert error.moment_error is None and "element 0 is a cable that sags" in error.message
    assert "could not be estimated" in result.message
    session.close()
    solved = server.solve_beams(structure)
    assert solved.converged and not solved.discretisation_error.known
    assert "element 0 is a cable that sags" in solved.message
