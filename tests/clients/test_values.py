"""Edits, scenes, arrays and files, without a server."""

import json
import math

import limber
import meshio
import numpy as np
import pytest
from limber import arrays, connection, edits, scenes
from limber.bodies.edits import constraint
from limber.launching import find_binary
from limber.exports import write_exported
from limber.v1 import common_pb2 as common
from limber.v1 import scene_pb2 as scene_messages
from limber.v1 import service_pb2 as service

TET = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)


def refused(field, call, *args, **kwargs):
    with pytest.raises(limber.LimberError) as caught:
        call(*args, **kwargs)
    assert caught.value.field == field
    return caught.value


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int32, np.uint16])
def test_arrays_survive_the_round_trip(dtype):
    values = np.arange(24).reshape(2, 3, 4).astype(dtype)
    message = common.Array.FromString(arrays.to_message(values, dtype).SerializeToString())
    np.testing.assert_array_equal(arrays.to_numpy(message), values)


def test_array_whose_length_lies_is_refused():
    message = arrays.to_message(np.zeros((2, 3)), np.float32)
    message.shape[0] = 2 ** 40
    with pytest.raises(limber.LimberError, match="bytes"):
        arrays.to_numpy(message)


ROWS = {
    "floats": np.array([[0.0, 0, 0], [1, 2, 3]]), "integers": np.array([[0, 0, 0], [1, 2, 3]]),
    "single": np.array([[0, 0, 0], [1, 2, 3]], np.float32), "unsigned": np.array([[0, 0, 0], [1, 2, 3]], np.uint8),
    "lists": [[0, 0, 0], [1, 2, 3]], "scalars": [[np.float64(0), np.int64(0), np.array(0)], (np.int16(1), 2, np.float32(3))],
    "columns": np.array([[0.0, 1], [0, 2], [0, 3]]).T, "objects": np.array([[0, 0, 0], [1, 2, 3]], dtype=object),
    "messages": [{"x": 0}, {"x": np.float64(1), "y": 2, "z": 3}],
}


@pytest.mark.parametrize("rows", ROWS.values(), ids=ROWS.keys())
def test_rows_of_numbers_are_positions_vectors_and_forces(rows):
    def xyz(vector):
        return (vector.x, vector.y, vector.z)

    structure = limber.beam_scene({"nodes": [{"position": row, "normal": rows[1]} for row in rows],
                                   "loads": [{"node": np.int64(1), "force": rows[1]}], "gravity": rows[1]}).beams.structure
    for vector in (structure.nodes[1].position, structure.nodes[0].normal, structure.loads[0].force, structure.gravity):
        assert xyz(vector) == (1, 2, 3)
    scene = scenes.to_message({"constraints": [{"frame": 3, "nodes": [2], "position": rows[1]}],
                               "simulation": {"gravity": rows[1], "forces": [{"nodes": [1], "force": rows[1]}]},
                               "linkage": {"conditions": {"targets": [{"joint": 1, "position": rows[1]}],
                                                          "loads": [{"joint": 2, "force": rows[1], "moment": rows[1]}]}}})
    conditions = scene.linkage.conditions
    for vector in (scene.constraints[0].position, scene.simulation.gravity, scene.simulation.forces[0].force,
                   conditions.targets[0].position, conditions.loads[0].force, conditions.loads[0].moment):
        assert xyz(vector) == (1, 2, 3)
    assert xyz(edits.to_message({"move": {"id": 3, "target": rows[1]}}).move.target) == (1, 2, 3)
    load = edits.to_message({"set_beam_load": {"load": {"node": 1, "force": rows[1]}}})
    assert xyz(load.set_beam_load.load.force) == (1, 2, 3)


def test_functions_take_rows_of_every_kind():
    for name, rows in ROWS.items():
        if name == "messages":
            continue
        assert limber.move(1, rows[1]).move.target.z == 3, name
        assert limber.beam_edits.load(1, force=rows[1]).set_beam_load.load.force.z == 3, name
        assert limber.beam_edits.move(1, position=rows[1]).move_beam_node.position.z == 3, name
        assert limber.force(1, rows[1]).force.z == 3 and limber.simulation(gravity=rows[1]).gravity.z == 3, name
        assert constraint(frame=1, node=1, position=rows[1]).position.z == 3, name


