"""Designs and pictures as values: what is refused before anything is sent."""

import json
import struct
from xml.etree import ElementTree

import limber
import numpy as np
import pytest
from limber.linkages import goals, surfaces
from limber.v1 import design_pb2 as messages

SVG = "{http://www.w3.org/2000/svg}"


def refused(call):
    with pytest.raises(limber.LimberError) as caught:
        call()
    assert caught.value.code == "INVALID_ARGUMENT"
    return caught.value.field


def test_targets_are_by_joint_weighed_or_of_all_joints():
    first, second = goals.targets_of({3: (1, 2, 3), 5: ((4, 5, 6), 0.5)}, "targets", lambda: 4)
    assert (first.joint, first.position.y, first.HasField("weight")) == (3, 2, False)
    assert (second.joint, second.position.z, second.weight) == (5, 6, 0.5)
    assert [target.joint for target in goals.targets_of(np.zeros((4, 3)), "targets", lambda: 4)] == [0, 1, 2, 3]
    assert refused(lambda: goals.targets_of(np.zeros((4, 2)), "targets", lambda: 4)) == "targets"
    assert refused(lambda: goals.targets_of(np.zeros((3, 3)), "targets", lambda: 4)) == "targets"
    assert refused(lambda: goals.targets_of({"a": (1, 2, 3)}, "targets", lambda: 4)) == "targets (joint)"
    assert refused(lambda: goals.targets_of({1: (1, 2, "x")}, "targets", lambda: 4)) == "targets[1].z"
    assert refused(lambda: goals.targets_of({1: ((1, 2, 3), None)}, "targets", lambda: 4)) == "targets[1] (weight)"
    assert refused(lambda: goals.targets_of({1: 5}, "targets", lambda: 4)) == "targets[1]"


def test_surfaces_are_files_triangles_or_points(tmp_path):
    path = tmp_path / "s.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert goals.surface_of(path, "surface").file.name == "s.obj"
    vertices = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    assert list(goals.surface_of((vertices, [(0, 1, 2)]), "surface").triangles.triangles.shape) == [1, 3]
    assert list(goals.surface_of(vertices, "surface").points.shape) == [3, 3]
    assert refused(lambda: goals.surface_of(object(), "surface")) == "surface"
    with pytest.raises(limber.LimberError) as caught:
        goals.surface_of(tmp_path / "none.obj", "surface")
    assert (caught.value.code, caught.value.field) == ("IO", "surface")


def test_only_what_is_given_is_sent():
    session = limber.LinkageSession(None, "s")
    request = goals.request(session.id, lambda: 4, surface=None, targets={0: (0, 0, 0)}, flat_share=None,
                            distance_weight=0.0, surface_weight=None, translation=None, rotation=None, scale=None,
                            shortest=None, longest=None, flat_height=None, smallest_angle=None, max_iterations=None)
    assert request.goal.HasField("distance_weight") and not request.goal.HasField("flat_share")
    assert not request.goal.HasField("placement") and not request.HasField("flat_height")
    for name in ("flat_share", "shortest", "flat_height", "scale"):
        assert refused(lambda: session.design(targets={0: (0, 0, 0)}, **{name: "much"})) == name


def test_infos_say_how_it_stands():
    message = messages.DesignInfo(job=7, state=messages.DESIGN_STATE_ENDED, end=messages.DESIGN_END_SETTLED, iteration=9,
                                  taken_revision=2, best=messages.DesignTerms(target_rms=0.5, holds=True))
    info = limber.DesignInfo.from_message(message)
    assert (info.job, info.state, info.end, info.taken, info.best.target_rms) == (7, "ended", "settled", 2, 0.5)
    message.ClearField("taken_revision")
    assert limber.DesignInfo.from_message(message).taken is None


def test_options_of_one_call_go_to_the_scene_and_to_the_design():
    def sort(design=None, **options):
        return goals.sorted_options(options, design, limber.linkage_scene, limber.LinkageSession.design)

    assert sort(name="hill", max_iterations=60, sections="segments") == (
        {"name": "hill"}, {"max_iterations": 60, "sections": "segments"})
    assert sort({"max_iterations": 60}, density=500) == ({"density": 500}, {"max_iterations": 60})
    assert refused(lambda: sort(iterations=60)) == "iterations"
    assert refused(lambda: sort({"iterations": 60})) == "design.iterations"
    assert refused(lambda: sort({"translation": (0, 0, 1)})) == "design.translation"
    assert refused(lambda: sort({"max_iterations": 60}, max_iterations=50)) == "max_iterations"
    assert refused(lambda: sort([60])) == "design"


