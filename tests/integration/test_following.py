"""Streams against credit: who does not read costs bytes that are bounded and counted, and nobody else anything.

Told by what arrives, in which order and how much, not by how long it takes."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time

import limber
import pytest
import zmq
from conftest import small_scene, tip_of
from followers import Follower
from limber.v1 import service_pb2 as service
from limber.v1.service_pb2 import Reply
from test_hard_clients import Reader, drag

POSITIONS = "session/{}/body/0/positions"


def resident(pid):
    """[bytes]"""
    with open(f"/proc/{pid}/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def eventually(happens, seconds=30.0):
    deadline = time.monotonic() + seconds
    while not happens():
        assert time.monotonic() < deadline, "it did not come to this"
        time.sleep(0.02)


def queues(server):
    return server.info(status=True).status.queues


def reader_named(server, name):
    found = [one for one in queues(server).readers if one.name == name]
    return found[0] if found else None


@pytest.fixture
def watched(server):
    """A session with 400 kB a motion, and somebody who reads all of its stream."""
    session = server.open(small_scene(frames=600), progress=False)
    session.wait()
    reader = Reader(server.connection.endpoint, session.id)
    yield session, reader
    reader.close()
    session.close()


def test_limbers_own_streams_are_followed(server, watched):
    session, reader = watched
    before = server.info().counters["followed"]
    drag(session, reader, edits=3)
    assert server.info().counters["followed"] >= before + 3
    mine = [one for one in queues(server).readers if one.name.startswith("python-")]
    assert mine and mine[0].topics == 2 and mine[0].sent > 0 and mine[0].client > 0
    assert reader.stream.cut_offs == [] and reader.stream.missed == 0


def test_one_that_reads_a_message_a_second_gets_newer_frames_and_the_count(server, watched):
    session, reader = watched
    slow = Follower(server.connection.endpoint, [POSITIONS.format(session.id)], name="slow")
    assert not slow.follow().continued
    is_over = threading.Event()

    def read():
        while not is_over.wait(1):
            while (got := slow.receive(timeout=0)) is not None and not isinstance(got, tuple):
                pass  # an answer
            if got is not None:
                slow.ask()

    thread = threading.Thread(target=read)
    thread.start()
    try:
        while len(slow.messages) < 3:
            drag(session, reader)
        # The queue holds the newest motion, and one is under way: no more, however many were made.
        use = reader_named(server, "slow")
        motion = slow.messages[0][1].ByteSize()
        assert use.waiting_bytes + use.unread_bytes < 3 * motion and use.left_out > 0
    finally:
        is_over.set()
        thread.join()
    while len(slow.messages) == 0 or slow.messages[-1][1].frames.result.revision < session.revision:
        slow.ask()
        got = slow.receive()
        assert got is not None, [message.sequence for _, message in slow.messages]
    # The other one had all.
    assert reader.finals[-25:] == list(range(session.revision - 24, session.revision + 1)) and reader.missed == 0
    sequences = [message.sequence for _, message in slow.messages]
    assert sequences == sorted(set(sequences))
    gaps = sequences[-1] - sequences[0] + 1 - len(sequences)
    assert gaps == slow.left_out > 0
    slow.close()


STOPPED = """
import sys
import limber
endpoint, name, last = sys.argv[1:]
with limber.connect(endpoint, timeout=120) as server:
    stream = server.session(name).stream(encoding="positions")
    while (first := stream.next(60).result.revision) < 2:  # of what was published to this stream
        pass
    print("ready", flush=True)
    while (taken := stream.next(60)).result.revision < int(last):
        pass
    print(first, taken.result.revision, taken.missed > 0 or stream.missed > 0, stream.cut_offs, flush=True)
