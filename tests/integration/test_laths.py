"""What a workshop cuts of a linkage or a structure of beams: lengths and holes against the lines, drawings read back."""

import csv
import io
import math
import os
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import limber
import numpy as np
import pytest
from conftest import ROOT
from linkage_inputs import RECTANGLE, grid, linkage  # noqa: F401
from refusals import refusal

SHARED = Path(os.environ.get("LIMBER_SHARED", ROOT.parent / "shared"))


def drawn_lengths(vertices, edges):
    return np.linalg.norm(vertices[edges[:, 1]] - vertices[edges[:, 0]], axis=1)


def lines_of(path):
    """Vertices and edges of an .obj."""
    words = [line.split() for line in path.read_text().splitlines()]
    vertices = np.array([word[1:4] for word in words if word[:1] == ["v"]], dtype=float)
    chains = [[int(vertex) - 1 for vertex in word[1:]] for word in words if word[:1] == ["l"]]
    return vertices, np.array([pair for chain in chains for pair in zip(chain, chain[1:])])


def check_cover(laths, lengths, scale):
    """Every segment is in one lath, as long as it is drawn, between two holes or an end; of laths without overhang."""
    assert sorted(part for lath in laths for part in lath.parts) == list(range(len(lengths)))
    for lath in laths:
        assert np.allclose(np.diff(lath.cuts), lengths[list(lath.parts)] * scale, rtol=1e-9)
        assert lath.length == pytest.approx(lengths[list(lath.parts)].sum() * scale)
    assert laths.length == pytest.approx(lengths.sum() * scale)


def test_rods_of_a_grid_are_laths(server):
    vertices, edges = grid(4)
    opened = server.open(limber.linkage_scene(vertices, edges, section=RECTANGLE, youngs_modulus=1e9), progress=False)
    laths = opened.laths(overhang=0)
    assert len(laths) == 8 and laths.unit == "mm" and laths.section == "rectangle 20 x 5"
    check_cover(laths, drawn_lengths(vertices, edges), 1000)
    for lath in laths:
        assert (lath.width, lath.height) == pytest.approx((20, 5)) and not lath.closed and len(lath.holes) == 4
        points = vertices[[hole.joint for hole in lath.holes]]
        assert np.allclose([hole.at for hole in lath.holes], 1000 * np.linalg.norm(points - points[0], axis=1))
        assert all(len(hole.crosses) == 1 and len({*hole.crosses} & {lath.number}) == 0 for hole in lath.holes)
        assert np.abs([hole.curvature_side for hole in lath.holes]).max() < 1e-9
    longer = opened.laths("cm", overhang=3)
    assert longer.length == pytest.approx(laths.length / 10 + 8 * 6) and longer[0].holes[0].at == 3
    opened.close()


@pytest.mark.parametrize("name, count", [("two_rods", 2), ("single_linkage", 2), ("hyperboloid_closed", 14),
                                         ("etienne_hyperboloid_measured", 26), ("darth_vader_pavilion", 26)])
def test_laths_of_public_linkages(server, name, count):
    path = SHARED / "data" / "linkages" / f"{name}.obj"
    if not path.is_file():
        pytest.skip(f"no {path} (set LIMBER_SHARED)")
    opened = server.open(path, progress=False)
    opened.wait()
    laths = opened.laths("m", overhang=0)
    assert len(laths) == count
    check_cover(laths, drawn_lengths(*lines_of(path)), 1)
    opened.close()


def test_a_ring_is_cut_at_a_joint(server):
    """A ring that spokes cross: it goes on at each of its joints."""
    ring = [(math.cos(a), math.sin(a), 0) for a in np.arange(16) * math.pi / 8]
    outer = [(2 * x, 2 * y, 0) for x, y, _ in ring]
    inner = [(x / 2, y / 2, 0) for x, y, _ in ring]
    edges = ([(i, (i + 1) % 16) for i in range(16)] + [(i, 16 + i) for i in range(16)]
             + [(i, 32 + i) for i in range(16)])
    opened = server.open(limber.linkage_scene(np.array(ring + outer + inner), np.array(edges), section=RECTANGLE),
                         progress=False)
    laths = opened.laths()
    (closed,) = [lath for lath in laths if lath.closed]
    assert len(laths) == 17 and len(closed.parts) == 16 and closed.holes[0].joint == closed.holes[-1].joint
    opened.close()