def shape(*lines):
    return limber.Shape(tuple(np.array(line, dtype=float) for line in lines), (), np.zeros(0), np.zeros((0, 3)))


def test_pictures_have_a_panel_for_each_shape_at_one_scale(tmp_path):
    straight = shape([(0, 0, 0), (1, 0, 0)])
    twice = shape([(-1, 0, 0), (1, 0, 0)], [(0, -1, 0), (0, 1, 0)])
    limber.picture(tmp_path / "p.svg", {"one <": straight, "surface": None, "two": twice}, surface=[(0, 0, 0), (0, 0, 1)],
                   view=(-90, 0))
    drawing = ElementTree.parse(tmp_path / "p.svg").getroot()
    assert [text.text for text in drawing.iter(f"{SVG}text")] == ["one <", "surface", "two"]
    assert len(drawing.findall(f"{SVG}circle")) == 3 * 2
    ends = [np.array([pair.split(",") for pair in line.get("points").split()], dtype=float)
            for line in drawing.findall(f"{SVG}polyline")]
    lengths = sorted(float(np.linalg.norm(line[-1] - line[0])) for line in ends)
    assert lengths[0] == pytest.approx(0, abs=0.2), "seen from its end"
    assert lengths[2] == pytest.approx(2 * lengths[1], abs=0.3) and lengths[1] > 50


SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0.5)]


def binary_ply(order):
    mark = {"little": "<", "big": ">"}[order]
    head = (f"ply\nformat binary_{order}_endian 1.0\nelement vertex 4\nproperty double x\nproperty double y\n"
            "property double z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n")
    return head.encode() + struct.pack(f"{mark}12d", *np.ravel(SQUARE)) + struct.pack(f"{mark}B4i", 4, 0, 1, 2, 3)


def binary_stl():
    facets = b"".join(struct.pack("<12fH", 0, 0, 1, *np.ravel([SQUARE[i] for i in corners]), 0)
                      for corners in ((0, 1, 2), (0, 2, 3)))
    return bytes(80) + struct.pack("<I", 2) + facets


TEXT_STL = "solid s\n" + "".join(
    "facet normal 0 0 1\nouter loop\n" + "".join("vertex {} {} {}\n".format(*SQUARE[i]) for i in corners)
    + "endloop\nendfacet\n" for corners in ((0, 1, 2), (0, 2, 3))) + "endsolid\n"
TEXT_PLY = ("ply\nformat ascii 1.0\ncomment a square\nelement vertex 4\nproperty float x\nproperty float y\n"
            "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
            + "".join("{} {} {}\n".format(*point) for point in SQUARE) + "4 0 1 2 3\n")
TEXT_OFF = "COFF # a square\n4 1\n" + "".join("{} {} {} 255 0 0 255\n".format(*point) for point in SQUARE) + "4 0 1 2 3 0.5 0 0\n"


def glb(mode, order):
    """The square as a fan (mode 6) or a strip (5) of two triangles, half as large in a node that doubles it."""
    points = np.array([SQUARE[i] for i in order], dtype="<f4") / 2
    document = {"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "scale": [2, 2, 2]}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": mode}]}],
                "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4}],
                "bufferViews": [{"buffer": 0, "byteLength": 48}], "buffers": [{"byteLength": 48}]}
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    return (struct.pack("<4sII", b"glTF", 2, 28 + len(text) + 48) + struct.pack("<I4s", len(text), b"JSON") + text
            + struct.pack("<I4s", 48, b"BIN\0") + points.tobytes())


TEXT_OBJ = "".join("v {} {} {}\n".format(*point) for point in SQUARE) + "f 1/1 2/2 -2//1 4 # a square\n"


