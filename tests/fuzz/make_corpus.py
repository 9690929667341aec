#!/usr/bin/python3
"""Writes the small inputs that fuzzing starts from, corpus/TARGET, from files and messages of the tests.

usage: tests/fuzz/make_corpus.py    (needs the Python client's messages: scripts/build release limber_python_proto)"""

import json
import struct
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(ROOT / "clients/python"), str(ROOT / "tests/integration")]

import limber  # noqa: E402
from google.protobuf import json_format  # noqa: E402
from google.protobuf.descriptor import FieldDescriptor as Field  # noqa: E402
from limber.v1 import beam_structure_pb2, common_pb2, follow_pb2, scene_pb2, service_pb2, stored_pb2  # noqa: E402

SEPARATOR = b"\n%%%\n"
DATA = ROOT / "tests/engine/scene/data"
VEGA = b"""*VERTICES
5 3 0 0
1 0 0 0
2 1 0 0
3 0 1 0
4 0 0 1
5 1 1 1
*ELEMENTS
TET
2 4 0
1 1 2 3 4
2 2 3 4 5
*MATERIAL A
ENU, 1000, 1e6, 0.45
*SET one
1
*REGION
one, A
*INCLUDE more.veg
"""
ELASTIC = b"""*groups 2
*MATERIAL, NAME=GROUP_0
*ELASTIC
7e+06, 0.45
*DENSITY 100
*num_of_tets 1
*MATERIAL, NAME=GROUP_1
*ELASTIC
1e+04, 0.45
*DENSITY 100
*num_of_tets 1
*ELSET, ELSET=GROUP_0
0
*ELSET, ELSET=GROUP_1
1
"""
POINTS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
OBJ = b"mtllib a.mtl\n" + b"".join(b"v %d %d %d\n" % p for p in POINTS) + b"".join(
    b"f %d/1/1 %d//2 %d\n" % tuple(i + 1 for i in f) for f in FACES)
JOB = (b'{"beam material":[0.3,1e9],"cross section dim":[0.015,0.015],"fixed vertices":[[0,[0,1,2,3,4,5]]],'
       b'"forces":[[1,[0.0,0.0,5.0,0.0,0.0,0.0]]],"label":"a","mesh filename":"a.ply","meshLabel":"a"}')
LINES = b"v 0 0 0\nv 1 0.5 0\nv 1 1 0\nv 0 1 0.25\nl 1 2\nl 2 3 4\nl -1 -4\n"


def ply(kind):
    order = "<" if kind == "binary_little_endian" else ">"
    head = (f"ply\nformat {kind} 1.0\ncomment a\nelement vertex 4\nproperty float x\nproperty double y\nproperty float z\n"
            "element face 4\nproperty list uchar int vertex_indices\nend_header\n").encode()
    if kind == "ascii":
        return head + b"".join(b"%d %d %d\n" % p for p in POINTS) + b"".join(b"3 %d %d %d\n" % f for f in FACES)
    return head + b"".join(struct.pack(order + "fdf", *p) for p in POINTS) + b"".join(
        struct.pack(order + "Biii", 3, *f) for f in FACES)


def edge_ply():
    return (b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n"
            b"property float ny\nproperty float nz\nelement edge 2\nproperty int vertex1\nproperty int vertex2\nend_header\n"
            b"0 0 0 0 0 1\n1 0 0 0 0 1\n2 0 0.5 0 1 0\n0 1\n1 2\n")


def stl(is_binary):
    corners = [[POINTS[i] for i in face] for face in FACES]
    if is_binary:
        return bytes(80) + struct.pack("<I", 4) + b"".join(
            struct.pack("<12fH", 0, 0, 0, *(x for p in triangle for x in p), 0) for triangle in corners)
    return b"solid a\n" + b"".join(b"facet normal 0 0 1\nouter loop\n" + b"".join(b"vertex %d %d %d\n" % p for p in t) +
                                   b"endloop\nendfacet\n" for t in corners) + b"endsolid a\n"


