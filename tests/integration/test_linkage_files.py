"""What scenes of rod linkages say, what their exports hold, and how exported scenes open again."""

import json
from xml.etree import ElementTree

import limber
import numpy as np
import pytest
from conftest import small_scene
from limber.v1 import scene_pb2 as scenes
from limber.v1 import service_pb2 as service
from linkage_inputs import RECTANGLE, grid, linkage  # noqa: F401
from refusals import refusal


def vtp_arrays(path):
    """Arrays of a .vtp by name, read as its XML says."""
    content = path.read_bytes()
    head, raw = content.split(b'<AppendedData encoding="raw">', 1)
    raw = raw[raw.index(b"_") + 1:]
    kinds = {"Float32": np.float32, "Int32": np.int32}
    found = {}
    for array in ElementTree.fromstring(head + b"</VTKFile>").iter("DataArray"):
        at = int(array.get("offset"))
        size = int.from_bytes(raw[at:at + 8], "little")
        values = np.frombuffer(raw[at + 8:at + 8 + size], kinds[array.get("type")])
        width = int(array.get("NumberOfComponents"))
        found[array.get("Name")] = values.reshape(-1, width) if width > 1 else values
    return found


def test_files_hold_the_shape_and_what_it_carries(server, linkage, tmp_path):
    linkage.deploy(50)
    result = linkage.wait()
    export = linkage.export(tmp_path, formats=("vtp", "json", "obj", "scene"), stem="h", progress=False)
    assert {path.name for path in export if not path.name.endswith(".vtp")} == {
        "h.pvd", "h_shape.json", "h_centrelines.obj", "h_surface.obj", "h.json", "h.obj"}
    steps = sorted(tmp_path.glob("h_*.vtp"))
    assert len(steps) == result.steps
    listed = [item.get("file") for item in ElementTree.parse(tmp_path / "h.pvd").iter("DataSet")]
    assert listed == [path.name for path in steps]

    shape = json.loads((tmp_path / "h_shape.json").read_text())
    assert shape["mean_opening_angle"] == pytest.approx(50, abs=1e-6) and shape["revision"] == 1
    joints = np.array([joint["position"] for joint in shape["joints"]])
    np.testing.assert_allclose(joints, linkage.shape().joints, atol=1e-6)
    assert len(shape["segments"]) == 144
    assert shape["energy"]["bending"] == pytest.approx(result.bending_energy)

    arrays = vtp_arrays(steps[-1])
    offsets = arrays["offsets"]
    assert len(offsets) == 144 and offsets[-1] == len(arrays["Points"]) == len(arrays["von_mises_stress"])
    np.testing.assert_array_equal(arrays["connectivity"], np.arange(offsets[-1]))
    stations = shape["segments"][7]["stations"]
    ours = slice(offsets[6], offsets[7])
    for field in ("axial_force", "curvature_2", "torque", "largest_normal_stress", "von_mises_stress"):
        np.testing.assert_allclose(arrays[field][ours], stations[field], rtol=1e-6)
    np.testing.assert_allclose(arrays["Points"][ours], stations["position"], rtol=1e-6)
    largest = max(segment["extremes"]["von_mises_stress"]["largest"] for segment in shape["segments"])
    assert largest == pytest.approx(arrays["von_mises_stress"].max(), rel=1e-6) and largest > 1e5
    assert vtp_arrays(steps[0])["von_mises_stress"].max() < largest, "it opens from nearly no stress"

    again = server.open(tmp_path / "h.json", progress=False)
    assert again.wait().mean_angle == pytest.approx(50, abs=1e-6)
    again.close()


def test_formats_that_a_session_does_not_have_are_named(server, linkage, tmp_path):
    assert refusal(lambda: linkage.export(tmp_path, formats="pc2")) == ("INVALID_ARGUMENT", "formats")
    body = server.open(small_scene(), progress=False)
    assert refusal(lambda: body.export(tmp_path, formats="vtp")) == ("INVALID_ARGUMENT", "formats")
    with pytest.raises(limber.LimberError, match="PVD, PC2, BLENDER, SURFACE or SCENE"):
        server.connection.call("export", service.ExportRequest(session=body.id, format=service.EXPORT_FORMAT_VTP))
    body.close()


def test_rest_lengths_of_least_stress(server, tmp_path):
    energies = {}
    for lengths in (scenes.REST_LENGTHS_AS_DRAWN, scenes.REST_LENGTHS_LEAST_STRESS):
        scene = server.sample("dome")
        scene.linkage.rest_lengths = lengths
        assert server.validate(scene) == []
        linkage = server.open(scene, progress=False)
        result = linkage.wait()
        assert result.status == "CONVERGED"
        energies[lengths] = result.energy
        assert linkage.scene().linkage.rest_lengths == lengths
        linkage.export(tmp_path, formats=("json", "scene"), stem=f"dome{lengths}", progress=False)
        linkage.close()
    drawn, relaxed = (np.array([segment["rest_length"] for segment in json.loads(path.read_text())["segments"]])
                      for path in sorted(tmp_path.glob("dome*_shape.json")))
    assert 1e-4 < np.abs(relaxed / drawn - 1).max() < 0.1
    assert energies[scenes.REST_LENGTHS_LEAST_STRESS] < energies[scenes.REST_LENGTHS_AS_DRAWN]
    saved = tmp_path / f"dome{scenes.REST_LENGTHS_LEAST_STRESS}.json"
    assert json.loads(saved.read_text())["linkage"]["rest_lengths"] == "REST_LENGTHS_LEAST_STRESS"
    again = server.open(saved, progress=False)
    assert again.wait().energy == pytest.approx(energies[scenes.REST_LENGTHS_LEAST_STRESS], rel=1e-6)
    again.close()


