"""Clients of other versions than the server: which side is to be updated, and that nothing is half done."""

import limber
import pytest
import zmq
from limber.v1 import common_pb2 as common
from limber.v1 import service_pb2 as service


def field(number, data):
    """A field of bytes, or of a number, as a message of any version may have it."""
    assert number < 1024
    is_number = isinstance(data, int)
    tag = number << 3 | (0 if is_number else 2)
    tag_bytes = bytes([tag]) if tag < 128 else bytes([tag & 0x7f | 0x80, tag >> 7])
    assert (data if is_number else len(data)) < 128
    return tag_bytes + (bytes([data]) if is_number else bytes([len(data)]) + data)


EDIT, EDITS, INFO = 15, 2, 10  # of Request, of EditRequest, of Request


def envelope(id):
    return service.Request(version=1, id=id).SerializeToString()


@pytest.fixture
def ask(server):
    """Sends bytes as they are."""
    with zmq.Context() as context, context.socket(zmq.DEALER) as socket:
        socket.linger = 0
        socket.connect(server.connection.endpoint)

        def answer(data):
            socket.send(data)
            assert socket.poll(20_000), "no answer"
            return service.Reply.FromString(socket.recv_multipart()[-1])

        yield answer


def test_a_client_of_a_later_protocol(server, monkeypatch):
    monkeypatch.setattr(limber.connection, "PROTOCOL", 2)
    version = limber.__version__
    with pytest.raises(limber.LimberError) as caught:
        limber.connect(server.connection.endpoint)
    assert caught.value.message == f"this client speaks protocol 2, this server ({version}) protocol 1: update the server"
    assert caught.value.code == "UNSUPPORTED" and caught.value.field == "version"
    assert caught.value.details == {"version": "2", "supported": "1", "server_version": version}


def test_requests_and_edits_of_later_kinds_are_not_passed_over(session, ask):
    reply = ask(envelope(1) + field(63, b""))
    assert reply.error.code == common.ERROR_CODE_UNSUPPORTED and reply.id == 1
    assert f"this server ({limber.__version__}) does not know requests of number 63: update the server" in reply.error.message
    known = service.EditRequest(session=session.id, edits=[service.Edit(undo=service.Undo())]).SerializeToString()
    reply = ask(envelope(2) + field(EDIT, known + field(EDITS, field(40, b""))))
    assert reply.error.code == common.ERROR_CODE_UNSUPPORTED and reply.error.field == "edits[1]"
    assert "does not know edits of number 40: update the server" in reply.error.message
    assert session.status().revision == 0, "the edit before it was not made either"


@pytest.mark.parametrize("edit, place", [
    (field(9, field(1, 99)), "edits[0].set_material.variables"),  # a value of its enum
    (field(9, field(1, 1) + field(7, 1)), "edits[0].set_material"),  # a member of a known edit
    (field(2, field(1, 1) + field(99, b"by hand")), "edits[0].move"),
])
def test_fields_and_values_of_later_versions_are_refused(session, ask, edit, place):
    named = service.EditRequest(session=session.id).SerializeToString()
    reply = ask(envelope(3) + field(EDIT, named + field(EDITS, edit)))
    assert reply.error.code == common.ERROR_CODE_INVALID_ARGUMENT and reply.error.field == place, reply
    assert f"this server ({limber.__version__}) does not know it: update the server" in reply.error.message
    assert session.status().revision == 0


def test_the_first_request_may_say_more_than_the_server_knows(ask):
    told = service.GetServerInfoRequest(client_version="9.0.0").SerializeToString()
    assert ask(envelope(4) + field(INFO, told + field(50, b"more") + field(51, 1))).get_server_info.protocol_versions == [1]
    long = service.GetServerInfoRequest(client_version="9" * 65).SerializeToString()
    assert ask(envelope(5) + field(INFO, long)).error.field == "client_version"