def off():
    return b"COFF # colours\n4 4 6\n" + b"".join(b"%d %d %d 255 0 0 255\n" % p for p in POINTS) + b"".join(
        b"3 %d %d %d 0.5 0 0\n" % f for f in FACES)


def glb(kind):
    """A list of triangles with indices, a strip in two nested nodes, or sparse positions."""
    points = struct.pack("<12f", *(x for p in POINTS for x in p))
    faces = bytes(i for f in FACES for i in f)
    views = [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}]
    positions = {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4}
    primitive = {"attributes": {"POSITION": 0}, "indices": 1}
    nodes = [{"mesh": 0}]
    if kind == "strip":
        primitive = {"attributes": {"POSITION": 0}, "mode": 5}
        nodes = [{"children": [1, 2], "matrix": [0, 1, 0, 0, -2, 0, 0, 0, 0, 0, 3, 0, 10, 0, 0, 1]},
                 {"mesh": 0, "rotation": [0, 0, 0.6, 0.8], "scale": [-1, 1, 1]}, {"mesh": 0, "translation": [0, 0, 5]}]
    if kind == "sparse":
        views += [{"buffer": 0, "byteOffset": 48, "byteLength": 1}, {"buffer": 0, "byteLength": 16, "byteStride": 16}]
        positions["sparse"] = {"count": 1, "indices": {"bufferView": 2, "componentType": 5121}, "values": {"bufferView": 3}}
    text = json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": nodes, "meshes": [{"primitives": [primitive]}],
        "accessors": [positions, {"bufferView": 1, "componentType": 5121, "type": "SCALAR", "count": 12}],
        "bufferViews": views, "buffers": [{"byteLength": 60}]}, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    return (struct.pack("<4sII", b"glTF", 2, 28 + len(text) + 60) + struct.pack("<I4s", len(text), b"JSON") + text +
            struct.pack("<I4s", 60, b"BIN\0") + points + faces)


def fill(message, depth=0):
    """Every field once: of repeated ones two entries, of a oneof the last."""
    for field in message.DESCRIPTOR.fields:
        if field.containing_oneof is not None and field != field.containing_oneof.fields[-1] and depth > 0:
            continue
        count = 2 if field.label == Field.LABEL_REPEATED else 1
        if field.message_type is not None and field.message_type.GetOptions().map_entry:
            continue
        for i in range(count):
            if field.type == Field.TYPE_MESSAGE:
                if depth > 4 or field.message_type.full_name.startswith("google."):
                    continue
                part = getattr(message, field.name).add() if count == 2 else getattr(message, field.name)
                if count == 1:
                    part.SetInParent()
                fill(part, depth + 1)
                continue
            value = {Field.TYPE_STRING: "s", Field.TYPE_BYTES: bytes(8), Field.TYPE_BOOL: True, Field.TYPE_DOUBLE: 0.5,
                     Field.TYPE_FLOAT: 0.5, Field.TYPE_ENUM: 1}.get(field.type, i + 1)
            if count == 2:
                getattr(message, field.name).append(value)
            else:
                setattr(message, field.name, value)


