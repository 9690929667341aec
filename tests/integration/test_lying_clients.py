"""Bytes that are no messages, messages that lie: an answer or silence, never harm."""

import random
import struct

import limber
import numpy as np
import pytest
import zmq
from conftest import small_scene, tip_of
from limber import arrays
from limber.v1 import common_pb2 as common
from limber.v1 import scene_pb2 as scene_messages
from limber.v1 import service_pb2 as service


class Raw:
    """A DEALER without manners."""

    def __init__(self, endpoint):
        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.DEALER)
        self._socket.linger = 0
        self._socket.connect(endpoint)

    def send(self, *parts):
        self._socket.send_multipart(list(parts))

    def ask(self, *parts, timeout=5.0):
        self.send(*parts)
        return self.reply(timeout)

    def reply(self, timeout=5.0):
        assert self._socket.poll(int(1000 * timeout)), "no reply"
        return service.Reply.FromString(self._socket.recv_multipart()[-1])

    def close(self):
        self._context.destroy(linger=0)


@pytest.fixture
def raw(server):
    client = Raw(server.connection.endpoint)
    yield client
    client.close()
    assert server.info().protocol_versions == [1], "the server still answers"


@pytest.mark.parametrize("data", [b"", b"\x00", b"\xff" * 100, b"GET / HTTP/1.1\r\n\r\n", b"\x08", b"\x0a\xff\xff\xff\x7f"],
                         ids=["empty", "zero", "ff", "http", "cut", "huge-length"])
def test_garbage_is_answered_as_malformed(raw, data):
    assert raw.ask(data).error.code in (common.ERROR_CODE_MALFORMED, common.ERROR_CODE_UNSUPPORTED)


@pytest.mark.parametrize("version", [0, 2, 2 ** 32 - 1])
def test_another_version_is_named(raw, version):
    message = service.Request(version=version, id=31)
    message.get_server_info.SetInParent()
    reply = raw.ask(message.SerializeToString())
    assert reply.id == 31
    assert reply.error.code == common.ERROR_CODE_UNSUPPORTED and "version" in reply.error.field + reply.error.message


def test_a_body_of_the_future_is_refused(raw):
    # Field 900, length-delimited, empty: a request this server cannot know.
    future = service.Request(version=1, id=32).SerializeToString() + b"\xa2\x38\x00"
    reply = raw.ask(future)
    assert reply.id == 32
    assert reply.error.code in (common.ERROR_CODE_MALFORMED, common.ERROR_CODE_UNSUPPORTED,
                                common.ERROR_CODE_INVALID_ARGUMENT)
    assert "900" in reply.error.message + reply.error.field


def test_truncated_messages(raw, server):
    full = service.Request(version=1, id=9)
    full.open_session.scene.CopyFrom(small_scene())
    data = full.SerializeToString()
    generator = random.Random(7)
    cuts = sorted({generator.randrange(1, len(data)) for _ in range(50)})
    before = len(server.sessions())
    for cut in cuts:
        assert raw.ask(data[:cut], timeout=20).WhichOneof("body") == "error"
    assert len(server.sessions()) == before


def test_flipped_bytes_never_hurt(raw, server, session):
    """Any outcome is fine as long as each message is answered and this session and the server are well."""
    message = service.Request(version=1, id=9)
    message.edit.session = session.id
    for edit in (limber.add(node=1, frame=3, position=(1, 2, 3)), limber.move(1, (0, 0, 0)), limber.ends("free", "free")):
        message.edit.edits.append(edit)
    data = message.SerializeToString()
    generator = random.Random(11)
    for _ in range(300):
        spoilt = bytearray(data)
        for _ in range(generator.randrange(1, 4)):
            spoilt[generator.randrange(len(spoilt))] = generator.randrange(256)
        raw.send(bytes(spoilt))
    for _ in range(300):
        assert raw.reply(20).WhichOneof("body")
    status = session.status()
    assert status.state == service.SESSION_STATE_READY
    assert np.isfinite(session.frames()).all()


def test_envelopes_with_too_many_parts(raw):
    raw.send(b"", b"", b"", b"x")
    raw.send(*[b"y"] * 50)
    message = service.Request(version=1, id=77)
    message.get_server_info.SetInParent()
    raw.send(b"", message.SerializeToString())  # as a REQ socket frames it
    for _ in range(100):
        reply = raw.reply()
        if reply.id == 77:
            break
    assert reply.WhichOneof("body") == "get_server_info"


