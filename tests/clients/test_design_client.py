"""Designs and pictures as values: what is refused before anything is sent."""

from xml.etree import ElementTree

import limber
import numpy as np
import pytest
from limber import designs
from limber.v1 import design_pb2 as messages

SVG = "{http://www.w3.org/2000/svg}"


def refused(call):
    with pytest.raises(limber.LimberError) as caught:
        call()
    assert caught.value.code == "INVALID_ARGUMENT"
    return caught.value.field


def test_targets_are_by_joint_weighed_or_of_all_joints():
    first, second = designs.targets_of({3: (1, 2, 3), 5: ((4, 5, 6), 0.5)}, "targets")
    assert (first.joint, first.position.y, first.HasField("weight")) == (3, 2, False)
    assert (second.joint, second.position.z, second.weight) == (5, 6, 0.5)
    assert [target.joint for target in designs.targets_of(np.zeros((4, 3)), "targets")] == [0, 1, 2, 3]
    assert refused(lambda: designs.targets_of(np.zeros((4, 2)), "targets")) == "targets"
    assert refused(lambda: designs.targets_of({"a": (1, 2, 3)}, "targets")) == "targets (joint)"
    assert refused(lambda: designs.targets_of({1: (1, 2, "x")}, "targets")) == "targets[1].z"
    assert refused(lambda: designs.targets_of({1: ((1, 2, 3), None)}, "targets")) == "targets[1] (weight)"
    assert refused(lambda: designs.targets_of({1: 5}, "targets")) == "targets[1]"


def test_surfaces_are_files_triangles_or_points(tmp_path):
    path = tmp_path / "s.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert designs.surface_of(path, "surface").file.name == "s.obj"
    vertices = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    assert list(designs.surface_of((vertices, [(0, 1, 2)]), "surface").triangles.triangles.shape) == [1, 3]
    assert list(designs.surface_of(vertices, "surface").points.shape) == [3, 3]
    assert refused(lambda: designs.surface_of(object(), "surface")) == "surface"
    with pytest.raises(limber.LimberError) as caught:
        designs.surface_of(tmp_path / "none.obj", "surface")
    assert (caught.value.code, caught.value.field) == ("IO", "surface")


def test_only_what_is_given_is_sent():
    session = limber.LinkageSession(None, "s")
    request = designs.request(session.id, surface=None, targets={0: (0, 0, 0)}, flat_share=None, distance_weight=0.0,
                              surface_weight=None, translation=None, rotation=None, scale=None, shortest=None,
                              longest=None, flat_height=None, smallest_angle=None, max_iterations=None)
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
        return designs.sorted_options(options, design, limber.linkage_scene, limber.LinkageSession.design)

    assert sort(name="hill", max_iterations=60, sections="segments") == (
        {"name": "hill"}, {"max_iterations": 60, "sections": "segments"})
    assert sort({"max_iterations": 60}, density=500) == ({"density": 500}, {"max_iterations": 60})
    assert refused(lambda: sort(iterations=60)) == "iterations"
    assert refused(lambda: sort({"iterations": 60})) == "design.iterations"
    assert refused(lambda: sort({"translation": (0, 0, 1)})) == "design.translation"
    assert refused(lambda: sort({"max_iterations": 60}, max_iterations=50)) == "max_iterations"
    assert refused(lambda: sort([60])) == "design"


def test_grids_whose_rods_would_overlap_are_refused():
    at = np.arange(12).reshape(3, 4)
    flat = np.array([(0.1 * c + 0.2 * r, 0.3 * r, 0) for r in range(3) for c in range(4)])
    edges = np.concatenate([np.stack([at[:, :-1].ravel(), at[:, 1:].ravel()], 1),
                            np.stack([at[:-1].ravel(), at[1:].ravel()], 1)])
    grid = limber.StartingGrid(flat, edges, flat, np.ones(len(edges)), 60.0, 0.0)
    designs.demand_room(grid, 4, {"rectangle": (0.2, 0.08)})
    designs.demand_room(grid, 4, {"tube": {"diameter": 1, "wall_thickness": 0.1}})
    assert refused(lambda: designs.demand_room(grid, 4, {"rectangle": (0.2, 0.09)})) == "columns", "0.083 apart"
    flat = np.array([(0.5 * c, 0.05 * r, 0) for r in range(3) for c in range(4)])
    grid = limber.StartingGrid(flat, edges, flat, np.ones(len(edges)), 60.0, 0.0)
    assert refused(lambda: designs.demand_room(grid, 4, {"ellipse": (0.2, 0.08)})) == "rows"


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


def test_pictures_of_nothing_are_refused(tmp_path):
    assert refused(lambda: limber.picture(tmp_path / "p.svg", {})) == "shapes"
    assert refused(lambda: limber.picture(tmp_path / "p.svg", {"a": None})) == "shapes"
    assert refused(lambda: limber.picture(tmp_path / "p.svg", {"a": shape([(1, 1, 1), (1, 1, 1)])})) == "shapes"
    with pytest.raises(limber.LimberError) as caught:
        limber.picture(tmp_path / "none" / "p.svg", {"a": shape([(0, 0, 0), (1, 1, 1)])})
    assert (caught.value.code, caught.value.field) == ("IO", "path")
