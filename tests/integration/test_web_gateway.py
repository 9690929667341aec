"""limberd --web: pages are clients as others are, and nobody else comes in."""

import contextlib
import json
import signal
import socket
import stat
import struct
import subprocess
import zlib

import limber
import pytest
from conftest import small_scene, tip_of
from limber.v1 import access_pb2 as access
from limber.v1 import common_pb2 as common
from limber.v1 import service_pb2 as service
from pages import BINARY, CLOSE, PING, PONG, TEXT, UPGRADE, Closed, Page, Socket, ask, connect, eventually, head, \
    read_answer, ready_file

WEB = ("--web", "127.0.0.1:0")


@pytest.fixture(scope="module")
def server(limberd, cache_dir):
    """As conftest's, with pages."""
    with limber.launch(limberd, cache_dir=cache_dir, arguments=WEB) as running:
        yield running
        assert running.process.poll() is None, "limberd died: " + running.log


@pytest.fixture
def page(server):
    with Page(server) as opened:
        yield opened


def listing(number):
    request = service.Request(version=1, id=number)
    request.list_jobs.SetInParent()
    return request


def counters(server):
    return dict(server.info().counters)


# --- One protocol


def test_a_page_opens_edits_and_sees_the_frames(page):
    names = page.ask(get_sample={}).get_sample.names
    assert "beam" in names
    page.subscribe("session/page")
    opened = page.ask(open_session={"scene": small_scene(), "session": "page"})
    assert opened.open_session.session == "page", opened
    assert page.ask(wait={"session": "page", "timeout_s": 20}).wait.result.converged
    edit = page.ask(edit={"session": "page", "edits": [{"undo": {}}]})
    assert edit.error.code == common.ERROR_CODE_FAILED_PRECONDITION
    topics = set()
    while not {"session/page/status", "session/page/body/0/coordinates"} <= topics:
        topic, message = page.message()
        assert message.session == "page" and message.instance == opened.instance
        topics.add(topic)
    assert page.ask(close_session={"session": "page"}).HasField("close_session")


def test_edits_of_a_page_and_of_others_are_one_session(page, session):
    page.subscribe(f"session/{session.id}/body/0/coordinates")
    newest = page.message()[1].frames
    assert newest.result.revision == 0 and newest.result.converged
    held = session.add(node=tip_of(session), frame=30, displacement=(0, 0.1, 0))
    while not (newest.result.revision == 1 and newest.result.converged):
        newest = page.message()[1].frames
    assert page.ask(get_session={"session": session.id}).get_session.status.revision == 1
    undone = page.ask(edit={"session": session.id, "edits": [{"undo": {}}]})
    assert undone.edit.revision == 2
    with pytest.raises(limber.LimberError):
        held.move((0, 0.2, 0))
    page.unsubscribe(f"session/{session.id}/body/0/coordinates")


def test_replies_are_those_of_the_other_socket(page, server):
    import zmq
    with zmq.Context() as context, context.socket(zmq.DEALER) as dealer:
        dealer.linger = 0
        dealer.connect(ready_file(server)["requests"])
        for body in ({"list_jobs": {}}, {"get_sample": {"name": "flower"}}, {"get_session": {"session": "nobody"}},
                     {"wait": {"session": "a b"}}):
            request = page.request(**body).SerializeToString()
            page.requests.send(request)
            dealer.send(request)
            assert dealer.poll(20000)
            assert page.requests.receive() == dealer.recv()


def test_a_request_may_come_in_pieces(page):
    data = page.request(get_sample={"name": "flower"}).SerializeToString()
    page.requests.send(data[:3], BINARY, last=False)
    page.requests.send(b"are you there", PING)
    page.requests.send(data[3:4], 0, last=False)
    page.requests.send(b"", 0, last=False)
    page.requests.send(data[4:], 0)
    assert page.requests.frame() == (PONG, b"are you there")
    assert page.reply().HasField("get_sample")


def test_many_requests_are_all_answered_in_order(page):
    ids = [page.send(list_sessions={}) for _ in range(3000)]
    assert [page.reply().id for _ in ids] == ids