def test_forms_of_bending(server, tmp_path):
    energies = []
    for bending in (scenes.ROD_BENDING_MATERIAL_FRAMES, scenes.ROD_BENDING_TURNING_ANGLE):
        scene = server.sample("dome")
        scene.linkage.bending, scene.linkage.edges_per_segment = bending, 3
        linkage = server.open(scene, progress=False)
        linkage.deploy(60)
        energies.append(linkage.wait().energy)
        linkage.export(tmp_path, formats="scene", stem="bent", progress=False)
        linkage.close()
    assert energies[1] < energies[0], "2 tan(phi/2) is more than phi"
    assert energies[1] == pytest.approx(energies[0], rel=0.05)
    assert json.loads((tmp_path / "bent.json").read_text())["linkage"]["bending"] == "ROD_BENDING_TURNING_ANGLE"


def test_scenes_name_bending_and_rest_lengths(server):
    points, edges = grid()
    scene = limber.linkage_scene(points, edges, section=RECTANGLE, bending="turning_angle", rest_lengths="least_stress")
    assert scene.linkage.bending == scenes.ROD_BENDING_TURNING_ANGLE
    assert scene.linkage.rest_lengths == scenes.REST_LENGTHS_LEAST_STRESS
    opened = server.open(scene, progress=False)
    assert opened.wait().status == "CONVERGED"
    opened.close()
    for name in ("bending", "rest_lengths"):
        given = {name: "none"}
        assert refusal(lambda: limber.linkage_scene(points, edges, section=RECTANGLE, **given)) == (
            "INVALID_ARGUMENT", name)
        bad = limber.linkage_scene(points, edges, section=RECTANGLE)
        setattr(bad.linkage, name, 7)
        assert refusal(lambda: server.open(bad))[1] == f"scene.linkage.{name}"


def test_pinned_scenes_open_again_in_the_shape_they_had(server, tmp_path):
    """Pins without positions hold joints where the session had them, not where they are drawn."""
    dome = server.open(sample="dome", progress=False)
    dome.deploy(60)
    dome.wait()
    dome.pin(0)
    dome.pin(30)
    dome.wait()
    dome.deploy(50)
    before = dome.wait()
    assert not before.solve_failed
    dome.export(tmp_path, formats=("scene",), stem="pinned", progress=False)
    again = server.open(tmp_path / "pinned.json", progress=False)
    after = again.wait()
    assert not after.solve_failed and "as drawn" not in after.message
    assert after.energy == pytest.approx(before.energy, rel=1e-6)
    np.testing.assert_allclose(again.shape().joints, dome.shape().joints, atol=1e-5)
    again.deploy(60)
    dome.deploy(60)
    assert again.wait().energy == pytest.approx(dome.wait().energy, rel=1e-6)

    scene = json.loads((tmp_path / "pinned.json").read_text())
    scene["linkage"]["edgesPerSegment" if "edgesPerSegment" in scene["linkage"] else "edges_per_segment"] = 5
    (tmp_path / "coarse.json").write_text(json.dumps(scene))
    with pytest.raises(limber.LimberError) as refused:
        server.open(tmp_path / "coarse.json", progress=False)
    assert refused.value.field == "scene.linkage.shape.vertices", refused.value
    dome.close()
    again.close()


def test_a_ring_with_lengths_of_its_own_opens_again_as_it_was(server, tmp_path):
    ring = server.open(sample="hyperboloid", progress=False)
    ring.wait()
    ring.export(tmp_path, formats=("json",), stem="drawn", progress=False)
    drawn = json.loads((tmp_path / "drawn_shape.json").read_text())
    lengths = np.array([segment["rest_length"] for segment in drawn["segments"]])
    ring.set_lengths(lengths * (1 + 0.03 * np.random.default_rng(5).uniform(-1, 1, len(lengths))))
    before = ring.wait()
    assert not before.solve_failed
    ring.export(tmp_path, formats=("scene",), stem="uneven", progress=False)
    again = server.open(tmp_path / "uneven.json", progress=False)
    after = again.wait()
    assert not after.solve_failed, after.message
    assert after.energy == pytest.approx(before.energy, rel=1e-6)
    again.deploy(25)
    assert not again.wait().solve_failed
    ring.close()
    again.close()


def test_after_a_failed_edit_a_scene_opens_in_the_last_good_shape(server, tmp_path):
    dome = server.open(sample="dome", progress=False)
    dome.deploy(60)
    good = dome.wait()
    dome.pin(0, "motion")
    dome.wait()
    dome.pin(40, "motion", position=(9, 9, 9))
    failed = dome.wait()
    assert failed.solve_failed and "apart" in failed.message
    dome.export(tmp_path, formats=("scene",), stem="failed", progress=False)
    again = server.open(tmp_path / "failed.json", progress=False)
    same = again.wait()
    assert same.solve_failed and same.energy == pytest.approx(good.energy, rel=1e-6)
    np.testing.assert_allclose(again.shape().joints, dome.shape().joints, atol=1e-5)
    again.release(40)
    assert again.wait().energy == pytest.approx(good.energy, rel=1e-6)
    dome.close()
    again.close()