"""


@pytest.mark.timeout(150)
def test_one_that_is_stopped_is_cut_off_with_a_reason_and_goes_on_from_a_snapshot(launch):
    running = launch("--stalled-after", "1", transport="tcp")
    server = limber.connect(running.connection.endpoint)
    session = server.open(small_scene(frames=6000), session="s", progress=False)
    session.wait()
    reader = Reader(server.connection.endpoint, session.id)
    last = 12
    held = session.add(node=tip_of(session), frame=300, displacement=(0, 0.05, 0))
    client = subprocess.Popen([sys.executable, "-c", STOPPED, server.connection.endpoint, session.id, str(last + 2)],
                              stdout=subprocess.PIPE, text=True, env=dict(os.environ, PYTHONPATH=os.pathsep.join(sys.path)))
    try:
        eventually(lambda: len(queues(server).readers) == 2)
        held.move((0, 0.06, 0))
        assert client.stdout.readline() == "ready\n"
        client.send_signal(signal.SIGSTOP)
        drag(session, reader, edits=last - 1)  # adds one, too
        eventually(lambda: server.info().counters["stalled"] == 1)
        eventually(lambda: len(queues(server).readers) == 1)  # the other one's
        client.send_signal(signal.SIGCONT)
        output, _ = client.communicate(timeout=90)
        first, newest, missed, cut_offs = output.split(maxsplit=3)
        assert (first, newest, missed) == ("2", str(session.revision), "True")
        assert "it gave no credit for 1 s while messages waited" in cut_offs
    finally:
        client.kill()
        client.wait()
        reader.close()
    assert reader.finals[-last + 1:] == list(range(session.revision - last + 2, session.revision + 1))


def test_who_was_away_gets_a_snapshot_of_what_followed_and_nothing_where_nothing_did(server, watched):
    session, reader = watched
    topic = POSITIONS.format(session.id)
    follower = Follower(server.connection.endpoint, [topic], name="away")
    follower.follow()
    eventually(lambda: follower.receive(1) is None)  # has all
    sequence = follower.topics[topic]
    assert sequence > 0

    def away(edits=0):
        """@returns the messages that come on the next connection"""
        has = follower.topics[topic]
        follower.socket.close()
        eventually(lambda: reader_named(server, "away") is None)
        if edits:
            drag(session, reader, edits)
        follower.connect()
        follower.messages.clear()
        answer = follower.follow()
        assert answer.continued and "connection had ended" in answer.cut_off
        while follower.receive(2) is not None:
            pass
        assert all(message.sequence > has for _, message in follower.messages)
        return [message for _, message in follower.messages]

    # What was published meanwhile may be a remark on the motion's error; then nothing is.
    eventually(lambda: away() == [])
    # A result that nobody was there for was not published: it comes all the same.
    reader.close()
    held = session.add(node=tip_of(session), frame=300, displacement=(0, 0.02, 0))
    follower.socket.close()
    eventually(lambda: reader_named(server, "away") is None)
    held.move((0, 0.03, 0))
    session.wait()
    follower.connect()
    follower.messages.clear()
    follower.follow()

    def has_newest():
        follower.receive(1)  # or it came before the answer, or a remark followed it
        return any(message.frames.result.revision == session.revision for _, message in follower.messages)

    eventually(has_newest)
    reader.__init__(server.connection.endpoint, session.id)
    newest = away(edits=3)[-1]
    assert newest.sequence > sequence and newest.frames.result.revision == session.revision
    follower.close()


@pytest.mark.timeout(200)
def test_what_eight_cost_that_read_nothing_is_bounded(launch):
    """Motions of 15 MB, another one under way to each. Plain subscribers alone would take five each, 600 MB."""
    total, motion = 96 << 20, 16 << 20
    most = total + 9 * motion  # before the first of those who follow has stalled for a second: one each
    running = launch("--max-stream-total-bytes", str(total), transport="tcp")
    server = limber.connect(running.connection.endpoint, timeout=60)
    session = server.open(small_scene(frames=20_000), session="s", progress=False, timeout=120)
    session.wait(timeout=120)
    topic = POSITIONS.format("s")
    pid = running.process.pid

    def edit(count):
        held = session.constraints()[0] if session.constraints() else session.add(node=tip_of(session), frame=30, displacement=(0, 0.05, 0))
        for step in range(count):
            held.move((0, 0.05 + 0.002 * step, 0.01))
            session.wait(timeout=120)

    with contextlib.ExitStack() as stack:
        reading = Reader(server.connection.endpoint, session.id)
        stack.callback(reading.close)
        edit(6)  # what the motions of one who reads take
        before = resident(pid)
        for number in range(8):  # each stalls with another motion
            follower = Follower(server.connection.endpoint, [topic], window=4 << 20, name=f"unread {number}")
            stack.callback(follower.close)
            follower.ask()
            subscriber = follower.context.socket(zmq.SUB)
            subscriber.linger, subscriber.rcvhwm, subscriber.rcvbuf = 0, 1, 4096
            subscriber.subscribe(topic)
            subscriber.connect(server.stream_endpoint)
            edit(2)
            assert queues(server).stream_bytes < most
        deadline = time.monotonic() + 60
        while True:
            edit(1)
            counters, use = server.info().counters, queues(server)
            assert use.stream_bytes < most and use.stream_limit_bytes == total
            if counters["stalled"] > 0 and counters["withheld"] > 0 and use.stream_bytes < total + motion:
                break
            assert time.monotonic() < deadline, (counters["stalled"], counters["withheld"], use.stream_bytes)
        grown = resident(pid) - before
        assert grown < most + (64 << 20), grown / 1e6
        reading.wait_for(session.revision)  # who reads has the newest all the same


@pytest.mark.timeout(120)
def test_what_nobody_takes_is_freed(launch):
    """Replies and messages of the stream socket: libzmq alone waits for ever for one that stopped in the middle of a message."""
    running = launch("--stalled-after", "1", transport="tcp")
    server = limber.connect(running.connection.endpoint)
    session = server.open(small_scene(frames=6000), session="s", progress=False)
    session.wait()
    held = session.add(node=tip_of(session), frame=300, displacement=(0, 0.05, 0))
    context = zmq.Context()
    sockets = []
    for kind, endpoint in ((zmq.DEALER, server.connection.endpoint), (zmq.SUB, server.stream_endpoint)):
        socket = context.socket(kind)
        socket.linger, socket.rcvhwm, socket.rcvbuf, socket.reconnect_ivl = 0, 1, 4096, -1
        socket.connect(endpoint)
        sockets.append(socket)
    sockets[1].subscribe(POSITIONS.format("s"))
    request = service.GetFramesRequest(session="s", encoding=service.ENCODING_POSITIONS)
    try:
        for number in range(6):
            sockets[0].send(service.Request(version=1, id=number + 1, get_frames=request).SerializeToString())
        eventually(lambda: queues(server).unread_bytes > 0)
        eventually(lambda: [one.unread_bytes > 0 for one in queues(server).unread_clients] == [True])
        for step in range(6):
            held.move((0, 0.05 + 0.002 * step, 0.01))
            session.wait()
        eventually(lambda: queues(server).stream_bytes > 0)
        eventually(lambda: queues(server).unread_bytes == 0 and not queues(server).unread_clients)
        eventually(lambda: queues(server).stream_bytes == 0)
    finally:
        context.destroy(linger=0)


def test_bad_requests_are_refused_by_name(server):
    follower = Follower(server.connection.endpoint, ["jobs"])
    for more, code, field in ((dict(stream="x" * 65), "INVALID_ARGUMENT", "stream"),
                              (dict(topics=[dict(prefix="x" * 129)]), "INVALID_ARGUMENT", "topics[1].prefix"),
                              (dict(topics=[dict(prefix=str(i)) for i in range(1024)]), "LIMIT_EXCEEDED", "topics")):
        follower.ask(**more)
        reply = follower.receive()
        assert isinstance(reply, Reply) and reply.WhichOneof("body") == "error", more
        assert limber.v1.common_pb2.ErrorCode.Name(reply.error.code) == f"ERROR_CODE_{code}"
        assert reply.error.field.endswith(field)
    follower.close()