def test_a_repeated_request_is_done_once(page, server):
    request = page.request(open_session={"scene": small_scene(), "session": "once"})
    request.client = "0123456789abcdef"
    data = request.SerializeToString()
    page.requests.send(data)
    first = page.requests.receive()
    with Page(server) as again:
        again.requests.send(data)
        assert again.requests.receive() == first
    assert page.ask(close_session={"session": "once"}).HasField("close_session")


def test_a_thousand_may_be_unanswered(server, session):
    # Several times: a page was not read on where it was full for a moment, one time in ten.
    for _ in range(10):
        with Page(server) as page:
            for _ in range(1000):
                page.send(wait={"session": session.id, "revision": 99, "timeout_s": 60})
            refused = page.send(wait={"session": session.id, "revision": 99, "timeout_s": 60})
            reply = page.reply()
            assert (reply.id, reply.error.code, reply.error.field) == (refused, common.ERROR_CODE_LIMIT_EXCEEDED, "body")


def test_the_end_of_a_page_releases_its_waits(server, session):
    before = counters(server)
    for ending in ("close", "reset", "word"):
        page = Page(server)
        for _ in range(50):
            page.send(wait={"session": session.id, "revision": 99, "timeout_s": 60})
        assert eventually(lambda: counters(server)["open_requests"] >= 50)
        if ending == "reset":
            page.requests.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        if ending == "word":
            page.requests.send(struct.pack(">H", 1000), CLOSE)
            with pytest.raises(Closed) as closed:
                page.requests.receive()
            assert closed.value.code == 1000
        page.close()
        assert eventually(lambda: counters(server)["open_requests"] <= 1), ending
    assert counters(server)["dropped_replies"] - before["dropped_replies"] == 150
    assert eventually(lambda: counters(server)["web_connections"] == before["web_connections"])


# --- Who comes in


def test_the_token_is_told_to_those_who_may_do_all_anyway(server, page):
    ready = ready_file(server)
    assert stat.S_IMODE((server.folder / "ready").stat().st_mode) == 0o600
    assert len(ready["web_token"]) == 32
    info = server.info()
    assert (info.web, info.web_token) == (ready["web"], ready["web_token"])
    of_page = page.ask(get_server_info={}).get_server_info
    assert (of_page.web, of_page.web_token) == (ready["web"], "")


def test_without_web_nothing_listens(launch):
    plain = launch()
    assert set(ready_file(plain)) == {"requests", "stream", "pid", "instance"}
    assert (plain.info().web, plain.info().web_token) == ("", "")


@pytest.mark.parametrize("status, change", [
    (401, {"query": ""}), (401, {"query": "?token=" + 32 * "0"}), (401, {"query": "?token="}),
    (403, {"Origin": "http://evil.example"}), (403, {"Origin": "null"}), (403, {"Origin": "http://localhost:1"}),
    (403, {"Origin": ["http://{host}", "http://evil.example"]}),
    (403, {"Host": "evil.example"}), (403, {"Host": None}), (403, {"Host": ["{host}", "{host}"]}),
    (403, {"Host": "192.168.1.1:8080"}),
    (405, {"method": "POST"}), (426, {"Upgrade": None}), (404, {"path": "/v1/other"}), (404, {"path": "/"}),
    (400, {"Sec_WebSocket_Key": None}), (426, {"Sec_WebSocket_Version": "12"}),
], ids=str)
@pytest.mark.parametrize("path", ["/v1/requests", "/v1/stream"])
def test_others_are_refused(server, page, path, status, change):
    change = {name: [one.format(host=page.address) for one in value] if isinstance(value, list) else value
              for name, value in change.items()}
    query = change.pop("query", f"?token={page.token}")
    fields = UPGRADE | {"Origin": f"http://{page.address}"} | change
    before = counters(server)
    target, method = fields.pop("path", path) + query, fields.pop("method", "GET")
    with connect(page.address) as connection:
        connection.sendall(head(page.address, target, method, **fields))
        answer, answered, _ = read_answer(connection)
    assert answer == status
    assert "upgrade" not in answered or status == 426
    after = counters(server)
    assert after["web_refused"] - before["web_refused"] == (status in (401, 403))
    assert after["web_connections"] == 2, "the fixture's"