def test_rows_that_are_no_three_numbers_are_named_by_their_place():
    for rows in ([[0, 0, 0], [1, 2]], [[0, 0, 0], [1, 2, "3"]], [[0, 0, 0], [1, 2, True]], [[0, 0, 0], np.eye(3)], [[0, 0, 0], []]):
        error = refused("structure.nodes[1].position", limber.beam_scene, {"nodes": [{"position": row} for row in rows]})
        assert "takes three numbers" in str(error)
    error = refused("scene.constraints[0].position", scenes.to_message, {"constraints": [{"position": np.zeros(4)}]})
    assert "takes three numbers" in str(error)


def test_arrays_of_messages_take_rows():
    mesh = scenes.to_message({"mesh": {"arrays": {"nodes": TET.astype(int), "tets": [[0, 1, 2, 3]]}}}).mesh.arrays
    np.testing.assert_array_equal(arrays.to_numpy(mesh.nodes), TET)
    np.testing.assert_array_equal(arrays.to_numpy(mesh.tets), [[0, 1, 2, 3]])
    assert mesh.tets.type == common.DATA_TYPE_INT32 and mesh.nodes.type == common.DATA_TYPE_FLOAT64
    for tets in ([[0, 1, 2, 3.5]], [[0, 1, 2, 2 ** 32]], [["a"]], [[0, 1], [2]]):
        refused("scene.mesh.arrays.tets", scenes.to_message, {"mesh": {"arrays": {"tets": tets}}})


def test_constraint_arguments():
    made = constraint(frame=4, nodes=[3, 1], displacement=(1, 2, 3), axes="zx", exact=True)
    assert (made.frame, list(made.nodes), list(made.axes), made.exact) == (
        4, [3, 1], [scene_messages.AXIS_Z, scene_messages.AXIS_X], True)
    assert made.WhichOneof("target") == "displacement"
    assert constraint(frame=0, node=0, position=(0, 0, 0)).WhichOneof("enforcement") is None
    refused("nodes", constraint, frame=1, position=(0, 0, 0))
    refused("node", constraint, frame=1, node=-1, position=(0, 0, 0))
    refused("target", constraint, frame=1, node=1)
    refused("target", constraint, frame=1, node=1, position=(0, 0, 0), displacement=(0, 0, 0))
    refused("position", constraint, frame=1, node=1, position=(0, 0))
    refused("axes", constraint, frame=1, node=1, position=(0, 0, 0), axes="xx")
    refused("frame", constraint, frame=-1, node=1, position=(0, 0, 0))
    refused("weight", constraint, frame=1, node=1, position=(0, 0, 0), weight=1, exact=True)


@pytest.mark.parametrize("field, change", [
    ("frame", {"frame": 1.5}), ("frame", {"frame": "1"}), ("frame", {"frame": True}), ("frame", {"frame": None}),
    ("frame", {"frame": 2 ** 40}), ("node", {"node": 1.5}), ("node", {"node": np.float64(1)}), ("node", {"node": "1"}),
    ("nodes", {"node": None, "nodes": 3}), ("nodes", {"node": None, "nodes": "12"}),
    ("nodes[1]", {"node": None, "nodes": [1, 1.5]}), ("nodes[0]", {"node": None, "nodes": np.array([1.0, 2.0])}),
    ("position", {"position": 1}), ("position", {"position": "123"}), ("position.y", {"position": (0, "1", 0)}),
    ("position.x", {"position": ([0], 0, 0)}), ("weight", {"weight": "100"}), ("weight", {"weight": [1]}),
    ("exact", {"exact": "no"}), ("axes", {"axes": 5}), ("axes", {"axes": ["x"]}), ("id", {"id": 1.5})])
def test_arguments_of_the_wrong_type_are_named(field, change):
    arguments = {"frame": 1, "node": 1, "position": (0, 0, 0)} | change
    assert refused(field, constraint, **arguments).code == "INVALID_ARGUMENT"


def test_numbers_of_numpy_are_numbers():
    made = constraint(frame=np.int64(4), nodes=np.array([1, 2], dtype=np.uint8), position=np.zeros(3, np.float32),
                      weight=np.float32(5), exact=False)
    assert (made.frame, list(made.nodes), made.weight) == (4, [1, 2], 5)