def test_what_is_bent_where(linkage):  # noqa: F811
    linkage.deploy(60)
    linkage.wait()
    shape, laths = linkage.shape(), linkage.laths("m")
    angles = {hole.joint: hole.angle for lath in laths for hole in lath.holes}
    assert [angles[joint] for joint in range(len(shape.angles))] == pytest.approx(shape.angles, abs=1e-4)
    # At its first hole, as its centreline is bent beside it.
    normals = linkage.solution().normals
    for lath in laths:
        hole, line = lath.holes[0], shape.centrelines[lath.parts[0]]
        if linkage.geometry().joints_of_segment[lath.parts[0]][0] != hole.joint:
            line = line[::-1]
        edges = np.diff(line[:3], axis=0)
        lengths = np.linalg.norm(edges, axis=1)
        bend = np.diff(edges / lengths[:, None], axis=0)[0] / lengths.mean()
        assert math.hypot(hole.curvature_side, hole.curvature_normal) == pytest.approx(np.linalg.norm(bend), rel=0.01)
        assert hole.curvature_normal == pytest.approx(bend @ normals[hole.joint], rel=0.02)


def test_csv_has_a_row_for_each_hole(linkage):  # noqa: F811
    laths = linkage.laths()
    rows = list(csv.DictReader(io.StringIO(laths.csv())))
    assert len(rows) == sum(len(lath.holes) for lath in laths)
    for row in rows:
        hole = laths[int(row["lath"])].holes[int(row["hole"])]
        assert float(row["at_mm"]) == pytest.approx(hole.at, rel=1e-6) and int(row["joint"]) == hole.joint
        assert row["crosses"] == " ".join(map(str, hole.crosses)) and row["section"] == "rectangle 20 x 5"


def test_sheets_hold_each_lath_once_and_apart(linkage):  # noqa: F811
    laths = linkage.laths(overhang=15)
    sheets = laths.sheets((5000, 200), margin=10, gap=4, kerf=1)
    assert len(sheets) > 1
    assert sorted(placed.lath.number for sheet in sheets for placed in sheet.placed) == list(range(len(laths)))
    for sheet in sheets:
        boxes = np.array([(p.x, p.y - p.lath.width / 2, p.x + p.lath.length, p.y + p.lath.width / 2) for p in sheet.placed])
        assert boxes[:, :2].min() >= 10.5 - 1e-9
        assert boxes[:, 2].max() <= 5000 - 10.5 + 1e-9 and boxes[:, 3].max() <= 200 - 10.5 + 1e-9
        for i, one in enumerate(boxes):
            for other in boxes[i + 1:]:
                apart = max(other[0] - one[2], one[0] - other[2], other[1] - one[3], one[1] - other[3])
                assert apart >= 5 - 1e-9
    assert refusal(lambda: laths.sheets((2000, 200))) == ("OUT_OF_RANGE", "sheet")
    assert refusal(lambda: laths.sheets(kerf=-1)) == ("INVALID_ARGUMENT", "kerf")


def test_dxf_is_read_back(linkage, tmp_path):  # noqa: F811
    ezdxf = pytest.importorskip("ezdxf")
    scales = np.ones(len(linkage.geometry().edges))
    scales[72] = 1.5
    linkage.set_section_scales(scales)
    linkage.wait()
    laths = linkage.laths(overhang=15)
    path = laths.save_dxf(tmp_path / "laths.dxf", sheet=(3000, 500), margin=10, gap=4, kerf=0.5, hole=6)
    drawing = ezdxf.readfile(path)
    assert drawing.header["$INSUNITS"] == 4 and not drawing.audit().errors
    space = drawing.modelspace()
    outlines = [list(line.get_points("xy")) for line in space.query('LWPOLYLINE[layer=="OUTLINES"]')]
    assert sorted(len(corners) for corners in outlines) == [4] * (len(laths) - 1) + [12]
    sizes = sorted(np.ptp(np.array(corners)[:, 0]) for corners in outlines)
    assert sizes == pytest.approx(sorted(lath.length + 0.5 for lath in laths))
    circles = space.query('CIRCLE[layer=="HOLES"]')
    assert len(circles) == sum(len(lath.holes) for lath in laths)
    assert {circle.dxf.radius for circle in circles} == {2.75}
    centres = [tuple(circle.dxf.center)[:2] for circle in circles]
    inside = 0
    for corners in outlines:
        low, high = np.min(corners, axis=0), np.max(corners, axis=0)
        at = np.sort([x - low[0] - 0.25 for x, y in centres if low[0] < x < high[0] and low[1] < y < high[1]])
        inside += len(at)
        assert any(np.allclose(at, [hole.at for hole in lath.holes], atol=1e-6) for lath in laths if len(lath.holes) == len(at))
    assert inside == len(circles)


