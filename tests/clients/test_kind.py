"""What the shared modules of the Python client ask of kinds, without a server."""

import limber
import pytest
from limber import edits, kind, scenes


def refused(call):
    with pytest.raises(limber.LimberError) as caught:
        call()
    return caught.value.code, caught.value.field


def test_sessions_have_the_class_of_their_kind(monkeypatch):
    monkeypatch.setattr(kind, "_KINDS", dict(kind._KINDS))
    assert [kind.session_class(name) for name in ("", "bodies", "linkages", "beams", "shells")] == [
        limber.Session, limber.Session, limber.LinkageSession, limber.BeamSession, limber.OpenSession]
    limber.register_kind("shells", limber.BeamSession)
    assert kind.session_class("shells") is limber.BeamSession
    assert refused(lambda: limber.register_kind("", limber.Session)) == ("INVALID_ARGUMENT", "kind")
    assert refused(lambda: limber.register_kind("shells", int)) == ("INVALID_ARGUMENT", "session_class")


@pytest.mark.parametrize("name, text, kind_name, is_filled", [
    ("a.msh", "", "Bodies", False), ("a.ply", "", "Bodies", True), ("a.obj", "v 0 0 0\nl 1 2\nf 1 2 3\n", "Bodies", True),
    ("a.OBJ", "# rods\nv 0 0 0\nl 1 2\n", "Linkages", False), ("a.json", "{}", "NoneType", False)])
def test_files_without_a_scene_are_opened_by_one_kind(tmp_path, name, text, kind_name, is_filled):
    path = tmp_path / name
    assert kind.opener_of(path) is None, "there is no such file"
    path.write_text(text)
    opener = kind.opener_of(path)
    assert type(opener).__name__ == kind_name
    assert opener is None or opener.fills(path) == is_filled


@pytest.mark.parametrize("value, field", [
    ({"mesh": {"path": "none.msh"}}, "mesh.path"), ({"keyframes": [{"path": "none.msh"}]}, "keyframes[0].path"),
    ({"base_motion": {"path": "none.pc2"}}, "base_motion.path"),
    ({"linkage": {"lines": {"path": "none.obj"}}}, "linkage.lines.path"),
    ({"beams": {"lines": {"path": "none.ply"}}}, "beams.lines.path")])
def test_files_that_a_scene_names_are_sent(tmp_path, monkeypatch, value, field):
    monkeypatch.chdir(tmp_path)
    assert refused(lambda: scenes.to_message(value)) == ("IO", field)


def test_a_structure_alone_is_a_scene_of_it():
    assert len(scenes.to_message({"elements": [{}]}).beams.structure.elements) == 1


def test_what_undo_brings_back_is_not_completed():
    assert refused(lambda: edits.to_messages([limber.undo(), limber.dynamics(period_frames=9)])) == (
        "INVALID_ARGUMENT", "edits[1]")
    made, = edits.to_messages([limber.dynamics(period_frames=9)])
    assert (made.set_dynamics.period_frames, made.set_dynamics.damping_ratio) == (9, 0)


def test_scenes_of_beams_and_linkages_have_no_material_to_optimise():
    for value in ({"linkage": {}}, {"beams": {}}):
        scene = scenes.to_message(value)
        assert refused(lambda: kind.of(scene).set_variables(scene, "all")) == ("INVALID_ARGUMENT", "optimise")
    scene = scenes.to_message({})
    kind.of(scene).set_variables(scene, "all")
    assert scene.material_optimisation.variables == limber.bodies.edits.VARIABLES["all"]