@pytest.mark.parametrize("field, call", [
    ("id", lambda: limber.remove("1")), ("id", lambda: limber.move(1.5, (0, 0, 0))), ("id", lambda: limber.remove(-1)),
    ("target", lambda: limber.move(1, None)), ("first", lambda: limber.ends(["free"], "free")),
    ("last", lambda: limber.ends("free", None)), ("period_frames", lambda: limber.dynamics(period_frames="25")),
    ("dynamics", limber.dynamics), ("frames", lambda: limber.scene_from_arrays(TET, [[0, 1, 2, 3]], frames=9.5)),
    ("modes", lambda: limber.scene_from_arrays(TET, [[0, 1, 2, 3]], modes=8.0)),
    ("fixed_nodes[1]", lambda: limber.scene_from_arrays(TET, [[0, 1, 2, 3]], fixed_nodes=[0, 1.5])),
    ("name", lambda: limber.scene_from_arrays(TET, [[0, 1, 2, 3]], name=3)),
    ("youngs_modulus", lambda: limber.scene_from_arrays(TET, [[0, 1, 2, 3]], youngs_modulus="1e5")),
    ("mesh.arrays.nodes", lambda: limber.scene_from_arrays([["a", "b", "c"]], [[0, 1, 2, 3]])),
    ("mesh.arrays.tets", lambda: limber.scene_from_arrays(TET, [[0, 1], [2]])),
    ("base_motion", lambda: limber.scene_from_arrays(TET, [[0, 1, 2, 3]], base_motion=[[1], [2, 3]])),
    ("timeout", lambda: limber.connect(timeout="5")), ("connect_timeout", lambda: limber.connect(connect_timeout=None)),
    ("connect_timeout", lambda: limber.connect(connect_timeout=math.nan)),
    ("timeout", lambda: limber.connect(timeout=math.inf)), ("timeout", lambda: limber.launch(timeout=math.nan)),
    ("binary", lambda: limber.launch(5)), ("arguments", lambda: limber.launch(arguments="--mesh-root")),
    ("server_key", lambda: limber.connect(server_key=5, key="k")), ("mesh", lambda: limber.scene_from_mesh(5)),
    ("scene.fixed_nodes", lambda: scenes.to_message({"fixed_nodes": 5})),
    ("scene.fixed_nodes", lambda: scenes.to_message({"fixed_nodes": np.array([0.5])})),
    ("edit", lambda: edits.to_message({"add": {"constraint": {"nodes": "12"}}})),
    ("endpoint", lambda: limber.connect(7801))])
def test_every_function_names_the_argument(field, call):
    assert refused(field, call).code == "INVALID_ARGUMENT"


def test_liveliness_has_the_defaults_at_its_default():
    assert limber.liveliness(0.8) == pytest.approx({"damping_ratio": 0.7, "force_smoothing": 0.5})
    assert limber.liveliness(0) == pytest.approx({"damping_ratio": 0.05, "force_smoothing": 0.1})
    assert limber.liveliness(1)["damping_ratio"] < 1
    with pytest.raises(limber.LimberError, match="calm must be in"):
        limber.liveliness(1.2)


def test_dynamics_name_their_discretisation():
    made = edits.to_messages([limber.dynamics(discretisation="differences", force_smoothing=0.25)],
                             scene_messages.Scene(dynamics=scene_messages.Dynamics(period_frames=25)))[0].set_dynamics
    assert made == scene_messages.Dynamics(period_frames=25, force_smoothing=0.25,
                                           discretisation=scene_messages.TIME_DISCRETISATION_DIFFERENCES)
    with pytest.raises(limber.LimberError, match="sampled"):
        limber.dynamics(discretisation="exact")


def test_a_change_of_dynamics_keeps_what_it_does_not_name():
    before = scene_messages.Dynamics(frames_per_second=24, period_frames=25, damping_ratio=0.1)
    first, second = edits.to_messages([limber.dynamics(damping_ratio=0.2), limber.dynamics(period_frames=50)],
                                      scene_messages.Scene(dynamics=before))
    assert first.set_dynamics == scene_messages.Dynamics(frames_per_second=24, period_frames=25, damping_ratio=0.2)
    assert second.set_dynamics == scene_messages.Dynamics(frames_per_second=24, period_frames=50, damping_ratio=0.2)