def scenes():
    """Of every kind, small."""
    import numpy as np
    nodes = np.array(POINTS + [(1, 1, 1)], dtype=float)
    tets = np.array([[0, 1, 2, 3], [1, 2, 3, 4]])
    body = limber.scene_from_arrays(nodes, tets, frames=20, fixed_nodes=[0, 1, 2], modes=2, youngs_modulus=1e5)
    body.constraints.add(nodes=[3], frame=10, id=1).displacement.y = 0.25
    group = body.material_groups.add(tets=[1])
    group.material.youngs_modulus, group.material.poissons_ratio, group.material.density = 1e6, 0.2, 3000
    uploaded = scene_pb2.Scene(name="file", frames=20, fixed_nodes=[0, 1, 2])
    uploaded.mesh.file.name = "a.veg"
    uploaded.mesh.file.content = VEGA
    uploaded.mesh.file.companions["a.elastic"] = ELASTIC
    moving = scene_pb2.Scene()
    moving.CopyFrom(body)
    moving.base_motion.pc2 = pc2(5, 20)
    moving.surface.file.name, moving.surface.file.content = "a.obj", OBJ
    linkage = scene_pb2.Scene(name="linkage")
    linkage.linkage.lines.file.name, linkage.linkage.lines.file.content = "a.obj", LINES
    section = linkage.linkage.section
    section.rectangle.width = section.rectangle.height = 0.01
    beams = scene_pb2.Scene(name="beams")
    structure = beams.beams.structure
    structure.nodes.add().position.x = 0
    structure.nodes.add().position.x = 1
    section = structure.sections.add(young=1e9, poisson=0.3, density=100)
    section.tube.outer_radius, section.tube.inner_radius = 0.02, 0.01
    structure.elements.add(start=0, finish=1)
    structure.supports.add(node=0, fix_x=True, fix_y=True, fix_z=True, fix_rotation_x=True, fix_rotation_y=True,
                           fix_rotation_z=True)
    load = structure.loads.add(node=1)
    load.force.z = -1
    drawn = scene_pb2.Scene(name="lines")
    drawn.beams.structure.sections.add().CopyFrom(section)
    drawn.beams.structure.supports.add().CopyFrom(structure.supports[0])
    drawn.beams.lines.file.name, drawn.beams.lines.file.content = "a.ply", edge_ply()
    job = scene_pb2.Scene(name="job")
    job.beams.job.name, job.beams.job.content = "SimulationJob.json", JOB
    job.beams.job.companions["a.ply"] = edge_ply()
    full = scene_pb2.Scene()
    fill(full)
    return {"body": body, "uploaded": uploaded, "moving": moving, "linkage": linkage, "beams": beams, "lines": drawn,
            "job": job, "full": full}


def pc2(points, samples):
    return struct.pack("<12siiffi", b"POINTCACHE2\0", 1, points, 0.0, 1.0, samples) + bytes(12 * points * samples)


def edits():
    """One of each kind, all of its fields filled."""
    for field in service_pb2.Edit.DESCRIPTOR.oneofs_by_name["edit"].fields:
        if field.message_type is None or field.message_type.full_name.startswith("google."):
            continue
        edit = service_pb2.Edit()
        getattr(edit, field.name).SetInParent()
        fill(getattr(edit, field.name), 1)
        yield field.name, edit


def meshes():
    for path in sorted(DATA.iterdir()):
        if path.suffix == ".md" or path.name in ("tetgen.ele", "vtu_lzma.vtu"):
            continue
        content = path.name.encode() + b"\n" + path.read_bytes()
        if path.name == "tetgen.node":
            content += SEPARATOR + b"tetgen.ele\n" + (DATA / "tetgen.ele").read_bytes()
        yield path.name, content
    yield "vega", b"a.veg\n" + VEGA + SEPARATOR + b"more.veg\n*MATERIAL B\nENU, 1, 1, 0.1\n" + SEPARATOR + b"a.elastic\n" + ELASTIC
    yield "gmsh_1", b"a.msh\n$NOD\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$ENDNOD\n$ELM\n1\n1 4 1 1 4 1 2 3 4\n$ENDELM\n"
    yield "fixed", b"a.bou\n3\n1, 2,\n5\n"