def test_svg_has_its_true_size(linkage, tmp_path):  # noqa: F811
    laths = linkage.laths()
    files = laths.save_svg(tmp_path / "laths.svg", sheet=(2500, 300), gap=5)
    assert [file.name for file in files] == ["laths.svg", "laths_2.svg", "laths_3.svg"][:len(files)] and len(files) > 1
    polygons = 0
    for file in files:
        root = ElementTree.parse(file).getroot()
        assert (root.get("width"), root.get("height")) == ("2500mm", "300mm") and root.get("viewBox") == "0 0 2500 300"
        polygons += len(root.findall("{*}polygon"))
    assert polygons == len(laths)


def test_laths_reach_beyond_their_outer_holes(linkage, tmp_path):  # noqa: F811
    """By 1.5 diameters of their holes, which are a fifth of 20 mm."""
    laths, bare = linkage.laths(), linkage.laths(overhang=0)
    assert laths.hole == pytest.approx(4) and laths.length == pytest.approx(bare.length + 2 * 6 * len(laths))
    for lath in laths:
        assert (lath.holes[0].at, lath.length - lath.holes[-1].at) == pytest.approx((6, 6))
        assert lath.cuts[1] - lath.cuts[0] == pytest.approx(bare[lath.number].cuts[1] + 6)
    assert linkage.laths(hole=8)[0].holes[0].at == pytest.approx(12)
    assert linkage.laths("cm", hole=0.8, edge_distance=2)[0].holes[0].at == pytest.approx(1.6)
    assert linkage.laths(hole=8, overhang=20)[0].holes[0].at == pytest.approx(20)


def test_holes_fit_their_laths(linkage, tmp_path):  # noqa: F811
    """At most half the width, and within the ends."""
    laths, path = linkage.laths(), tmp_path / "no.svg"
    for hole in (0, -1, 10.1, 20, float("nan")):
        assert refusal(lambda: linkage.laths(hole=hole)) == ("INVALID_ARGUMENT", "hole")
        assert refusal(lambda: laths.save_svg(path, hole=hole)) == ("INVALID_ARGUMENT", "hole")
    assert refusal(lambda: linkage.laths(edge_distance=-1)) == ("INVALID_ARGUMENT", "edge_distance")
    for bare in (linkage.laths(overhang=0), linkage.laths(edge_distance=0), linkage.laths(overhang=1.9)):
        with pytest.raises(limber.LimberError, match="cuts the end of lath 0: take a larger overhang"):
            bare.save_svg(path)
    assert not path.exists() and linkage.laths(hole=10).save_svg(path)


def parts_of(session):
    return sorted(tuple(sorted(lath.parts)) for lath in session.laths())


def test_laths_do_not_depend_on_the_pose(server):
    """Of the closed linkage, whose laths lie on each other, as of the open one."""
    opened = server.open(sample="hyperboloid", progress=False)
    opened.wait()
    found = parts_of(opened)
    for angle in (40, 1, 1e-3, 0):
        opened.deploy(angle)
        assert opened.wait().mean_angle == pytest.approx(angle, abs=1e-6)
        assert parts_of(opened) == found
    assert [rod.segments for rod in opened.geometry().rods] == [rod.segments for rod in opened.solution().rods]
    opened.close()