def test_an_oversized_message_is_refused_and_the_rest_continues(launch):
    """Beyond the limit a message is refused by name; beyond twice the limit the connection is cut."""
    server = launch("--max-message-bytes", "1000000")
    large = service.Request(version=1, id=41)
    large.open_session.session = "large"
    large.open_session.scene.name = "x" * 1_500_000
    raw, other = Raw(server.connection.endpoint), Raw(server.connection.endpoint)
    try:
        reply = raw.ask(large.SerializeToString())
        assert reply.id == 41 and reply.error.code == common.ERROR_CODE_LIMIT_EXCEEDED
        assert reply.error.details["limit"] == "1000000" and int(reply.error.details["value"]) > 1_500_000
        other.send(b"\x00" * 5_000_000)
        with pytest.raises(AssertionError, match="no reply"):
            other.reply(0.5)
        small = service.Request(version=1, id=42)
        small.get_server_info.SetInParent()
        reply = raw.ask(small.SerializeToString())
        assert reply.id == 42 and reply.get_server_info.limits.message_bytes == 1_000_000
    finally:
        raw.close()
        other.close()


def bad_constraints():
    yield "nan", {"node": 1, "frame": 3, "position": (float("nan"), 0, 0)}, "INVALID_ARGUMENT", "position.x"
    yield "infinite", {"node": 1, "frame": 3, "displacement": (0, float("inf"), 0)}, "INVALID_ARGUMENT", "displacement.y"
    yield "node", {"node": 10 ** 6, "frame": 3, "position": (0, 0, 0)}, "OUT_OF_RANGE", "nodes[0]"
    yield "frame", {"node": 1, "frame": 60, "position": (0, 0, 0)}, "OUT_OF_RANGE", "frame"
    yield "no nodes", {"nodes": [], "frame": 3, "position": (0, 0, 0)}, "INVALID_ARGUMENT", "nodes"
    yield "weight", {"node": 1, "frame": 3, "position": (0, 0, 0), "weight": -1.0}, "INVALID_ARGUMENT", "weight"
    yield "nan weight", {"node": 1, "frame": 3, "position": (0, 0, 0), "weight": float("nan")}, "INVALID_ARGUMENT", "weight"


@pytest.mark.parametrize("what, code, field", [pytest.param(w, c, f, id=name) for name, w, c, f in bad_constraints()])
def test_bad_constraints_leave_the_session_as_it_was(session, what, code, field):
    session.add(node=tip_of(session), frame=30, displacement=(0, 0, 0.1))
    before = session.wait()
    with pytest.raises(limber.LimberError) as caught:
        session.edit([limber.undo(), limber.add(**what)])
    assert (caught.value.code, caught.value.field) == (code, f"edits[1].add.constraint.{field}")
    assert session.status().revision == 1
    assert session.wait().energy == before.energy


def bad_scenes():
    def case(name, field, change, code="INVALID_ARGUMENT"):
        return pytest.param(field, code, change, id=name)

    yield case("no frames", "frames", lambda s: setattr(s, "frames", 0))
    yield case("two frames", "frames", lambda s: setattr(s, "frames", 2))
    yield case("more frames than allowed", "frames", lambda s: setattr(s, "frames", 2 ** 31), "LIMIT_EXCEEDED")
    yield case("no modes", "model.modes", lambda s: setattr(s.model, "modes", 0))
    yield case("no mesh", "mesh", lambda s: s.ClearField("mesh"))
    yield case("no tets", "mesh.tets",
               lambda s: s.mesh.arrays.tets.CopyFrom(arrays.to_message(np.zeros((0, 4)), np.int32)))
    yield case("nan node", "mesh.arrays.nodes.data[0]", lambda s: spoil_node(s, float("nan")))
    yield case("flat tet", "mesh.tets[0]",
               lambda s: s.mesh.arrays.tets.CopyFrom(arrays.to_message([[0, 1, 2, 2]], np.int32)))
    yield case("shape that lies", "mesh.arrays.nodes.data", lambda s: s.mesh.arrays.nodes.shape.__setitem__(0, 2 ** 40))
    yield case("a file the client may not name", "mesh.path", lambda s: setattr(s.mesh, "path", "/etc/passwd"), "NOT_FOUND")
    yield case("no such sample", "mesh.sample", lambda s: setattr(s.mesh, "sample", "unicorn"), "NOT_FOUND")
    yield case("no mesh file", "mesh.file",
               lambda s: s.mesh.file.CopyFrom(scene_messages.MeshFile(name="a.msh", content=b"x")))
    yield case("incompressible", "material.poissons_ratio", lambda s: setattr(s.material, "poissons_ratio", 0.5))
    yield case("softer than nothing", "material.youngs_modulus", lambda s: setattr(s.material, "youngs_modulus", -1.0))
    yield case("unit of length", "length_unit_in_metres", lambda s: setattr(s, "length_unit_in_metres", 0.0))
    yield case("fps", "dynamics.frames_per_second", lambda s: setattr(s.dynamics, "frames_per_second", float("nan")))
    yield case("damping", "dynamics.damping_ratio", lambda s: setattr(s.dynamics, "damping_ratio", 1.5))