def surfaces():
    yield "obj", b"sa.obj\n" + OBJ
    for kind in ("ascii", "binary_little_endian", "binary_big_endian"):
        yield "ply_" + kind, b"sa.ply\n" + ply(kind)
    yield "stl_ascii", b"sa.stl\n" + stl(False)
    yield "stl_binary", b"sa.stl\n" + stl(True)
    yield "off", b"sa.off\n" + off()
    for kind in ("triangles", "strip", "sparse"):
        yield "glb_" + kind, b"sa.glb\n" + glb(kind)
    yield "materials", b"m\n" + OBJ
    yield "lines", b"la.obj\n" + LINES
    yield "edges_obj", b"ea.obj\n" + LINES
    yield "edges_ply", b"ea.ply\n" + edge_ply()
    yield "pc2", b"c\n" + pc2(2, 3)
    yield "pvd", (b'p\n<?xml version="1.0"?><VTKFile type="Collection"><Collection><DataSet timestep="1" part="0" file="b.vtu"/>'
                  b'<DataSet timestep="0" file="a.vtu"/></Collection></VTKFile>')
    for name in ("vtu_ascii.vtu", "vtu_binary.vtu", "vtu_zlib.vtu"):
        yield "series_" + name, b"v\n" + SEPARATOR.join([(DATA / name).read_bytes()] * 3)
    yield "job", b"j\n" + JOB + SEPARATOR + b'{"initialDistortion":[0,0,1,0,0,0],"maxDRMIterations":100}'
    yield "client_lines", b"o\n" + LINES
    yield "stiffness_text", b"fa.txt\n# of four points\n1, 2.5\n1e3 4\n"
    yield "stiffness_groups", b'fa.json\n{"groups":{"tip":{"vertices":[0,3],"factor":2},"rest":{"vertices":[1],"youngs_modulus":1e6}}}'
    yield "stiffness_ply", b"fa.ply\n" + (b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float quality\n"
                                          b"end_header\n0 1\n1 2\n2 3\n3 4\n")


def jobs():
    settings = b'{"initialDistortion":{"load":[0,0,1,0,0,0]},"maxDRMIterations":100}'
    yield "job", JOB + SEPARATOR + b"a.ply\n" + edge_ply() + SEPARATOR + settings
    yield "lines", JOB.replace(b"a.ply", b"a.obj") + SEPARATOR + b"a.obj\n" + LINES
    yield "moved", JOB.replace(b'"forces":[[1,[0.0,0.0,5.0,0.0,0.0,0.0]]]', b'"forced displacements":[[2,[0.1,0,-0.2]],[1,[0,0,0]]]') + (
        SEPARATOR + b"a.ply\n" + edge_ply())


def files():
    for place, name, content in (("m", "a.veg", VEGA), ("m", "a.msh", (DATA / "gmsh_2_ascii.msh").read_bytes()), ("s", "a.obj", OBJ),
                                 ("k", "a.veg", VEGA), ("p", "a.pc2", pc2(4, 3)), ("l", "a.obj", LINES), ("e", "a.ply", edge_ply()),
                                 ("t", "a.stl", stl(True)), ("t", "a.ply", ply("binary_little_endian")), ("t", "a.off", off()), ("s", "a.glb", glb("triangles")), ("d", "a.obj", OBJ),
                                 ("c", "a.ply", ply("ascii")), ("a", "a.veg", VEGA)):
        yield f"{place}_{name}", place.encode() + name.encode() + b"\n" + content
    yield "f_text", b"fa.txt\n1 2.5 1e3 4"
    yield "j_job", b"jSimulationJob.json\n" + JOB + SEPARATOR + b"a.ply\n" + edge_ply()
    yield "b_vtu", b"b" + SEPARATOR.join([b"a.vtu\n" + (DATA / "vtu_ascii.vtu").read_bytes()] * 3)
    yield "m_elastic", b"ma.veg\n" + VEGA + SEPARATOR + b"a.elastic\n" + ELASTIC


def requests():
    for name, scene in scenes().items():
        request = service_pb2.Request(version=1, id=7, client="c")
        request.open_session.session = name
        request.open_session.scene.CopyFrom(scene)
        yield "open_" + name, request.SerializeToString()
    for name, edit in edits():
        request = service_pb2.Request(version=1, id=7)
        request.edit.session = "a"
        request.edit.edits.append(edit)
        yield "edit_" + name, request.SerializeToString()
    for field in service_pb2.Request.DESCRIPTOR.oneofs_by_name["body"].fields:
        request = service_pb2.Request(version=1, id=7)
        getattr(request, field.name).SetInParent()
        yield "empty_" + field.name, request.SerializeToString()