def test_mappings_take_numpy_where_json_takes_lists_and_numbers():
    scene = scenes.to_message({"frames": np.int64(30), "fixed_nodes": np.arange(3), "model": {"tolerance": np.float32(0.5)},
                               "constraints": [{"nodes": np.array([4, 5], np.uint8), "position": {"x": np.float64(1)}}]})
    assert (scene.frames, list(scene.fixed_nodes), scene.model.tolerance) == (30, [0, 1, 2], 0.5)
    assert list(scene.constraints[0].nodes) == [4, 5] and scene.constraints[0].position.x == 1
    edit = edits.to_message({"add": {"constraint": {"frame": np.int32(3), "nodes": range(1, 3)}}})
    assert list(edit.add.constraint.nodes) == [1, 2]


def test_edits_from_json():
    edit = edits.to_message({"add": {"constraint": {"frame": 3, "nodes": [1], "position": {"x": 1}}}})
    assert edit == service.Edit(add=service.AddConstraint(constraint=constraint(frame=3, node=1, position=(1, 0, 0))))
    refused("edits[2]", edits.to_message, {"nonsense": {}}, "edits[2]")
    refused("edit", edits.to_message, 7)
    refused("first", limber.ends, "loose", "free")


def test_meshio_mesh_becomes_a_scene():
    mesh = meshio.Mesh(TET, [("triangle", [[0, 1, 2]]), ("tetra", [[0, 1, 2, 3]]), ("tetra", [[1, 0, 2, 3]])])
    scene = limber.scene_from_mesh(mesh, name="t", frames=9, fixed_nodes=[0], youngs_modulus=2e5, modes=4,
                                   first_end="free", length_unit_in_metres=0.001, period_frames=20)
    np.testing.assert_array_equal(arrays.to_numpy(scene.mesh.arrays.tets), [[0, 1, 2, 3], [1, 0, 2, 3]])
    np.testing.assert_array_equal(arrays.to_numpy(scene.mesh.arrays.nodes), TET)
    assert (scene.name, scene.frames, list(scene.fixed_nodes), scene.material.youngs_modulus, scene.model.modes,
            scene.length_unit_in_metres, scene.dynamics.period_frames) == ("t", 9, [0], 2e5, 4, 0.001, 20)
    assert scene.first_end == scene_messages.END_CONDITION_FREE
    assert scene.last_end == scene_messages.END_CONDITION_PINNED_POSITION_VELOCITY
    refused("mesh", limber.scene_from_mesh, meshio.Mesh(TET, [("triangle", [[0, 1, 2]])]))
    with pytest.raises(TypeError, match="youngs"):
        limber.scene_from_mesh(mesh, youngs=3)


def test_arrays_of_the_wrong_shape_are_refused():
    refused("mesh.arrays.nodes", limber.scene_from_arrays, TET[:, :2], [[0, 1, 2, 3]])
    refused("mesh.arrays.tets", limber.scene_from_arrays, TET, [[0, 1, 2]])
    refused("mesh.arrays.tets", limber.scene_from_arrays, TET, [[0.0, 1, 2, 3]])
    outside = refused("mesh.tets[1]", limber.scene_from_arrays, TET, [[0, 1, 2, 3], [0, 1, 2, -3]])
    assert outside.code == "OUT_OF_RANGE" and "node -3" in outside.message
    assert "node 4" in refused("mesh.tets[0]", limber.scene_from_arrays, TET, [[0, 1, 2, 4]]).message


def test_scene_file_uploads_the_mesh_beside_it(tmp_path):
    (tmp_path / "body.ele").write_bytes(b"elements")
    (tmp_path / "body.node").write_bytes(b"nodes")
    (tmp_path / "scene.json").write_text(json.dumps({"name": "n", "frames": 7, "mesh": {"path": "body.ele"}}))
    scene = limber.load_scene(tmp_path / "scene.json")
    assert (scene.mesh.file.name, scene.mesh.file.content) == ("body.ele", b"elements")
    assert dict(scene.mesh.file.companions) == {"body.node": b"nodes"}
    assert scenes.to_message(str(tmp_path / "scene.json")) == scene