def spoil_node(scene, value):
    data = bytearray(scene.mesh.arrays.nodes.data)
    data[:8] = struct.pack("<d", value)
    scene.mesh.arrays.nodes.data = bytes(data)


@pytest.mark.parametrize("field, code, change", bad_scenes())
def test_bad_scenes_are_refused_with_their_field(server, field, code, change):
    scene = small_scene()
    change(scene)
    before = {status.session for status in server.sessions()}
    with pytest.raises(limber.LimberError) as caught:
        server.connection.call("open_session", service.OpenSessionRequest(scene=scene))
    assert (caught.value.code, caught.value.field.removeprefix("open_session.")) == (code, f"scene.{field}"), caught.value
    assert {status.session for status in server.sessions()} == before
    try:
        issues = server.connection.call("validate_scene", service.ValidateSceneRequest(scene=scene)).issues
    except limber.LimberError as error:  # what is wrong on the wire already, such as NaN, is refused
        assert (error.code, error.field) == (code, f"scene.{field}")
    else:
        assert [(limber.errors.code_name(issue.code), issue.field) for issue in issues
                if issue.severity == common.Issue.SEVERITY_ERROR][0] == (code, f"scene.{field}")


@pytest.mark.parametrize("name", [".", "..", "../x", "a b", "x" * 65, "ä", "a/b"])
def test_session_names(server, name):
    with pytest.raises(limber.LimberError) as caught:
        server.connection.call("open_session", service.OpenSessionRequest(scene=small_scene(), session=name))
    assert caught.value.field == "session"


def bad_requests():
    def of(kind, **fields):
        return kind, fields

    yield pytest.param(*of("get_frames", first_frame=60), "first_frame", id="first frame")
    yield pytest.param(*of("get_frames", first_frame=50, frame_count=11), "frame_count", id="frame count")
    yield pytest.param(*of("get_frames", first_frame=2 ** 32 - 1, frame_count=2 ** 32 - 1), "first_frame", id="overflow")
    yield pytest.param(*of("get_frames", encoding=99), "encoding", id="encoding")
    yield pytest.param(*of("wait", timeout_s=float("nan")), "timeout_s", id="nan wait")
    yield pytest.param(*of("wait", timeout_s=-1.0), "timeout_s", id="negative wait")
    yield pytest.param(*of("export", format=service.EXPORT_FORMAT_PVD, stem="../evil"), "stem", id="stem")
    yield pytest.param(*of("export", format=99), "format", id="format")


@pytest.mark.parametrize("kind, fields, field", bad_requests())
def test_bad_requests_name_their_field(session, raw, kind, fields, field):
    message = service.Request(version=1, id=5)
    body = getattr(message, kind)
    body.session = session.id
    for name, value in fields.items():
        setattr(body, name, value)
    reply = raw.ask(message.SerializeToString())
    assert reply.id == 5
    assert reply.error.code in (common.ERROR_CODE_INVALID_ARGUMENT, common.ERROR_CODE_OUT_OF_RANGE)
    assert reply.error.field.removeprefix(f"{kind}.") == field


def test_parts_of_an_export_that_are_not_there(session):
    begin = service.ExportRequest(session=session.id, format=service.EXPORT_FORMAT_PVD)
    with pytest.raises(limber.LimberError) as caught:
        session.connection.call("export", service.ExportRequest(session=session.id, format=begin.format, part=1))
    assert caught.value.code == "FAILED_PRECONDITION"
    begun = session.connection.call("export", begin)
    for part, sequence, field in ((begun.part_count, begun.result.sequence, "part"), (10 ** 6, begun.result.sequence, "part"),
                                  (0xffffffff, 0, "part"), (1, 10 ** 6, "result_sequence")):
        request = service.ExportRequest(session=session.id, format=begin.format, part=part, result_sequence=sequence)
        with pytest.raises(limber.LimberError) as caught:
            session.connection.call("export", request)
        assert caught.value.field == field and caught.value.code != "INTERNAL"