def test_a_page_can_ask_whether_its_token_is_right(page):
    own = {"Origin": f"http://{page.address}"}
    assert ask(page.address, f"/v1/requests?token={page.token}", **own)[0] == 426
    status, fields, body = ask(page.address, "/v1/requests?token=old", **own)
    assert status == 401 and b"limber web" in body and fields["content-type"].startswith("text/plain")


@pytest.mark.parametrize("target", ["/", "/missing", "/v1/requests", "/?token=x"])
def test_every_answer_is_guarded(page, target):
    _, fields, _ = ask(page.address, target)
    policy = fields["content-security-policy"]
    assert "default-src 'self'" in policy and "unsafe" not in policy and "frame-ancestors 'self'" in policy
    assert f"connect-src 'self' ws://{page.address}" in policy
    assert fields["x-content-type-options"] == "nosniff" and fields["referrer-policy"] == "no-referrer"
    assert "access-control-allow-origin" not in fields


def test_files_are_served(page):
    with connect(page.address) as connection:
        for _ in range(3):  # on one connection
            connection.sendall(head(page.address))
            status, fields, body = read_answer(connection)
            assert status == 200 and fields["content-type"].startswith("text/html") and b"<html" in body
    assert ask(page.address, "/", Host="localhost")[0] == 200
    assert ask(page.address, "/", Host="evil.example")[0] == 403
    status, top = ask(page.address, "/", method="HEAD")
    assert status == 200 and f"Content-Length: {len(body)}" in top


def test_a_folder_is_served_in_place_of_what_is_compiled_in(launch, tmp_path):
    (tmp_path / "outside").write_text("secret")
    root = tmp_path / "root"
    root.mkdir()
    (root / "index.html").write_text("<html>mine</html>")
    (root / "link").symlink_to(tmp_path / "outside")
    address = ready_file(launch(*WEB, "--web-root", root))["web"].removeprefix("http://")
    status, fields, body = ask(address)
    assert (status, body, fields["cache-control"]) == (200, b"<html>mine</html>", "no-store")
    for target in ("/../outside", "/%2e%2e/outside", "/link", "/..%2foutside", "//etc/passwd"):
        assert ask(address, target)[0] == 404, target


# --- Without manners


@pytest.mark.parametrize("data", [
    b"\x00\x01\x02\r\n\r\n", b"GET\r\n\r\n", b"GET / HTTP/9.9\r\n\r\n", b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + 40 * b"x",
    b"GET / HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\n\r\nhello", b"GET / HTTP/1.1\r\nHost: x\r\nContent-Length: -1\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhello\r\n0\r\n\r\n",
    b"GET / HTTP/1.1\r\nX: " + 40000 * b"x" + b"\r\n\r\n", b"GET /" + 40000 * b"x" + b" HTTP/1.1\r\n\r\n",
    b"GET / HTTP/1.1\r\n" + b"".join(b"A%d: b\r\n" % i for i in range(5000)) + b"\r\n",
    b"\xff\x00\x00\x00\x00\x00\x00\x00\x01\x7f\x03\x00NULL" + 44 * b"\x00"],
    ids=["zeros", "cut", "version", "tls", "body", "negative", "chunked", "field", "target", "fields", "zmtp"])
def test_what_is_no_request_is_refused(server, page, data):
    with connect(page.address) as connection:
        connection.sendall(data)
        connection.shutdown(socket.SHUT_WR)
        answer = b""
        while more := connection.recv(65536):
            answer += more
    assert answer == b"" or answer.startswith((b"HTTP/1.1 4",)), answer[:80]
    assert page.ask(list_jobs={}).HasField("list_jobs")


def test_messages_are_binary(page):
    page.requests.send(b"hello", TEXT)
    with pytest.raises(Closed) as closed:
        page.requests.receive()
    assert closed.value.code == 1003


@pytest.mark.parametrize("frame", [{"mask": b""}, {"opcode": 3}, {"opcode": 0}, {"opcode": PING, "data": 126 * b"x"},
                                   {"opcode": BINARY | 0x40}], ids=str)
def test_frames_against_the_protocol_end_the_connection(page, frame):
    page.requests.send(**({"data": b"x"} | frame))
    with pytest.raises(Closed) as closed:
        page.requests.receive()
    assert closed.value.code == 1002