def test_members_of_beams(server):
    """A cross of two beams of three elements each, and a cable."""
    nodes = [(0, 0), (1, 0), (2, 0), (3, 0), (1, -1), (1, 1), (1, 2)]
    ends = [(0, 1), (1, 2), (3, 2), (4, 1), (1, 5), (6, 5), (3, 5)]
    structure = {"nodes": [{"position": {"x": x, "y": y}} for x, y in nodes],
                 "sections": [{"rectangle": {"width": 0.04, "height": 0.003}, "young": 10e9}],
                 "elements": [{"start": a, "finish": b, "kind": "BEAM_KIND_BEAM"} for a, b in ends],
                 "supports": [{"node": 0, "fix_x": True, "fix_y": True, "fix_z": True, "fix_rotation_x": True,
                               "fix_rotation_y": True, "fix_rotation_z": True}]}
    structure["elements"][-1]["kind"] = "BEAM_KIND_CABLE"
    structure["elements"][5]["rest_length"] = 1.25
    opened = server.open(structure, progress=False)
    laths = opened.laths(overhang=0)
    assert [lath.parts for lath in laths] == [(0, 1, 2), (3, 4, 5), (6,)]
    assert [lath.length for lath in laths] == pytest.approx([3000, 3250, 1000 * math.sqrt(5)])
    assert [(hole.joint, hole.at, hole.crosses) for hole in laths[0].holes] == [(1, 1000, (1,)), (3, 3000, (2,))]
    assert {lath.section for lath in laths} == {"rectangle 40 x 3"}
    assert laths.csv().count("\n") == 1 + sum(len(lath.holes) for lath in laths)
    assert laths[0].holes[0].angle == pytest.approx(90) and laths[0].holes[1].angle == pytest.approx(math.degrees(math.atan(0.5)))
    longer = opened.laths()  # beyond the one outer hole: 1.5 diameters of 8 mm
    assert longer.hole == pytest.approx(8) and longer[0].length == pytest.approx(3012) and longer[0].holes[0].at == 1000
    opened.close()


def test_members_that_are_bent(server):
    """A strip pushed into an arch, and one across its crown that hangs on it: curvature from the angle that it turns by."""
    count = 16
    held = {f"fix_{kind}": True for kind in ("x", "y", "z", "rotation_x", "rotation_z")}
    nodes = [(i / 8, 0, 0.02 * math.sin(math.pi * i / count)) for i in range(count + 1)]
    nodes += [(1, -0.5, 0.02), (1, 0.5, 0.02)]
    ends = [(i, i + 1) for i in range(count)] + [(17, 8), (8, 18)]
    opened = server.open({"nodes": [{"position": {"x": x, "y": y, "z": z}} for x, y, z in nodes],
                          "sections": [{"rectangle": {"width": 0.06, "height": 0.004}, "young": 11e9, "poisson": 0.3}],
                          "elements": [{"start": a, "finish": b} for a, b in ends],
                          "supports": [{"node": 0, **held}, {"node": count, **held}]}, progress=False)
    opened.move_support(count, x=-0.4)
    opened.wait()
    laths, solution = opened.laths("m"), opened.solution()
    (hole,) = laths[0].holes
    assert (hole.joint, hole.crosses) == (8, (1,)) and hole.angle == pytest.approx(90, abs=0.1)
    # M / EI with the moment beside the crown; it bends away from the normal, which points up.
    moment = np.abs(solution.bending_moments[7, 1, 0])
    assert hole.curvature_normal == pytest.approx(-moment / (11e9 * 0.06 * 0.004 ** 3 / 12), rel=0.05)
    assert abs(hole.curvature_side) < 1e-6
    assert laths[1].holes[0].curvature_normal == pytest.approx(0, abs=1e-3)
    opened.close()


def test_command(server, linkage, tmp_path):  # noqa: F811
    def run(*arguments):
        environment = dict(os.environ, LIMBER_ENDPOINT=server.connection.endpoint)
        return subprocess.run([sys.executable, "-m", "limber", *map(str, arguments)], env=environment, capture_output=True,
                              text=True, timeout=60)

    done = run("laths", linkage.id, "--csv", tmp_path / "a.csv", "--svg", tmp_path / "a.svg", "--overhang", 15)
    assert done.returncode == 0 and done.stdout.split() == [str(tmp_path / "a.csv"), str(tmp_path / "a.svg")], done.stderr
    assert (tmp_path / "a.csv").read_text() == linkage.laths(overhang=15).csv()
    assert run("laths", linkage.id).stdout == linkage.laths().csv()
    refused = run("laths", linkage.id, "--dxf", tmp_path / "a.dxf", "--sheet", 100, 100)
    assert refused.returncode == 1 and "the sheet has" in refused.stderr
    assert run("laths", "nobody").returncode == 1 and run("laths").returncode == 2