def test_scene_file_uploads_the_base_motion_it_names(tmp_path):
    def loaded(motion):
        (tmp_path / "s.json").write_text(json.dumps({"base_motion": motion}))
        return limber.load_scene(tmp_path / "s.json").base_motion

    (tmp_path / "f").mkdir()
    for name, content in (("m.pc2", "cache"), ("f/a&b.vtu", "first"), ("f/c.vtu", "second"), ("bad.pvd", "nonsense")):
        (tmp_path / name).write_text(content)
    pvd = '<VTKFile><DataSet timestep="1" file="a&amp;b.vtu"/><DataSet file="c.vtu"/><DataSet file="c.vtu"/></VTKFile>'
    (tmp_path / "f" / "m.pvd").write_text(pvd)
    assert loaded({"path": "m.pc2"}).pc2 == b"cache"
    series = loaded({"path": "f/m.pvd"}).vtu_series
    assert series.pvd == pvd and [(file.name, file.content) for file in series.files] == [
        ("a&b.vtu", b"first"), ("c.vtu", b"second")]
    series = loaded({"vtu_series": {"paths": ["f/c.vtu", "f/a&b.vtu"]}}).vtu_series
    assert [file.content for file in series.files] == [b"second", b"first"] and not series.paths
    assert limber.base_motion(str(tmp_path / "m.pc2")).pc2 == b"cache"
    assert limber.base_motion([tmp_path / "f" / "c.vtu"]).vtu_series.files[0].content == b"second"
    for field, motion in (("base_motion.path", {"path": "m.vtu"}), ("base_motion.path", {"path": "none.pc2"}),
                          ("base_motion.path", {"path": "bad.pvd"}),
                          ("base_motion.vtu_series.paths[0]", {"vtu_series": {"paths": ["x"]}})):
        refused(field, loaded, motion)
    refused("base_motion", limber.base_motion, object())


def test_bad_scene_files(tmp_path):
    path = tmp_path / "scene.json"
    assert refused("scene", limber.load_scene, path).code == "IO"
    path.write_text("{")
    refused("scene", limber.load_scene, path)
    path.write_text('{"framez": 3}')
    assert "framez" in str(refused("scene", limber.load_scene, path))
    path.write_text('[1]')
    refused("scene", limber.load_scene, path)
    path.write_text('{"mesh": {"path": "missing.msh"}}')
    refused("mesh.path", limber.load_scene, path)


@pytest.mark.parametrize("text, field", [
    ('{"frames": 3, "frames": 4}', "scene.frames"), ('{"fixed_nodes": [1], "fixedNodes": [2]}', "scene.fixedNodes"),
    ('{"constraints": [{}, {"frame": 1, "frame": 1}]}', "scene.constraints[1].frame"), ("[]", "scene"), ("3", "scene")])
def test_scene_files_say_each_thing_once(tmp_path, text, field):
    (tmp_path / "scene.json").write_text(text)
    refused(field, scenes.load_scene, tmp_path / "scene.json")


def test_exported_names_stay_below_the_folder(tmp_path):
    write_exported(tmp_path, service.ExportedFile(name="a/b.vtu", content=b"1"))
    write_exported(tmp_path, service.ExportedFile(name="a/b.vtu", content=b"2", append=True))
    assert (tmp_path / "a/b.vtu").read_bytes() == b"12"
    for name in ("../x", "/etc/x", "", "a/../../x"):
        with pytest.raises(limber.LimberError, match="outside"):
            write_exported(tmp_path, service.ExportedFile(name=name))


@pytest.mark.parametrize("bound, used, expected", [
    ("tcp://127.0.0.1:7802", "tcp://127.0.0.1:7801", "tcp://127.0.0.1:7802"),
    ("tcp://0.0.0.0:7802", "tcp://lab.example:7801", "tcp://lab.example:7802"),
    ("ipc:///run/x", "ipc:///run/y", "ipc:///run/x"),
])
def test_wildcard_stream_endpoint(bound, used, expected):
    assert connection.reachable(bound, used) == expected


def test_binary_that_is_not_there(monkeypatch, tmp_path):
    monkeypatch.setenv("LIMBER_BIN", str(tmp_path))
    refused("LIMBER_BIN", find_binary)
    (tmp_path / "limberd").write_text("#!/bin/sh\necho cannot bind >&2\nexit 3\n")
    (tmp_path / "limberd").chmod(0o755)
    assert find_binary() == tmp_path / "limberd"
    with pytest.raises(limber.LimberError, match="did not start: cannot bind"):
        limber.launch()