@pytest.mark.parametrize("data", [b"", b"\x00", 100 * b"\xff", b"\x0a\xff\xff\xff\x7f"], ids=["empty", "zero", "ff", "length"])
def test_garbage_is_answered_as_malformed(page, data):
    page.requests.send(data)
    assert page.reply().error.code in (common.ERROR_CODE_MALFORMED, common.ERROR_CODE_UNSUPPORTED)
    assert page.ask(list_jobs={}).HasField("list_jobs")


def test_large_requests_are_refused_and_very_large_ones_end_the_connection(launch):
    with Page(launch(*WEB, "--max-message-bytes", 100_000)) as page:
        request = page.request(get_sample={"name": 100_000 * "x"})
        page.requests.send(request.SerializeToString())
        reply = page.reply()
        assert reply.id == request.id and reply.error.code == common.ERROR_CODE_LIMIT_EXCEEDED
        assert page.ask(list_jobs={}).HasField("list_jobs")
        try:
            page.requests.send(bytes(200_000 + (1 << 20) + 1))
        except (BrokenPipeError, ConnectionResetError):  # refused by its length, before all of it was sent
            return
        with pytest.raises(Closed) as closed:
            page.requests.receive()
        assert closed.value.code in (1009, None)


def test_a_length_that_is_a_lie_takes_no_memory(server, page):
    def resident():
        with open(f"/proc/{server.process.pid}/statm", encoding="ascii") as statm:
            return int(statm.read().split()[1]) * 4096
    before = resident()
    liars = [page.open("/v1/requests") for _ in range(10)]
    for liar in liars:
        liar.connection.sendall(struct.pack(">BBQ", 0x82, 0xFF, 400 << 20) + b"mask" + 100 * b"x")
    assert page.ask(list_jobs={}).HasField("list_jobs")
    assert resident() - before < 100 << 20
    for liar in liars:
        liar.connection.close()


def test_subscriptions_have_limits(server, page):
    page.stream.send(b"\x01" + 190 * b"x")
    with pytest.raises(TimeoutError):
        page.message(timeout=0.3)
    page.stream.send(b"\x01" + 191 * b"x")
    with pytest.raises(Closed) as closed:
        page.message()
    assert closed.value.code == 1009
    greedy = page.open("/v1/stream")
    for i in range(1025):
        greedy.send(b"\x01greedy-%d" % i)
    with pytest.raises(Closed) as closed:
        greedy.receive()
    assert (closed.value.code, closed.value.reason) == (1008, "too many subscriptions")
    for nonsense in (b"", b"\x02jobs", b"jobs", b"\x00never"):
        with page.open("/v1/stream") as other:
            other.send(nonsense)
            other.send(b"", PING)
            assert other.frame() == (PONG, b"")


def test_who_asks_nothing_does_not_keep_others_out(server, page):
    silent = [connect(page.address) for _ in range(150)]
    for connection in silent[::2]:
        connection.sendall(b"GET / HTTP/1.1\r\nHost: ")
    with Page(server) as other:
        assert other.ask(list_jobs={}).HasField("list_jobs")
    assert page.ask(list_jobs={}).HasField("list_jobs")
    ended = 0
    for connection in silent[:60]:  # the oldest made room
        connection.settimeout(20)
        try:
            ended += connection.recv(1) == b""
        except ConnectionResetError:
            ended += 1
    assert ended == 60
    for connection in silent:
        connection.close()


def test_a_head_that_never_ends_is_given_up(page):
    with connect(page.address) as connection:
        connection.settimeout(1)
        trickled = 0
        try:
            connection.sendall(b"GET / HTTP/1.1\r\n")
            while trickled < 50:  # seconds
                connection.sendall(b"X: y\r\n")
                trickled += 1
                try:
                    if not connection.recv(1):
                        break
                except TimeoutError:
                    pass
        except (ConnectionResetError, BrokenPipeError):
            pass
    assert trickled < 50


