"""Structures of beams through the service, over real sockets."""

import json
import re
import subprocess
import sys

import limber
import numpy as np
import pytest
from conftest import ROOT

CLAMPED = {name: True for name in ("fix_x", "fix_y", "fix_z", "fix_rotation_x", "fix_rotation_y", "fix_rotation_z")}


def cantilever(elements=20, load=1.0):
    """Along x, L = 1 m, EI = 1 N m^2, a force down at its tip: under 1 N it bends by 0.30172 (elastica)."""
    return {
        "nodes": [{"position": {"x": i / elements}} for i in range(elements + 1)],
        "sections": [{"rectangle": {"width": 0.01, "height": 0.01}, "young": 12e8, "poisson": 0.3,
                      "yield_stress": 1e9}],
        "elements": [{"start": i, "finish": i + 1} for i in range(elements)],
        "supports": [{"node": 0, **CLAMPED}],
        "loads": [{"node": elements, "force": {"z": -load}}],
    }


def job_folder(folder, elements=10):
    """The same as a job of the public relaxation code."""
    lines = ["ply", "format ascii 1.0", f"element vertex {elements + 1}",
             *(f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")),
             f"element edge {elements}", "property int vertex1", "property int vertex2", "end_header"]
    lines += [f"{i / elements} 0 0 0 0 1" for i in range(elements + 1)]
    lines += [f"{i} {i + 1}" for i in range(elements)]
    (folder / "beam.ply").write_text("\n".join(lines) + "\n")
    (folder / "SimulationJob.json").write_text(json.dumps({
        "label": "cantilever", "mesh filename": "beam.ply", "cross section dim": [0.01, 0.01],
        "beam material": [0.3, 12e8], "fixed vertices": [[0, [0, 1, 2, 3, 4, 5]]],
        "forces": [[elements, [0, 0, -1, 0, 0, 0]]]}))
    return folder


def vtu_array(path, name, dtype):
    """An array of a .vtu with raw appended data; VTK 9.1 reads all of it. meshio 5.0 rewrites offsets
    one by one while it looks for them, and finds one that it has rewritten where numbers coincide."""
    content = path.read_bytes()
    offset = int(re.search(rb'Name="%s"[^>]* offset="(\d+)"' % name.encode(), content)[1])
    begin = content.index(b'<AppendedData encoding="raw">\n_') + len(b'<AppendedData encoding="raw">\n_') + offset
    size = int.from_bytes(content[begin:begin + 8], "little")
    return np.frombuffer(content[begin + 8:begin + 8 + size], dtype)


def refusal(server, structure, **options):
    with pytest.raises(limber.LimberError) as caught:
        server.solve_beams(structure, progress=False, **options)
    return caught.value


def test_a_cantilever_bends_as_the_elastica_does(server):
    answer = server.solve_beams(cantilever(), progress=False)
    assert answer.converged and answer.method == "newton" and answer.load_factor == 1
    assert abs(answer.positions[-1, 2] + 0.30172) < 1e-4 and answer.positions.shape == (21, 3)
    assert np.allclose(answer.reaction_forces[0], (0, 0, 1), atol=1e-6)
    lever = answer.positions[-1, 0]
    assert abs(abs(answer.bending_moments[0, 0, 0]) - lever) < 1e-3, "force times lever at the clamp"
    assert abs(answer.reaction_moments[0, 1] + lever) < 1e-3
    assert answer.element_energies.sum() == pytest.approx(answer.energy)
    assert answer.utilisations.argmax() == 0 and answer.utilisations[0] == pytest.approx(answer.stresses[0] / 1e9)


def test_relaxation_agrees_and_shows_the_path(server):
    wanted = server.solve_beams(cantilever(10), progress=False)
    answer = server.solve_beams(cantilever(10), method="relaxation", shapes=12, progress=False)
    assert answer.method == "relaxation" and answer.relaxation_steps > 0
    assert np.abs(answer.positions - wanted.positions).max() < 1e-4
    assert 2 <= len(answer.shapes) <= 12 and abs(answer.shapes[0, -1, 2]) < abs(answer.shapes[-1, -1, 2])


def test_a_mechanism_is_an_answer(server):
    hinged = cantilever(4)
    hinged["supports"] = [{"node": 0, "fix_x": True, "fix_y": True, "fix_z": True}]
    answer = server.solve_beams(hinged, progress=False)
    assert not answer.converged and answer.message and np.isfinite(answer.positions).all()


def test_files_hold_the_answer(server, tmp_path):
    answer = server.solve_beams(cantilever(6), files=("vtu", "csv", "json"), stem="arm", progress=False)
    names = {path.name for path in answer.write(tmp_path)}
    assert names == {"arm.vtu", "arm_nodes.csv", "arm_elements.csv", "arm_stations.csv", "arm.json"}
    assert np.array_equal(vtu_array(tmp_path / "arm.vtu", "Points", "<f8"), answer.positions.ravel())
    assert np.array_equal(vtu_array(tmp_path / "arm.vtu", "connectivity", "<i4"), answer.elements.ravel())
    assert np.array_equal(vtu_array(tmp_path / "arm.vtu", "utilisation", "<f8"), answer.utilisations)
    table = np.genfromtxt(tmp_path / "arm_elements.csv", delimiter=",", names=True)
    assert np.allclose(table["axial_force"], answer.axial_forces)
    values = json.loads((tmp_path / "arm.json").read_text())
    assert values["status"] == "converged" and values["nodes"][6]["z"] == answer.positions[6, 2]


def test_jobs_of_the_public_code(server, tmp_path):
    folder = job_folder(tmp_path)
    answer = server.solve_beams(folder, progress=False)
    assert answer.converged and np.abs(answer.positions - server.solve_beams(cantilever(10)).positions).max() < 1e-6
    (folder / "SimulationJob.json").write_text(
        (folder / "SimulationJob.json").read_text().replace("[10, [0", "[11, [0"))
    error = refusal(server, folder)
    assert (error.code, error.field) == ("OUT_OF_RANGE", "job") and "11" in str(error)


@pytest.mark.parametrize("change, code, field", [
    (lambda s: s["nodes"][2]["position"].update(x=s["nodes"][1]["position"]["x"]), "INVALID_ARGUMENT",
     "structure.elements[1]"),
    (lambda s: s["loads"][0].update(node=99), "OUT_OF_RANGE", "structure.loads[0].node"),
    (lambda s: s.update(supports=[]), "FAILED_PRECONDITION", "structure.supports"),
    (lambda s: s["elements"].append({"start": 1, "finish": 0}), "INVALID_ARGUMENT", "structure.elements[4]"),
    (lambda s: s["sections"][0]["rectangle"].update(height=0), "INVALID_ARGUMENT",
     "structure.sections[0].rectangle.height"),
    (lambda s: s.update(motions=[{"node": 0, "z": 0.1, "x_axis": {"x": 3, "z": 4}, "y_axis": {"y": 1}}]), "INVALID_ARGUMENT",
     "structure.motions[0]"),
    (lambda s: s["elements"][1].update(normal={"x": 1}), "INVALID_ARGUMENT", "structure.elements[1].normal"),
    (lambda s: s["elements"][0].update(start_release={"rotations": [4]}), "INVALID_ARGUMENT",
     "structure.elements[0].start_release.rotations[0]"),
    (lambda s: s["nodes"].append({}), "INVALID_ARGUMENT", "structure.nodes[5].position"),
])
def test_bad_structures_are_refused_by_name(server, change, code, field):
    structure = cantilever(4)
    change(structure)
    error = refusal(server, structure)
    assert (error.code, error.field) == (code, field)


def test_a_node_that_is_fixed_and_moved_along_the_same_axis_is_moved(server, tmp_path):
    structure = cantilever(4, load=0) | {"motions": [{"node": 0, "x": 0.25, "z": 0.5}]}
    answer = server.solve_beams(structure, progress=False)
    assert answer.converged
    assert np.allclose(answer.positions - [(i / 4, 0, 0) for i in range(5)], (0.25, 0, 0.5), atol=1e-9)
    folder = job_folder(tmp_path)
    job = json.loads((folder / "SimulationJob.json").read_text())
    job["forced displacements"] = [[0, [0.1, 0, 0.2]]]
    (folder / "SimulationJob.json").write_text(json.dumps(job))
    answer = server.solve_beams(folder, progress=False)
    assert answer.converged and np.allclose(answer.positions[0], (0.1, 0, 0.2), atol=1e-9)
    session = server.open(folder, progress=False)
    assert session.wait().status == "CONVERGED"
    with pytest.raises(limber.LimberError) as caught:
        session.support(0, "x")
    assert "motions[0] moves node 0, which supports[0] holds along x" in str(caught.value)
    session.close()


def test_a_vertical_member_gets_a_normal_by_rule(server):
    """Its third axis is x, so the section's height is along x, and it bends (height / width)^2 less in that direction."""
    def tip(**force):
        column = cantilever(4)
        for i, node in enumerate(column["nodes"]):
            node["position"] = {"z": i / 4}
        column["sections"][0]["rectangle"] = {"width": 0.01, "height": 0.02}
        column["loads"] = [{"node": 4, "force": force}]
        answer = server.solve_beams(column, progress=False)
        assert answer.converged
        return answer.positions[-1]

    assert tip(y=0.003)[1] == pytest.approx(0.0005, rel=1e-4)
    assert tip(x=0.003)[0] == pytest.approx(0.0005 / 4, rel=1e-4)


def test_what_is_not_finite_is_named(server):
    structure = cantilever(4)
    structure["nodes"][2]["position"]["x"] = float("nan")
    error = refusal(server, structure)
    assert (error.code, error.field) == ("INVALID_ARGUMENT", "structure.nodes[2].position.x")
    assert "finite" in str(error) and "quoted" not in str(error)


def test_a_followed_branch_reports_its_snaps(server):
    arch = {"nodes": [{"position": {"x": i / 16, "z": 0.05 * np.sin(np.pi * i / 16)}} for i in range(17)],
            "sections": [{"rectangle": {"width": 0.02, "height": 0.006}, "young": 1e9, "poisson": 0.3}],
            "elements": [{"start": i, "finish": i + 1} for i in range(16)],
            "supports": [{"node": 0, **CLAMPED}, {"node": 16, **CLAMPED}],
            "loads": [{"node": 8, "force": {"z": -12}}]}
    with pytest.warns(limber.SnapWarning, match="the structure snapped"):
        plain, followed = (server.solve_beams(arch, follow=follow, progress=False) for follow in (False, True))
    assert "snapped to another shape at" in plain.message
    assert plain.converged and plain.snaps == followed.snaps and followed.converged, "the default method follows, too"
    assert np.abs(followed.positions - plain.positions).max() < 1e-6
    assert len(followed.snaps) == 1 and 0 < followed.snaps[0].progress < 1 and 0 < followed.snaps[0].node < 16
    arch["loads"][0]["force"]["z"] = -0.5
    assert server.solve_beams(arch, follow=True, progress=False).snaps == ()


def test_bad_options_are_refused(server):
    error = refusal(server, cantilever(2), tolerance=2.0)
    assert error.field == "tolerance" and error.message.startswith("tolerance = 2, must be")
    assert refusal(server, cantilever(2), follow=1).field == "follow"
    assert refusal(server, cantilever(2), shapes=257).code == "LIMIT_EXCEEDED"
    assert refusal(server, cantilever(2), files=("csv", "csv")).field == "files[1]"
    assert refusal(server, cantilever(2), stem="../x").field == "stem"
    assert refusal(server, cantilever(2), method="hope").field == "method"
    assert refusal(server, {"nodez": []}).code == "INVALID_ARGUMENT"


def test_the_command_line(cli, tmp_path):
    scene = tmp_path / "arm.json"
    scene.write_text(json.dumps(cantilever(6)))
    done = cli("beams", scene, "--method", "newton", "--export", tmp_path / "out.vtu", "--export", tmp_path / "out.csv")
    assert done.returncode == 0 and "converged" in done.stdout and "7 nodes, 6 elements" in done.stdout, done.stderr
    assert {path.name for path in tmp_path.glob("out*")} == {"out.vtu", "out_nodes.csv", "out_elements.csv", "out_stations.csv"}
    printed = json.loads(cli("--json", "beams", scene).stdout)
    assert printed["status"] == "BEAM_STATUS_CONVERGED"
    assert cli("beams", job_folder(tmp_path)).returncode == 0
    scene.write_text(json.dumps({"beams": {"structure": cantilever(6)}}))
    assert json.loads(cli("--json", "beams", scene).stdout)["positions"] == printed["positions"]
    scene.write_text(json.dumps({"beams": {"lines": {"path": "beam.ply"}}}))
    advised = cli("beams", scene)
    assert advised.returncode == 1 and "limber open" in advised.stderr
    scene.write_text(json.dumps(cantilever(6)))
    refused = cli("beams", scene, "--method", "relaxation", "--follow")
    assert refused.returncode == 1 and "follow" in refused.stderr
    scene.write_text(json.dumps(cantilever(6) | {"supports": []}))
    refused = cli("beams", scene)
    assert refused.returncode == 1 and "structure.supports" in refused.stderr
    assert cli("beams", tmp_path / "none.json").returncode == 1
    refused = cli("beams", job_folder(tmp_path), "--export", tmp_path / "none" / "x.vtu")
    assert refused.returncode == 1 and "there is no folder" in refused.stderr and not (tmp_path / "none").exists()


def test_a_structure_alone_is_a_scene_too(cli, server, tmp_path):
    alone = tmp_path / "arm.json"
    alone.write_text(json.dumps(cantilever(6)))
    assert cli("validate", alone).returncode == 0
    opened = cli("open", alone, "--session", "alone")
    assert opened.returncode == 0 and "6 elements, 7 nodes, ready" in opened.stdout, opened.stderr
    for session in (server.session("alone"), server.open(alone, progress=False), server.open(cantilever(6), progress=False)):
        assert session.wait().status == "CONVERGED"
        session.close()
    alone.write_text(json.dumps(cantilever(6) | {"lods": []}))
    for refused in (cli("validate", alone), cli("open", alone)):
        assert refused.returncode == 1
        message = "there is no such field: did you mean loads?"
        assert f"beams.structure.lods: {message}" in refused.stdout or (
            f"{message} (field scene.beams.structure.lods)" in refused.stderr)
    assert 'there is no field "lods": did you mean "loads"?' in str(refusal(server, alone))


@pytest.mark.parametrize("key, misspelt", [("forces", "force"), ("mesh filename", "mesh_filename")])
def test_misspelt_keys_of_jobs_are_refused_with_the_nearest_one(cli, server, tmp_path, key, misspelt):
    folder = job_folder(tmp_path)
    job = folder / "SimulationJob.json"
    job.write_text(job.read_text().replace(f'"{key}"', f'"{misspelt}"'))
    message = f'{misspelt} is no key of SimulationJob.json: did you mean "{key}"?'
    assert message in str(refusal(server, folder))
    for refused in (cli("beams", folder), cli("validate", folder), cli("open", folder)):
        assert refused.returncode == 1 and message in refused.stdout + refused.stderr


def test_unused_vertices_are_left_out_with_a_warning(cli, server, tmp_path):
    wanted = server.solve_beams(job_folder(tmp_path), progress=False)
    drawing = tmp_path / "beam.ply"
    drawing.write_text(drawing.read_text().replace("vertex 11", "vertex 13").replace(
        "1.0 0 0 0 0 1\n", "1.0 0 0 0 0 1\n7 8 9 0 0 1\n20 0 0 0 0 1\n"))
    message = "no element uses nodes 11, 12: left out; the others keep their numbers"
    for method in ("choose", "relaxation"):
        answer = server.solve_beams(tmp_path, method=method, progress=False)
        assert answer.converged and message in answer.issues[0], answer.message
        assert np.abs(answer.positions[:11] - wanted.positions).max() < 1e-4
        assert answer.positions[11].tolist() == [7, 8, 9]
    for done in (cli("beams", tmp_path), cli("validate", tmp_path), cli("open", tmp_path, "--session", "loose")):
        assert done.returncode == 0 and message in done.stdout + done.stderr
    session = server.session("loose")
    assert session.wait().status == "CONVERGED"
    with pytest.raises(limber.LimberError) as caught:
        session.load(12, force=(0, 0, 1))
    assert "a node of no element" in str(caught.value)
    with pytest.raises(limber.LimberError) as caught:
        session.move_support(12, z=1.0)
    assert "a node of no element" in str(caught.value)
    session.close()
    job = json.loads((tmp_path / "SimulationJob.json").read_text())
    (tmp_path / "SimulationJob.json").write_text(json.dumps(job | {"forced displacements": [[12, [0, 0, 1]]]}))
    assert "a node of no element" in str(refusal(server, tmp_path))


def test_a_byte_order_mark_is_skipped(cli, server, tmp_path):
    mark = b"\xef\xbb\xbf"
    folder = job_folder(tmp_path)
    for name in ("SimulationJob.json", "beam.ply"):
        (folder / name).write_bytes(mark + (folder / name).read_bytes())
    alone = tmp_path / "arm.json"
    alone.write_bytes(mark + json.dumps(cantilever(6)).encode())
    for path in (folder, alone):
        assert server.solve_beams(path, progress=False).converged
        assert cli("beams", path).returncode == 0 and cli("validate", path).returncode == 0
    session = server.open(alone, progress=False)
    session.close()


def test_gravity_that_nothing_feels_warns(cli, server, tmp_path):
    scene = tmp_path / "arm.json"
    scene.write_text(json.dumps(cantilever(6) | {"gravity": {"z": -9.81}}))
    message = "gravity has no effect: no section of a beam has a density"
    validated = cli("validate", scene)
    assert validated.returncode == 0 and f"warning: beams.structure.gravity: {message}" in validated.stdout
    for done in (cli("beams", scene), cli("open", scene, "--session", "light")):
        assert done.returncode == 0 and message in done.stderr
    assert message in server.solve_beams(scene, progress=False).issues[0]
    session = server.session("light")
    assert message in session.gravity((0, 0, -1)).issues[0]
    assert session.gravity((0, 0, 0)).issues == ()
    assert "node 4 is not held" in session.release(4).issues[0]
    session.wait()
    assert session.hold(4).issues == ()
    session.close()
    heavy = cantilever(6) | {"gravity": {"z": -9.81}}
    heavy["sections"] = [heavy["sections"][0] | {"density": 1000}]
    scene.write_text(json.dumps(heavy))
    assert "warning" not in cli("validate", scene).stdout


def test_a_scene_file_is_solved_as_drawn(server, tmp_path):
    wanted = server.solve_beams(cantilever(6), progress=False)
    session = server.open(limber.beam_scene(cantilever(6)), progress=False)
    session.wait()
    session.export(tmp_path, ("scene",), progress=False)
    assert np.abs(server.solve_beams(tmp_path / "beams.json", progress=False).positions - wanted.positions).max() < 1e-9
    assert refusal(server, {"beams": {"lines": {"path": "x.ply"}}}).field == "structure.beams.lines"
    assert refusal(server, {"beams": {"nodes": []}}).code == "INVALID_ARGUMENT"
    session.close()


def test_the_example_bends_an_arch(limberd, tmp_path):
    done = subprocess.run([sys.executable, str(ROOT / "examples" / "bend_arch.py")], cwd=tmp_path, capture_output=True,
                          text=True, timeout=60)
    assert done.returncode == 0 and "converged" in done.stdout, done.stderr
    rise = float(re.search(r"rise ([\d.]+) m", done.stdout)[1])
    assert 0.7 < rise < 1.2 and (tmp_path / "out" / "arch" / "arch.vtu").is_file()


def test_a_column_beyond_its_load_reports_negative_eigenvalues(server):
    """Clamped and pinned, 2.97 times Euler's load: a relaxation ends straight, Newton's method buckles it."""
    column = {"nodes": [{"position": {"z": i / 8}, "normal": {"x": 1}} for i in range(9)],
              "sections": [{"rectangle": {"width": 0.02, "height": 0.01}, "young": 1e10, "poisson": 0.3}],
              "elements": [{"start": i, "finish": i + 1} for i in range(8)],
              "supports": [{"node": 0, **CLAMPED}, {"node": 8, "fix_x": True, "fix_y": True}],
              "loads": [{"node": 8, "force": {"z": -1000}}]}
    buckled = server.solve_beams(column, progress=False)
    assert buckled.converged and buckled.negative_eigenvalues == 0, buckled.message
    assert np.abs(buckled.positions[:, :2]).max() > 0.1
    column["loads"][0]["force"]["z"] = -300  # below Euler's 337 N
    straight = server.solve_beams(column, progress=False)
    assert straight.converged and straight.negative_eigenvalues == 0, straight.message
    assert np.abs(straight.positions[:, :2]).max() < 1e-6
    column["loads"][0]["force"]["z"] = -400
    relaxed = server.solve_beams(column, method="relaxation", progress=False)
    if np.abs(relaxed.positions[:, :2]).max() < 1e-6:
        assert relaxed.status == "UNSTABLE" and relaxed.negative_eigenvalues == 1, relaxed.message
        assert "balanced but unstable" in relaxed.message and relaxed.node is not None
    else:
        assert relaxed.negative_eigenvalues == 0


def of_job_and_session(server, structure):
    """What a job says of a structure's equilibrium, and what a session does."""
    yield server.solve_beams(structure, progress=False)
    session = server.open(structure, progress=False)
    yield session.wait(until="checked")
    session.close()


def test_a_neutral_direction_is_an_answer(server):
    """A round rod between clamps, one pushed in by a tenth: it arches in any plane, and may be turned about the line between them."""
    rod = {"nodes": [{"position": {"x": i / 12}} for i in range(13)],
           "sections": [{"tube": {"outer_radius": 0.005}, "young": 1e10, "poisson": 0.3}],
           "elements": [{"start": i, "finish": i + 1} for i in range(12)],
           "supports": [{"node": 0, **CLAMPED}, {"node": 12, **CLAMPED, "fix_x": False}],
           "motions": [{"node": 12, "x": -0.1}]}
    for answer in of_job_and_session(server, rod):
        assert answer.status == "CONVERGED" and answer.negative_eigenvalues == 0, answer.message
        assert len(answer.neutral_directions) == 1 and "neutral" in answer.message, answer.message
        (neutral,) = answer.neutral_directions
        assert neutral.node == 6 and np.linalg.norm(neutral.translation) > 0.1
        assert answer.unjudged_elements == ()
    answer = server.solve_beams(rod, progress=False)
    rise = answer.positions[6] - (answer.positions[6, 0], 0, 0)
    across = answer.neutral_directions[0].translation
    assert np.linalg.norm(rise) > 0.1
    assert abs(across @ rise) < 1e-3 * np.linalg.norm(rise) * np.linalg.norm(across) and abs(across[0]) < 1e-3


def test_an_element_too_long_to_show_how_it_buckles_is_named(server):
    """A column of one element, clamped and pinned, under 1.3 times its critical load: by itself it buckles at 1.49 times that."""
    bending = 1e9 * 0.02 * 0.01 ** 3 / 12
    column = {"nodes": [{"position": {}, "normal": {"x": 1}}, {"position": {"z": 1}, "normal": {"x": 1}}],
              "sections": [{"rectangle": {"width": 0.02, "height": 0.01}, "young": 1e9, "poisson": 0.3}],
              "elements": [{"start": 0, "finish": 1}],
              "supports": [{"node": 0, **CLAMPED}, {"node": 1, "fix_x": True, "fix_y": True}],
              "loads": [{"node": 1, "force": {"z": -1.3 * 20.1907 * bending}}]}
    for answer in of_job_and_session(server, column):
        assert answer.unjudged_elements == (0,) and answer.negative_eigenvalues is None, answer.message
        assert "element 0" in answer.message and "take shorter ones" in answer.message
        assert answer.neutral_directions == ()
    assert server.solve_beams(column, progress=False).status == "UNSTABLE"
    session = server.open(limber.beam_scene(column, tolerance=1e-3), progress=False)
    refined = session.wait(until="checked")
    assert refined.converged and refined.unjudged_elements == () and refined.negative_eigenvalues == 0, refined.message
    assert refined.discretisation_error.elements > 4
    head = session.frames()[-1, 1]
    assert head[2] < 0.99, "it has buckled: 1.3 times its load takes its head down"
    session.close()
