"""Stiffness that is painted on bodies, in the Python client and at the command line."""

import contextlib
import json

import limber
import numpy as np
import pytest
from conftest import small_scene, tip_of
from google.protobuf import json_format
from refusals import refusal


def moduli(session):
    """Young's modulus of each tet [Pa]."""
    scene, tets = session.scene(), len(session.geometry().tets)
    made = np.full(tets, scene.material.youngs_modulus)
    for group in scene.material_groups:
        made[np.array(group.tets)] = group.material.youngs_modulus
    return made


def box_off(path):
    """The bar of small_scene() as a closed surface with 8 vertices."""
    corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 3)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    path.write_text("OFF\n8 6 12\n" + "".join("{} {} {}\n".format(*corner) for corner in corners)
                    + "".join("4 {} {} {} {}\n".format(*face) for face in faces))
    return np.array(corners, dtype=float)


def test_painted_nodes_are_as_groups_of_tets(server):
    """The motion is that of the scene whose tets have these materials one by one."""
    plain = small_scene()
    with contextlib.closing(server.open(plain, progress=False)) as session:
        geometry = session.geometry()
    factors = np.where(geometry.rest[:, 0] > 1.5, 50.0, 1.0)
    by_tet = np.exp(np.log(factors)[geometry.tets].mean(axis=1)) * plain.material.youngs_modulus
    grouped = small_scene()
    for modulus in np.unique(by_tet):
        group = grouped.material_groups.add(tets=np.flatnonzero(by_tet == modulus))
        group.material.CopyFrom(plain.material)
        group.material.youngs_modulus = modulus
    shapes = []
    for scene in (small_scene(stiffness=factors), grouped, plain):
        with contextlib.closing(server.open(scene, progress=False)) as session:
            session.add(node=tip_of(session), frame=30, displacement=(0, 0.3, 0.1))
            session.wait()
            if scene is not plain:
                assert moduli(session) == pytest.approx(by_tet, rel=1e-9)
            shapes.append(session.frames())
    assert np.abs(shapes[0] - shapes[1]).max() < 1e-5 * np.ptp(shapes[1])
    assert np.abs(shapes[0] - shapes[2]).max() > 1e-2 * np.ptp(shapes[2])  # it does something


def test_a_painted_surface_makes_the_tets_near_it(server, tmp_path):
    corners = box_off(tmp_path / "box.off")
    factors = np.array([1, 2, 4, 8, 16, 32, 64, 128.0])
    (tmp_path / "box.txt").write_text("# by vertex\n" + "\n".join(map(str, factors)))
    with contextlib.closing(server.open(tmp_path / "box.off", stiffness=tmp_path / "box.txt", tets=600, within=1,
                                        progress=False)) as session:
        geometry, default = session.geometry(), session.scene().material.youngs_modulus
        centres = geometry.rest[geometry.tets].mean(axis=1)
        distances = np.linalg.norm(centres[:, None] - corners[None], axis=2)
        ordered = np.sort(distances, axis=1)
        is_clear = ordered[:, 1] - ordered[:, 0] > 1e-5  # positions are of single precision
        expected = default * factors[distances.argmin(axis=1)]
        assert is_clear.mean() > 0.5 and len(np.unique(expected)) == 8
        assert moduli(session)[is_clear] == pytest.approx(expected[is_clear], rel=1e-9)
        # An exported scene opens with the same materials.
        session.export(tmp_path / "out", formats=("scene",), stem="again")
        painted = moduli(session)
    again = next((tmp_path / "out").glob("*.json"))
    with contextlib.closing(server.open(again, progress=False)) as session:
        assert moduli(session) == pytest.approx(painted, rel=1e-12)


def test_groups_and_arrays_and_files_are_one(server, tmp_path):
    box_off(tmp_path / "box.off")
    factors = np.where(np.arange(8) % 2 == 1, 5.0, 1.0)
    np.save(tmp_path / "a.npy", factors)
    groups = {"end": {"vertices": np.flatnonzero(factors == 5), "factor": 5}}
    (tmp_path / "a.json").write_text(json.dumps({"groups": {"end": {"vertices": [1, 3, 5, 7], "factor": 5}}}))
    filled = server.tetrahedralize(tmp_path / "box.off", tets=300, within=1, progress=False)
    seen = []
    for stiffness in (factors, groups, tmp_path / "a.npy", tmp_path / "a.json"):
        scene = limber.scene_from_arrays(filled.nodes, filled.tets, frames=20, modes=4, tolerance=0.5, stiffness=stiffness,
                                         surface=tmp_path / "box.off")
        with contextlib.closing(server.open(scene, progress=False)) as session:
            seen.append(moduli(session))
    assert len(np.unique(seen[0])) == 2
    assert all(np.array_equal(seen[0], other) for other in seen[1:])


def test_scene_files_name_the_file_beside_them(server, tmp_path):
    nodes = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1.0)])
    scene = limber.scene_from_arrays(nodes, [(0, 1, 2, 3), (1, 2, 4, 3)], frames=20, modes=2, youngs_modulus=1e5)
    (tmp_path / "stiff").mkdir()
    (tmp_path / "stiff" / "a.txt").write_text("1 1 1 1 16")
    text = json.loads(json_format.MessageToJson(scene, preserving_proto_field_name=True))
    text["painted_stiffness"] = {"path": "stiff/a.txt", "quantity": "PAINTED_QUANTITY_FACTOR"}
    (tmp_path / "scene.json").write_text(json.dumps(text))
    with contextlib.closing(server.open(tmp_path / "scene.json", progress=False)) as session:
        assert sorted(moduli(session)) == pytest.approx([1e5, 2e5])


def test_the_command_line_paints(server, cli, tmp_path):
    box_off(tmp_path / "box.off")
    (tmp_path / "box.txt").write_text("1e4 " * 4 + "1e6 " * 4)

    opened = cli("open", tmp_path / "box.off", "--tets", 300, "--within", 1, "--stiffness", tmp_path / "box.txt", "--stiffness-as",
                 "pascal", "--session", "painted")
    assert opened.returncode == 0, opened.stderr
    session = server.session("painted")
    assert set(np.round(moduli(session), 3)) == {1e4, 1e6}
    session.close()
    (tmp_path / "box.txt").write_text("1 2")
    refused = cli("open", tmp_path / "box.off", "--tets", 300, "--within", 1, "--stiffness", tmp_path / "box.txt")
    assert refused.returncode != 0 and "2 numbers are given for 8 points" in refused.stderr


def test_what_is_refused(server):
    def code(**options):
        return refusal(lambda: server.open(small_scene(**options), progress=False))

    nodes = 7 * 3 * 3
    assert code(stiffness=[1.0, 2.0]) == ("INVALID_ARGUMENT", "scene.painted_stiffness.values")
    assert code(stiffness=[1.0] * (nodes - 1) + [0])[0] == "INVALID_ARGUMENT"
    assert refusal(lambda: limber.painted_stiffness([[1.0]])) == ("INVALID_ARGUMENT", "stiffness")
    assert refusal(lambda: limber.painted_stiffness([1.0], points="edges")) == ("INVALID_ARGUMENT", "points")
    assert refusal(lambda: limber.painted_stiffness("/none.txt")) == ("IO", "stiffness")
    linkage = server.sample("grid")
    assert refusal(lambda: server.open(linkage, stiffness=[1.0], progress=False)) == ("INVALID_ARGUMENT", "stiffness")