def test_as_many_sockets_as_allowed(launch):
    with Page(launch(*WEB, "--web-connections", 3)) as page:
        third = page.open("/v1/stream")
        with connect(page.address) as connection:
            connection.sendall(head(page.address, f"/v1/requests?token={page.token}", **UPGRADE))
            assert read_answer(connection)[0] == 503
        assert ask(page.address)[0] == 200
        third.connection.close()

        def is_let_in():
            try:
                page.open("/v1/requests").connection.close()
            except AssertionError:
                return False
            return True
        assert eventually(is_let_in)


def tokens_by_role(server):
    return {access.Role.Name(token.role): token.token for token in server.info().web_tokens}


def requests_as(address, token, **fields):
    return Socket(address, f"/v1/requests?token={token}", **fields)


def close_code(requests):
    with pytest.raises(Closed) as closed:
        while True:
            requests.receive()
    return closed.value.code


def test_those_who_look_leave_places_to_those_who_administer(launch):
    server = launch(*WEB)
    address = ready_file(server)["web"].removeprefix("http://")
    tokens = tokens_by_role(server)
    taken = []
    try:
        for role, most in (("ROLE_VIEW", 48), ("ROLE_EDIT", 56), ("ROLE_ADMINISTER", 64)):
            with contextlib.suppress(AssertionError):
                while len(taken) < 100:
                    taken.append(requests_as(address, tokens[role]))
            assert len(taken) == most, role
    finally:
        for one in taken:
            one.connection.close()