@pytest.mark.parametrize("name, content", [
    ("s.obj", TEXT_OBJ.encode()), ("s.ply", TEXT_PLY.encode()), ("s.stl", TEXT_STL.encode()), ("s.off", TEXT_OFF.encode()), ("s.glb", glb(6, (0, 1, 2, 3))), ("b.stl", binary_stl()),
    ("b.ply", binary_ply("little")), ("B.PLY", binary_ply("big"))])
def test_pictures_draw_the_files_that_designs_take(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    shapes = {"a": shape([(0, 0, 0), (1, 0, 0)])}
    limber.picture(tmp_path / "file.svg", shapes, surface=tmp_path / name)
    limber.picture(tmp_path / "arrays.svg", shapes, surface=(SQUARE, [(0, 1, 2), (0, 2, 3)]))
    assert (tmp_path / "file.svg").read_text() == (tmp_path / "arrays.svg").read_text()


def test_strips_of_a_glb_are_drawn(tmp_path):
    (tmp_path / "s.glb").write_bytes(glb(5, (0, 1, 3, 2)))
    points, triangles = surfaces.read(tmp_path / "s.glb", "surface")
    areas = np.cross(points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]]) / 2
    whole = np.cross(np.subtract(SQUARE[1], SQUARE[0]), np.subtract(SQUARE[3], SQUARE[0]))
    assert len(triangles) == 2 and np.linalg.norm(areas, axis=1).sum() == pytest.approx(np.linalg.norm(whole))


def test_surfaces_that_cannot_be_drawn_are_refused(tmp_path):
    for name, content in (("a.obj", ""), ("b.ply", "ply\n"), ("c.ply", TEXT_PLY[:-9]), ("d.stl", "vertex 1 2"),
                          ("e.txt", ""), ("h.off", TEXT_OFF[:-12]), ("i.off", ""), ("j.glb", "glTF"), ("f.obj", "v 0 0 0\nf 1 2 3\n"), ("g.obj", "v 0 x 0\n")):
        (tmp_path / name).write_text(content)
    rows = np.stack(np.meshgrid(np.arange(3.0), np.arange(4.0), [0.0]), axis=-1)[:, :, 0]
    points = rows.reshape(-1, 3)
    faulty = [*sorted(tmp_path.iterdir()), rows[:1], rows * np.nan, np.zeros((0, 3)), np.zeros((4, 2)),
              (points, [(0, 1, 5000)]), (points, [(0, 1, -1)]), (points, np.array([[0.0, 1, 2]])),
              (points, np.zeros((0, 3), int)), (points, [0, 1, 2])]
    for surface in faulty:
        assert refused(lambda: limber.picture(tmp_path / "p.svg", {"a": None}, surface=surface)) == "surface", surface
    with pytest.raises(limber.LimberError) as caught:
        limber.picture(tmp_path / "p.svg", {"a": None}, surface=tmp_path / "none.ply")
    assert (caught.value.code, caught.value.field) == ("IO", "surface")


def test_empty_bounds_are_no_bounds_and_refused():
    session = limber.LinkageSession(None, "s")
    for name in ("shortest_lengths", "longest_lengths", "thinnest_sections", "thickest_sections", "joint_weights"):
        assert refused(lambda: session.design(targets={0: (0, 0, 0)}, **{name: []})) == name


def test_pictures_of_nothing_are_refused(tmp_path):
    assert refused(lambda: limber.picture(tmp_path / "p.svg", {})) == "shapes"
    assert refused(lambda: limber.picture(tmp_path / "p.svg", {"a": np.zeros((3, 3))})) == "shapes", "of no linkage"
    assert refused(lambda: limber.picture(tmp_path / "p.png", {"a": shape([(0, 0, 0), (1, 1, 1)])})) == "path"
    assert not (tmp_path / "p.png").exists()
    assert refused(lambda: limber.picture(tmp_path / "p.svg", {"a": None})) == "shapes"
    assert refused(lambda: limber.picture(tmp_path / "p.svg", {"a": shape([(1, 1, 1), (1, 1, 1)])})) == "shapes"
    with pytest.raises(limber.LimberError) as caught:
        limber.picture(tmp_path / "none" / "p.svg", {"a": shape([(0, 0, 0), (1, 1, 1)])})
    assert (caught.value.code, caught.value.field) == ("IO", "path")