def texts():
    for name, scene in scenes().items():
        yield name + ".json", json_format.MessageToJson(scene, preserving_proto_field_name=name != "body", indent=1).encode()
    yield "structure.json", json_format.MessageToJson(scenes()["beams"].beams.structure, indent=None).encode()
    yield "odd.json", b'{"name": "\\u00e9\\ud83d\\ude00", "frames": 3e1, "fixedNodes": [1, 2,], "fixed_nodes": []}'


def checkpoints():
    """One of each kind, with a step of undo and one of redo."""
    def snapshots(one, other):
        history = stored_pb2.StoredSnapshots(undo_count=1, last_number=2)
        for message, before in ((one, False), (other, True), (other, True)):
            new = message.SerializeToString() if not before else b"\x0a\x00"
            kept = 2 if before else 0  # bytes of the one before
            history.snapshots.add(difference=bytes((kept, 0, len(new))) + new).step.number = 1
        return history

    linkage = scene_pb2.RodLinkage()
    linkage.conditions.mean_angle_degrees = 20
    linkage.conditions.pins.add(joint=0, held=scene_pb2.HELD_MOTION)
    yield "linkage", stored_pb2.StoredCheckpoint(
        revision=2, linkage=stored_pb2.StoredLinkage(history=snapshots(linkage, linkage), last_target=3, is_return=True))
    beams = beam_structure_pb2.BeamStructure()
    beams.supports.add(node=0, fix_x=True)
    beams.loads.add(node=1).force.z = -1
    yield "beams", stored_pb2.StoredCheckpoint(revision=2, beams=stored_pb2.StoredBeams(history=snapshots(beams, beams)))
    body = stored_pb2.StoredBody(next_constraint=3, next_keyframe=2, content=1, last_content=2)
    body.scene.constraints.add(id=1, frame=2, nodes=[3], weight=10).displacement.y = 1
    body.poses.add(type=2, shape=[1, 3], data=bytes(24))
    pose = stored_pb2.StoredKeyframe(pose=0)
    pose.keyframe.id, pose.keyframe.frame, pose.keyframe.weight = 1, 4, 2
    body.keyframes.add().CopyFrom(pose)
    step = body.undo.add(content=1)
    step.step.author, step.step.number = "one", 1
    step.changes.add(remove_constraint=1)
    step.changes.add(keyframe=pose)
    step.changes.add().move_constraint.id = 1
    body.redo.add().changes.add().fit.epoch = 1
    yield "body", stored_pb2.StoredCheckpoint(revision=2, body=body)


def crafted():
    """Sessions that nobody has exported: numbers that no server has counted to, or not given."""
    for name, checkpoint in checkpoints():
        checkpoint.revision = 2 ** 63 - 2
        yield "revision_" + name, checkpoint
    body = dict(checkpoints())["body"]
    for field in ("next_constraint", "next_keyframe", "last_content", "last_epoch", "last_number"):
        for number in (0, 2 ** 64 - 1):
            checkpoint = stored_pb2.StoredCheckpoint()
            checkpoint.CopyFrom(body)
            setattr(checkpoint.body, field, number)
            yield f"{field}_{'least' if number == 0 else 'most'}", checkpoint


def stored():
    for name, checkpoint in crafted():
        session = stored_pb2.StoredSession(version=2, session=name, uid=5, checkpoint=checkpoint)
        yield "crafted_" + name, b"x" + session.SerializeToString()
    for name, checkpoint in checkpoints():
        session = stored_pb2.StoredSession(version=2, session=name, uid=5, checkpoint=checkpoint)
        yield "checkpoint_" + name, b"x" + session.SerializeToString()
        yield "checkpoint_row_" + name, SEPARATOR.join([b"s5,2:", b"c5,2:" + checkpoint.SerializeToString()])
    all_edits = [edit for _, edit in edits()]
    for name, scene in scenes().items():
        session = stored_pb2.StoredSession(version=1, server_version="0.1.0", session=name, uid=5, kind="bodies")
        session.scene.CopyFrom(scene)
        for revision, edit in enumerate(all_edits[:6], 1):
            row = session.edits.add(revision=revision, client="c", at_ms=1)
            row.edits.append(edit)
        session.answer.revision, session.answer.sequence = 6, 10
        session.answer.start.name = "start"
        yield "export_" + name, b"x" + session.SerializeToString()
        rows = [b"s5,2:" + scene.SerializeToString()]
        rows += [b"e5,%d:" % row.revision + row.SerializeToString() for row in session.edits[:2]]
        rows += [b"a5,0:" + session.answer.SerializeToString(), b"r1,2:" + service_pb2.Reply(version=1).SerializeToString()]
        yield "rows_" + name, SEPARATOR.join(rows)
        yield "sealed_rows_" + name, SEPARATOR.join(row[:1].upper() + row[1:] for row in rows)