def unfinished(requests, size, piece=1 << 18):
    """So many bytes of a message that has no end."""
    requests.send(b"", last=False, mask=bytes(4))
    for _ in range(size // piece):
        requests.send(bytes(piece), opcode=0, last=False, mask=bytes(4))


def test_unfinished_messages_are_bounded_in_sum(launch):
    server = launch(*WEB, "--max-message-bytes", 4 << 20)
    address = ready_file(server)["web"].removeprefix("http://")
    tokens = tokens_by_role(server)
    with requests_as(address, tokens["ROLE_VIEW"]) as viewer, contextlib.suppress(ConnectionError):
        unfinished(viewer, 2 << 20)
        assert close_code(viewer) == 1009, "who looks has nothing to say that is so long"
    with requests_as(address, tokens["ROLE_EDIT"]) as first, requests_as(address, tokens["ROLE_EDIT"]) as second:
        unfinished(first, 4 << 20)
        with contextlib.suppress(ConnectionError):
            unfinished(second, 3 << 20)
            assert close_code(second) == 1013
        with requests_as(address, tokens["ROLE_ADMINISTER"]) as administrator:
            unfinished(administrator, 4 << 20)
            administrator.send(bytes(10), opcode=0, last=True, mask=bytes(4))
            assert service.Reply.FromString(administrator.receive()).error.code == common.ERROR_CODE_LIMIT_EXCEEDED
        with requests_as(address, tokens["ROLE_EDIT"]) as third:
            third.send(listing(3).SerializeToString())
            assert service.Reply.FromString(third.receive()).id == 3, "small ones have room"


def deflated(data):
    """A message's bytes by RFC 7692."""
    compressor = zlib.compressobj(9, zlib.DEFLATED, -15)
    return (compressor.compress(data) + compressor.flush(zlib.Z_SYNC_FLUSH))[:-4]


def test_messages_that_unpack_to_far_more_are_refused(launch):
    server = launch(*WEB, "--web-deflate")
    ready = ready_file(server)
    address = ready["web"].removeprefix("http://")
    offer = {"Sec_WebSocket_Extensions": "permessage-deflate"}
    compressed = BINARY | 0x40
    with requests_as(address, ready["web_token"], **offer) as requests:
        requests.send(deflated(listing(1).SerializeToString()), opcode=compressed)
        # Its own replies are compressed, too: that one comes is enough.
        assert requests.frame()[1]
    with requests_as(address, ready["web_token"], **offer) as requests:
        requests.send(deflated(bytes(200 << 20)), opcode=compressed)
        assert close_code(requests) == 1009
    scene = service.Request(version=1, id=2)
    scene.validate_scene.scene.name = "".join(chr(97 + i * i % 23) for i in range(1 << 20)) * 3
    with requests_as(address, ready["web_token"], **offer) as requests:
        requests.send(deflated(scene.SerializeToString()), opcode=compressed)
        assert requests.frame()[1], "text may be compressed well"


@pytest.mark.parametrize("coding, status", [("chunked", 200), ("Chunked", 200), ("gzip", 501), ("gzip, chunked", 501),
                                            ("identity", 501), (["chunked", "chunked"], 501)])
def test_where_a_request_ends_is_known(server, coding, status):
    address = ready_file(server)["web"].removeprefix("http://")
    with connect(address) as connection:
        body = b"0\r\n\r\n"
        connection.sendall(head(address, Transfer_Encoding=coding, Connection="close") + body)
        assert read_answer(connection)[0] in (status, 400 if status == 501 else status)
        assert connection.recv(1) == b"", "what follows is no request"


# --- Pages that sleep


def pull(session, count):
    """So many edits one after the other, each solved."""
    held = session.add(node=tip_of(session), frame=30, displacement=(0, 0.01, 0))
    for step in range(count):
        held.move((0, 0.01 + 0.005 * step, 0))
        session.wait()


def test_a_page_that_sleeps_holds_up_nobody_and_finds_the_newest(server):
    session = server.open(small_scene(frames=600), progress=False)
    session.wait()
    topic = f"session/{session.id}/body/0/positions"
    with Page(server) as awake, Page(server, receive_buffer=4096) as asleep:
        awake.subscribe(topic)
        awake.message()
        asleep.subscribe(topic)
        pull(session, 40)
        read = [awake.message()[1]]
        while not (read[-1].frames.result.converged and read[-1].frames.result.revision == session.revision):
            read.append(awake.message()[1])
        woken = [asleep.message()[1]]
        while woken[-1].sequence < read[-1].sequence:
            woken.append(asleep.message()[1])
        # The newest may be an amended or exact answer that followed the first converged one.
        while read[-1].sequence < woken[-1].sequence:
            read.append(awake.message()[1])
        assert woken[-1].frames.result.converged and woken[-1].frames == read[-1].frames
        assert len(woken) < 20 < read[-1].sequence - woken[0].sequence, "what lay between was given up"
        assert [m.sequence for m in woken] == sorted(m.sequence for m in woken)
    session.close()


def test_ordered_messages_are_not_left_out_but_end_the_connection(launch):
    server = launch(*WEB, "--web-queue-bytes", 1 << 20)
    session = server.open(small_scene(frames=4000), progress=False)
    session.wait()
    with Page(server, receive_buffer=4096) as asleep:
        topic = f"session/{session.id}/body/0/changes"
        asleep.subscribe(topic)
        asleep.message()
        pull(session, 40)
        assert eventually(lambda: counters(server)["cut_off"] == 1)
        parts = []
        with pytest.raises(Closed) as closed:
            while True:
                parts.append(asleep.message()[1])
        assert closed.value.code == 1013 and topic in closed.value.reason
        for before, after in zip(parts, parts[1:]):
            begins = after.frames.changes.base_sequence == 0  # in place of what waited, with another basis for one
            assert after.sequence == before.sequence + 1 or (begins and after.sequence > before.sequence)
        again = asleep.open("/v1/stream")
        asleep.subscribe(topic, again)
        assert asleep.message(socket=again)[1].frames.result.revision == session.revision
    session.close()


def test_a_motion_larger_than_the_queue_reaches_pages_and_those_that_join_cut_off_nobody(launch):
    server = launch(*WEB, "--web-queue-bytes", 1 << 20)
    session = server.open(small_scene(frames=24000), progress=False)
    session.wait()
    topic = f"session/{session.id}/body/0/changes"
    with Page(server, receive_buffer=4096) as asleep:
        asleep.subscribe(topic)
        for _ in range(4):
            with Page(server) as other:
                other.subscribe(topic)
                whole = other.message()[1].frames
                assert whole.changes.base_sequence == 0 and len(whole.data.data) > 1 << 20
        assert counters(server)["cut_off"] == 0
        motion = asleep.message()[1].frames
        assert motion.changes.base_sequence == 0 and motion.frame_count == motion.changes.motion_frames == 24000
    session.close()


def test_unread_replies_are_bounded(launch):
    server = launch(*WEB, "--max-unread-bytes", 4 << 20, "--max-message-bytes", 2 << 20)
    session = server.open(small_scene(frames=400), progress=False)
    session.wait()
    with Page(server, receive_buffer=4096) as page:
        ids = [page.send(get_frames={"session": session.id, "encoding": service.ENCODING_POSITIONS}) for _ in range(60)]
        assert eventually(lambda: counters(server)["refused_replies"] > 0)
        assert counters(server)["unread_bytes"] < 6 << 20
        replies = {reply.id: reply for reply in (page.reply() for _ in ids)}
        assert set(replies) == set(ids)
        codes = {reply.error.code for reply in replies.values() if reply.HasField("error")}
        assert codes == {common.ERROR_CODE_LIMIT_EXCEEDED}
        assert any(reply.HasField("get_frames") for reply in replies.values())
    session.close()


# --- Beginning and end


def test_the_end_is_told_to_pages(launch):
    server = launch(*WEB)
    session = server.open(small_scene(frames=600), progress=False)
    session.wait()
    with Page(server) as page, Page(server, receive_buffer=4096) as asleep:
        asleep.subscribe(f"session/{session.id}/body/0/positions")
        half = connect(page.address)
        half.sendall(b"GET / HTTP/1.1\r\n")
        page.subscribe("session/")
        waiting = page.send(wait={"session": session.id, "revision": 99, "timeout_s": 60})
        assert page.ask(list_jobs={}).HasField("list_jobs")
        server.process.send_signal(signal.SIGTERM)
        reply = page.reply()
        assert (reply.id, reply.error.code) == (waiting, common.ERROR_CODE_SHUTTING_DOWN)
        with pytest.raises(Closed) as closed:
            page.requests.receive()
        assert closed.value.code == 1001
        told = False
        with pytest.raises(Closed) as closed:
            while True:
                told = page.message()[1].status.server_stopped or told
        assert closed.value.code == 1001 and told
        half.close()
    assert server.process.wait(20) == 0


def limberd_says(limberd, *arguments):
    run = subprocess.run([limberd, "--bind", "tcp://127.0.0.1:0", "--stream", "tcp://127.0.0.1:0", *map(str, arguments)],
                         capture_output=True, text=True, timeout=20)
    assert run.returncode == 1, run.stderr
    return run.stderr


@pytest.mark.parametrize("arguments, words", [
    (["--web", "0.0.0.0:0"], "--web-beyond-loopback"), (["--web", "[::]:0"], "--web-beyond-loopback"),
    (["--web", "example.org:80"], "--web"), (["--web", "127.0.0.1"], "--web"), (["--web", "127.0.0.1:99999"], "--web"),
    (["--web", "tcp://127.0.0.1:0"], "ADDRESS:PORT"),
    (["--web-deflate"], "is for a limberd with --web"), (["--web-root", "."], "is for a limberd with --web"),
    (["--web", "127.0.0.1:0", "--web-root", "/nowhere"], "no folder"),
    (["--web", "127.0.0.1:0", "--web-host", "a b"], "--web-host"),
    (["--web", "127.0.0.1:0", "--web-frame-ancestor", "http://x; script-src *"], "--web-frame-ancestor"),
    (["--web", "127.0.0.1:0", "--web-connections", "0"], "--web-connections"),
    (["--web", "127.0.0.1:0", "--web-token-file", "/nowhere"], "/nowhere")], ids=lambda value: " ".join(value)[:40])
def test_bad_options_are_named(limberd, arguments, words):
    assert words in limberd_says(limberd, *arguments)


def test_a_port_that_is_taken_is_named(limberd, page):
    assert page.address in limberd_says(limberd, "--web", page.address)


def test_the_token_may_be_given(launch, limberd, tmp_path):
    token = tmp_path / "token"
    token.write_text("my-own-token-of-mine\n")
    token.chmod(0o644)
    assert "chmod 600" in limberd_says(limberd, *WEB, "--web-token-file", token)
    token.chmod(0o600)
    with Page(launch(*WEB, "--web-token-file", token)) as page:
        assert page.token == "my-own-token-of-mine"
        assert page.ask(list_jobs={}).HasField("list_jobs")


def test_beyond_loopback_the_reached_address_is_an_own_host(launch):
    server = launch("--web", "0.0.0.0:0", "--web-beyond-loopback", "--web-host", "limber.example",
                    "--web-frame-ancestor", "http://localhost:8888")
    port = ready_file(server)["web"].rsplit(":", 1)[1]
    address = f"127.0.0.1:{port}"
    for host, status in ((address, 200), ("limber.example", 200), ("evil.example", 403), ("10.1.2.3", 403)):
        answer, fields, _ = ask(address, Host=host)
        assert answer == status
        assert fields["content-security-policy"].endswith("frame-ancestors 'self' http://localhost:8888")


def test_messages_are_compressed_where_both_want_it(launch):
    offer = {"Sec_WebSocket_Extensions": "permessage-deflate; client_max_window_bits"}
    plain, deflating = launch(*WEB), launch(*WEB, "--web-deflate")
    for server, is_compressed in ((plain, False), (deflating, True)):
        with Page(server, **offer) as page:
            page.send(get_sample={"name": "flower"})
            first = page.requests.connection.recv(1)
            assert bool(first[0] & 0x40) == is_compressed


def test_pages_of_a_server_with_keys_need_the_token(limberd, tmp_path, cache_dir):
    for name in ("server", "friend"):
        subprocess.run([limberd, "keygen", tmp_path / f"{name}.key"], check=True, capture_output=True, timeout=20)
    ready = tmp_path / "ready"
    process = subprocess.Popen([limberd, "--bind", "tcp://127.0.0.1:0", "--stream", "tcp://127.0.0.1:0", *WEB, "--ready-file",
                                ready, "--cache-dir", cache_dir, "--curve-secret-file", tmp_path / "server.key",
                                "--curve-allow", tmp_path / "friend.key.pub"], stderr=subprocess.DEVNULL)
    try:
        assert eventually(ready.exists)
        told = json.loads(ready.read_text())
        address = told["web"].removeprefix("http://")
        with limber.connect(told["requests"], server_key=tmp_path / "server.key.pub", key=tmp_path / "friend.key") as friend:
            own = friend.info().web_token
            assert own and own != told["web_token"], "a key without a role may edit; the ready file has the token that administers"
        with Socket(address, f"/v1/requests?token={own}") as requests:
            requests.send(listing(1).SerializeToString())
            assert service.Reply.FromString(requests.receive()).HasField("list_jobs")
        with Socket(address, f"/v1/requests?token={told['web_token']}") as requests:
            requests.send(listing(1).SerializeToString())
            assert service.Reply.FromString(requests.receive()).HasField("list_jobs")
            (tmp_path / "friend.key.pub").write_text("")
            process.send_signal(signal.SIGHUP)  # keys are taken off: a page has none
            requests.send(listing(2).SerializeToString())
            assert service.Reply.FromString(requests.receive()).id == 2
        status, _, _ = ask(address, "/v1/requests?token=no")
        assert status == 401
    finally:
        process.terminate()
        assert process.wait(10) == 0


# --- limber web


def test_limber_web_prints_the_address(cli, server):
    ready = ready_file(server)
    url = f"{ready['web']}/?token={ready['web_token']}"
    assert cli("web", "--no-open").stdout == url + "\n"
    assert json.loads(cli("--json", "web", "--no-open").stdout) == {"url": url}
    shown = cli("info").stdout
    assert ready["web"] in shown and ready["web_token"] not in shown
    assert ready["web_token"] not in cli("--json", "info").stdout


def test_limber_web_says_that_a_server_has_no_pages(cli, launch):
    refused = cli("web", "--no-open", endpoint=launch().connection.endpoint)
    assert refused.returncode == 1 and "without --web" in refused.stderr


def test_limber_web_starts_a_server(cli, tmp_path):
    endpoint = f"ipc://{tmp_path}/limber"
    started = cli("web", "--no-open", "--log", tmp_path / "log", "--", *WEB, endpoint=endpoint)
    try:
        assert started.returncode == 0, started.stderr
        url, token = started.stdout.strip().split("/?token=")
        assert ask(url.removeprefix("http://"), f"/v1/requests?token={token}")[0] == 426
        assert cli("web", "--no-open", endpoint=endpoint).stdout == started.stdout
    finally:
        assert cli("stop", endpoint=endpoint).returncode == 0
