"""Long answers that come in parts, as the client asks for them."""

import limber
import pytest
from limber import reply_parts
from limber.errors import LimberError
from limber.v1 import common_pb2 as common
from limber.v1 import parts_pb2 as parts
from limber.v1 import service_pb2 as service

pytestmark = pytest.mark.timeout(30)
BASIS = b"b" * (1 << 20)


class Geometries:
    """A long geometry, in parts where they are asked for."""

    def __init__(self, server):
        self.asked, self.whole = [], b""
        self.is_older, self.gone, self.shifted = False, 0, 0
        server.handlers |= {"get_geometry": self.geometry, "get_reply_part": self.next_part}

    def reply(self, request, **body):
        return service.Reply(version=1, id=request.id, instance="run", **body)

    def geometry(self, request):
        self.asked.append(request)
        if self.is_older and request.most_reply_bytes:
            return self.reply(request, error=common.Error(code=common.ERROR_CODE_INVALID_ARGUMENT,
                                                          message="unknown field number 6 in Request; this server ..."))
        answer = service.GetGeometryResponse(basis_hash="h")
        answer.basis.data = BASIS
        reply = self.reply(request, get_geometry=answer)
        if not request.most_reply_bytes:
            return reply
        self.whole = reply.SerializeToString()
        return self.reply(request, get_reply_part=self.part(0, request.most_reply_bytes))

    def next_part(self, request):
        self.asked.append(request)
        if self.gone:
            self.gone -= 1
            return self.reply(request, error=common.Error(code=common.ERROR_CODE_FAILED_PRECONDITION, field="reply"))
        wanted = request.get_reply_part
        return self.reply(request, get_reply_part=self.part(wanted.offset + self.shifted, wanted.most_bytes))

    def part(self, offset, most):
        return parts.GetReplyPartResponse(reply=7, total_bytes=len(self.whole), offset=offset,
                                          data=self.whole[offset:offset + most])


@pytest.fixture
def geometries(fake):
    return Geometries(fake)


@pytest.fixture
def connection(fake, geometries):
    with limber.connect(fake.requests) as server:
        yield server.connection


def fetched(connection):
    answer = connection.call("get_geometry", service.GetGeometryRequest(session="s@1"))
    assert answer.basis_hash == "h"
    return answer.basis.data


def test_parts_are_put_together(connection, geometries):
    assert fetched(connection) == BASIS
    at = geometries.asked[0].most_reply_bytes
    assert len(geometries.asked) > 3
    for request in geometries.asked[1:]:
        assert (request.get_reply_part.reply, request.get_reply_part.offset) == (7, at)
        at += request.get_reply_part.most_bytes


def test_they_are_asked_for_anew_where_the_server_has_them_no_more(connection, geometries):
    geometries.gone = 2
    assert fetched(connection) == BASIS
    geometries.asked.clear()
    geometries.gone = 100
    assert fetched(connection) == BASIS  # in one, in the end
    assert len(geometries.asked) == 7


def test_an_older_server_is_not_asked_for_them_again(connection, geometries):
    geometries.is_older = True
    assert fetched(connection) == BASIS
    assert fetched(connection) == BASIS
    assert [bool(request.most_reply_bytes) for request in geometries.asked] == [True, False, False]


def test_parts_of_a_server_that_lies_are_refused(connection, geometries):
    geometries.shifted = 1
    with pytest.raises(LimberError, match="not the next one"):
        fetched(connection)


def test_frames_that_are_divided_by_themselves_are_not_divided_again():
    assert reply_parts.may_be_long("get_frames", service.GetFramesRequest())
    assert not reply_parts.may_be_long("get_frames", service.GetFramesRequest(most_bytes=1))
    assert not reply_parts.may_be_long("edit", service.EditRequest())