def models():
    def matrix(rows, columns):
        return struct.pack("<QQ", rows, columns) + struct.pack("<d", 0.5) * (rows * columns)

    def model(nodes, rigid, modes, basis, tets):
        report = bytes(8 * 8) + struct.pack("<Bii", 1, 1, 4) + struct.pack("<Bd", 1, 0.25) * 2 + struct.pack("<Q", 3) + b"met"
        return (struct.pack("<idii", nodes, 2.0, rigid, 0) + matrix(modes, 1) + matrix(3 * nodes, modes) +
                matrix(3 * nodes, basis) + struct.pack("<Q", tets) + struct.pack("<i", 1) * tets + matrix(9 * tets, modes) +
                matrix(basis, 9 * tets) + matrix(basis, modes) + report)

    yield "held", model(2, 0, 2, 3, 1)
    yield "free", model(1, 6, 7, 3, 1)
    yield "no_basis", model(1, 0, 1, 0, 0)
    yield "damaged", b"limberRS" + struct.pack("<IQ", 8, 3) + b"abc" + bytes(16)


KEY = b"rq:rM>}U?@Lns47E1%kR.o@n%FcmmsL/@{H8]yf7"
OTHER_KEY = b"Yne@$w-vo<fVvi]a<NY6T1ed:M$fCG*[IaLV{hID"


def settings():
    yield "config", (b'c# A studio\nbind = "tcp://*:5555"  # all\nthreads = 4\ndrain-seconds = 2.5e1\nno-cache = true\n'
                     b'web-host = ["studio", \'10.0.0.7\', # two\n]\n')
    yield "config_escapes", b'cbind = "a\\"b\\\\c\\n\\t"\r\nthreads = +1_0\nweb-host = []\n'
    yield "keys", (b"a# who may connect\n" + KEY + b" administer anna@studio # since May\n\n" + OTHER_KEY + b"\tview\r\n")
    yield "key", b"k" + KEY + b"\n"
    yield "token", b"t0123456789abcdefABCDEF-_\r\nmore"
    for name, lines in {
            "page": ["GET", "/v1/requests?a=b&token=0123456789abcdef", "127.0.0.1:8080", "http://127.0.0.1:8080", "127.0.0.1", "u"],
            "stream": ["GET", "/v1/stream?token=wrong", "studio:80", "https://STUDIO:80", "10.0.0.7", "u"],
            "file": ["HEAD", "/index.html?x", "[::1]:8080", "", "::1", ""],
            "probe": ["GET", "/metrics", "10.0.0.7", "", "10.0.0.7", ""]}.items():
        yield "head_" + name, b"d" + "\n".join(lines).encode()
    yield "session", b"nbeam-2@2147483649000001"
    for name in ("tcp://127.0.0.1:5555", "tcp://[::1]:*", "tcp://*:0", "ipc:///tmp/limber", "localhost:8080", "http://a.b:1"):
        yield "endpoint_" + name.translate({ord(c): "_" for c in ":/*[]"}), b"e" + name.encode()


def array(kind, shape, data):
    return common_pb2.Array(type=kind, shape=shape, data=data)


def frames():
    def numbers(count):
        return struct.pack(f"<{count}f", *(i / 8 for i in range(count)))

    floats, levels = common_pb2.DATA_TYPE_FLOAT32, common_pb2.DATA_TYPE_UINT16
    geometry = service_pb2.GetGeometryResponse(rest=array(floats, [2, 3], numbers(6)), basis=array(floats, [2, 3, 2], numbers(12)),
                                               basis_hash="b").SerializeToString()
    coordinates = service_pb2.Frames(encoding=service_pb2.ENCODING_COORDINATES, frame_count=3, basis_hash="b",
                                     data=array(floats, [3, 2], numbers(6)))
    positions = service_pb2.Frames(encoding=service_pb2.ENCODING_POSITIONS, frame_count=1, data=array(floats, [1, 2, 3], numbers(6)))
    quantised = service_pb2.Frames(encoding=service_pb2.ENCODING_POSITIONS_QUANTISED, frame_count=1,
                                   data=array(levels, [1, 2, 3], bytes(range(12))))
    quantised.extent.x = quantised.origin.y = 2
    for name, message in {"coordinates": coordinates, "positions": positions, "quantised": quantised}.items():
        yield name, b"f" + message.SerializeToString() + SEPARATOR + geometry
    coordinates.result.sequence = 4
    motion = [coordinates.SerializeToString()]
    for sequence, base, first, part, more, early in ((0, 4, 1, 0, False, True), (5, 4, 0, 0, True, False), (5, 4, 2, 1, False, False),
                                                     (6, 0, 0, 0, False, False)):
        change = service_pb2.Frames(first_frame=first, frame_count=1, data=array(floats, [1, 2], numbers(2)))
        change.result.sequence = sequence
        change.changes.motion_frames, change.changes.base_sequence, change.changes.part = 3, base, part
        change.changes.more, change.changes.early = more, early
        motion.append(change.SerializeToString())
    yield "changes", b"m" + SEPARATOR.join(motion)
    yield "quantise", b"q\x01" + numbers(12)
    text = bytes(range(64))
    yield "difference", b"d" + text + SEPARATOR + text[:20] + b"new" + text[16:]
    yield "no_difference", b"x" + text + SEPARATOR + bytes((20, 0, 3)) + b"new" + bytes((48, 16, 0))


def streams():
    yield "full", b"b" + bytes((5, 1, 2, 10, 20, 0, 2, 4, 1, 0, 3, 200, 200, 200, 1, 0, 0, 3, 200, 200, 200, 1, 6, 2, 199, 5, 2, 1, 30, 0, 3))
    yield "one", b"b" + bytes((0, 1, 2, 10, 20, 0, 0, 2, 3, 1, 2, 3, 1, 2, 0, 3, 255, 9, 4, 70, 0, 0, 1, 200, 2))
    request = follow_pb2.FollowRequest(stream="s", read_bytes=7, window_bytes=100000, instance="run")
    request.topics.add(prefix="a", after=1)
    request.topics.add(prefix="b")
    follow = request.SerializeToString()
    publish = bytes((3, 1, 2, 10, 20, 0))
    yield "clients", (b"s" + bytes((0, 1, 3)) + b"\x01ab" + bytes((1, 0, len(follow))) + follow + publish + bytes((2, 4)) + publish +
                      bytes((1, 1, len(follow))) + follow + bytes((0, 1, 3)) + b"\x00ab" + bytes((2, 0)))
    in_vain = bytes((4, 0, 1, 3, 200, 200, 200, 1))
    yield "proxied", b"s" + bytes((1, 4, len(follow))) + follow + bytes((1, 9, len(follow))) + follow + in_vain + in_vain + bytes((5, 1)) + publish


def main():
    for target, inputs in {"meshes": meshes, "surfaces": surfaces, "jobs": jobs, "files": files, "requests": requests, "scenes": texts, "stored": stored,
                           "models": models, "settings": settings, "frames": frames, "streams": streams}.items():
        folder = HERE / "corpus" / target
        folder.mkdir(parents=True, exist_ok=True)
        for old in folder.iterdir():
            old.unlink()
        total = 0
        for name, content in inputs():
            (folder / name).write_bytes(content)
            total += len(content)
        print(f"{target}: {len(list(folder.iterdir()))} inputs, {total} bytes")


if __name__ == "__main__":
    main()
