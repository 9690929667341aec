"""Several clients, several sessions, clients that die, stall or leave."""

import collections
import contextlib
import os
import signal
import subprocess
import sys
import threading
import time

import limber
import numpy as np
import pytest
import zmq
from conftest import small_scene, tip_of
from limber.messages import service
from limber.v1.stream_pb2 import StreamMessage


def test_two_clients_see_the_same_session(server, session):
    tip = tip_of(session)
    with limber.connect(server.connection.endpoint) as other:
        same = other.session(session.id)
        session.add(node=tip, frame=20, displacement=(0, 0, 0.2))
        added = same.add(node=tip, frame=40, displacement=(0, 0.2, 0))
        assert (session.revision, same.revision) == (1, 2)
        result = session.wait(revision=2)
        assert result.revision >= 2
        assert [c.frame for c in session.constraints()] == [20, 40] == [c.frame for c in same.constraints()]
        session.remove(added.id)
        same.wait(revision=3)
        np.testing.assert_array_equal(session.frames(final=True), same.frames(final=True))


def test_concurrent_editors_never_lose_an_edit(server, session):
    tip = tip_of(session)
    revisions, failures = [], []

    def edit(offset):
        try:
            with limber.connect(server.connection.endpoint) as mine:
                same = mine.session(session.id)
                for i in range(20):
                    held = same.add(node=tip, frame=2 + offset, displacement=(0, 0.01 * i, 0.1))
                    revisions.append(same.revision)
                    if i < 19:
                        revisions.append(held.remove().revision)
        except Exception as error:  # noqa: BLE001 (reported by the main thread)
            failures.append(error)

    threads = [threading.Thread(target=edit, args=(10 * n,)) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(50)
    assert not failures
    # Every accepted request is its own revision: each number once, no number left out.
    assert sorted(revisions) == list(range(1, 4 * 39 + 1))
    assert session.wait(revision=4 * 39).converged
    assert sorted(c.frame for c in session.constraints()) == [2, 12, 22, 32]


def test_builds_of_one_client_do_not_wait_for_all_of_another(launch):
    """With one thread, and twelve bodies of one client that wait for it."""
    server = launch("--threads", "1", "--no-cache", name="many")
    for n in range(12):
        server.open(small_scene(frames=30 + n), session=f"many.{n}", wait=False)
    with limber.connect(server.connection.endpoint, name="one") as other:
        other.open(small_scene(), session="one", progress=False)
        left = [status.session for status in other.sessions() if status.state == service.SESSION_STATE_BUILDING]
    assert len(left) > 6, "the one would have come last"


def test_several_sessions_do_not_disturb_each_other(server):
    sessions = [server.open(small_scene(frames=30 + 10 * n), session=f"several.{n}", progress=False) for n in range(3)]
    assert {"several.0", "several.1", "several.2"} <= {status.session for status in server.sessions()}
    for n, session in enumerate(sessions):
        session.add(node=tip_of(session), frame=15, displacement=(0, 0, 0.1 * (n + 1)))
    energies = [session.wait().energy for session in sessions]
    assert energies[0] < energies[1] < energies[2]
    assert [len(session.frames()) for session in sessions] == [30, 40, 50]
    with pytest.raises(limber.LimberError) as caught:
        server.open(small_scene(), session="several.1")
    assert caught.value.code == "ALREADY_EXISTS"
    for session in sessions:
        session.close()
    with pytest.raises(limber.LimberError) as caught:
        sessions[0].status()
    assert caught.value.code == "NOT_FOUND"


EDITOR = """
import sys, limber
with limber.connect(sys.argv[1]) as server:
    session = server.session(sys.argv[2])
    tip, i = int(sys.argv[3]), 0
    held = session.add(node=tip, frame=30, displacement=(0, 0, 0.1))
    while True:
        i += 1
        print(held.move((0, 0, 0.1 + 0.001 * (i % 100))).revision, flush=True)
"""


def test_a_client_is_killed_mid_edit_and_another_takes_over(server, session):
    tip = tip_of(session)
    editor = subprocess.Popen([sys.executable, "-c", EDITOR, server.connection.endpoint, session.id, str(tip)],
                              stdout=subprocess.PIPE, text=True)
    try:
        acknowledged = [int(editor.stdout.readline()) for _ in range(50)][-1]
        editor.send_signal(signal.SIGKILL)
        acknowledged = max([acknowledged, *(int(line) for line in editor.stdout if line.endswith("\n"))])
    finally:
        editor.kill()
        editor.wait()
    with limber.connect(server.connection.endpoint) as heir_server:
        heir = heir_server.session(session.id)
        # Everything acknowledged is there; at most the one edit that was in transit came after it.
        assert acknowledged <= heir.revision <= acknowledged + 1
        held, = heir.constraints()
        assert held.nodes == (tip,) and held.target[2] == pytest.approx(
            0.1 + 0.001 * ((heir.revision - 1) % 100), abs=1e-12)
        before = heir.wait()
        held.move((0, 0, 0.35))
        after = heir.wait()
        assert after.revision == heir.revision and after.energy > before.energy
        heir.undo()
        assert heir.wait().energy == pytest.approx(before.energy, rel=1e-6)


def test_a_subscriber_that_does_not_read_costs_nobody_else_anything(server, session):
    tip = tip_of(session)
    stalled = zmq.Context()
    socket = stalled.socket(zmq.SUB)
    socket.linger = 0
    socket.rcvhwm = 1
    socket.rcvbuf = 4096
    socket.subscribe(f"session/{session.id}/body/0/positions")
    socket.connect(server.stream_endpoint)
    try:
        held = session.add(node=tip, frame=30, displacement=(0, 0, 0.1))
        session.wait()
        slowest = 0.0
        for i in range(200):
            start = time.monotonic()
            held.move((0, 0, 0.1 + 0.001 * i))
            slowest = max(slowest, time.monotonic() - start)
        assert session.wait().converged
        assert slowest < 2
        assert server.process.poll() is None
        # It reads again: the newest frames come, and the gap shows in the sequence numbers.
        received = []
        while socket.poll(500):
            topic, body = socket.recv_multipart()
            received.append(StreamMessage.FromString(body))
        assert received and received[-1].frames.result.revision <= session.revision
        assert [m.sequence for m in received] == sorted({m.sequence for m in received})
    finally:
        stalled.destroy(linger=0)


def test_a_client_that_does_not_read_its_replies_costs_nobody_else_anything(server, session):
    context = zmq.Context()
    socket = context.socket(zmq.DEALER)
    socket.linger = 0
    socket.rcvhwm = 1
    socket.connect(server.connection.endpoint)
    try:
        for i in range(2000):
            request = limber.connection.service.Request(version=1, id=i + 1)
            request.get_frames.session = session.id
            request.get_frames.encoding = limber.connection.service.ENCODING_POSITIONS
            socket.send(request.SerializeToString())
        start = time.monotonic()
        session.add(node=tip_of(session), frame=30, displacement=(0, 0, 0.1))
        session.wait()
        assert time.monotonic() - start < 10
    finally:
        context.destroy(linger=0)
    assert server.info().server_version


def flood(endpoint, session, stop):
    """Another process that asks for geometry as fast as it can and reads nothing."""
    program = ("import sys, zmq\n"
               "from limber.messages import service\n"
               "socket = zmq.Context().socket(zmq.DEALER)\n"
               "socket.rcvhwm = 2\n"
               "socket.connect(sys.argv[1])\n"
               "request = service.Request(version=1, id=1)\n"
               "request.get_geometry.session = sys.argv[2]\n"
               "data = request.SerializeToString()\n"
               "print('ready', flush=True)\n"
               "while True:\n"
               "    socket.send(data)\n")
    process = subprocess.Popen([sys.executable, "-c", program, endpoint, session], stdout=subprocess.PIPE, text=True)
    stop.callback(process.stdout.close)
    stop.callback(process.wait)
    stop.callback(process.kill)
    assert process.stdout.readline() == "ready\n"
    return process


def open_requests(server):
    return server.info().counters["open_requests"]


def test_clients_that_flood_hold_up_nobody_else(launch):
    server = launch()
    session = server.open(sample="flower", progress=False)
    with contextlib.ExitStack() as stop:
        floods = [flood(server.connection.endpoint, session.id, stop) for _ in range(2)]
        deadline = time.monotonic() + 20
        while open_requests(server) < 1000:  # the backlog is there
            assert time.monotonic() < deadline
        for _ in range(20):
            start = time.monotonic()
            session.geometry()
            session.status()
            assert time.monotonic() - start < 3
            assert open_requests(server) <= 2 * 1001 + 1
        for process in floods:
            process.kill()
            process.wait()
        # The dead are not served: two thousand bodies would take much longer than this.
        deadline = time.monotonic() + 5
        while open_requests(server) > 1:
            assert time.monotonic() < deadline
        flood(server.connection.endpoint, session.id, stop)
        time.sleep(1)
        start = time.monotonic()
        os.kill(server.process.pid, signal.SIGTERM)
        assert server.process.wait(10) == 0, server.log
        assert time.monotonic() - start < 4  # two, and a busy machine


def test_requests_beyond_the_limit_of_a_client_are_refused_by_name(server, session):
    context = zmq.Context()
    socket = context.socket(zmq.DEALER)
    socket.linger, socket.rcvhwm, socket.sndhwm = 0, 0, 0
    socket.connect(server.connection.endpoint)
    try:
        for i in range(1200):
            request = limber.connection.service.Request(version=1, id=i + 1)
            request.wait.session, request.wait.revision, request.wait.timeout_s = session.id, 10 ** 6, 2.0
            socket.send(request.SerializeToString())
        codes = collections.Counter()
        for _ in range(1200):
            assert socket.poll(20000), "no reply"
            error = limber.connection.service.Reply.FromString(socket.recv_multipart()[-1]).error
            code = limber.errors.code_name(error.code)
            codes[code] += 1
            if code == "LIMIT_EXCEEDED":
                assert (error.field, error.details["limit"]) == ("body", "1000")
        assert codes == {"TIMEOUT": 1000, "LIMIT_EXCEEDED": 200}
    finally:
        context.destroy(linger=0)


def test_waiting_clients_are_answered_in_any_order(server, session):
    with limber.connect(server.connection.endpoint) as other:
        late = threading.Thread(target=lambda: other.session(session.id).wait(revision=1, timeout=30))
        late.start()
        time.sleep(0.1)
        assert late.is_alive()
        assert session.status().revision == 0  # answered while the wait is pending
        session.add(node=tip_of(session), frame=30, displacement=(0, 0, 0.1))
        late.join(30)
        assert not late.is_alive()
    with pytest.raises(limber.LimberError) as caught:
        session.wait(revision=99, timeout=0.2)
    assert caught.value.code == "TIMEOUT"


def test_sigterm_while_edits_are_in_flight(launch):
    server = launch()
    session = server.open(small_scene(), progress=False)
    tip = tip_of(session)
    outcome, waited = [], []

    def edit():
        try:
            held = session.add(node=tip, frame=30, displacement=(0, 0, 0.1))
            while True:
                held.move((0, 0, 0.1))
                outcome.append("ok")
        except limber.LimberError as error:
            outcome.append(error.code)

    def wait():
        try:
            session.wait(revision=10 ** 9, timeout=50)
            waited.append("answered by a result")
        except limber.LimberError as error:
            waited.append(error.code)

    threads = [threading.Thread(target=edit)] + [threading.Thread(target=wait) for _ in range(5)]
    server.connection.timeout = 3
    for thread in threads:
        thread.start()
    while outcome.count("ok") < 20:
        time.sleep(0.01)
    start = time.monotonic()
    os.kill(server.process.pid, signal.SIGTERM)
    assert server.process.wait(10) == 0, server.log
    assert time.monotonic() - start < 8
    # The waits were with the server long before the signal, so each is answered, and soon: without an answer their
    # deadline is 53 s away, and closing the connection (which answers CANCELLED itself) comes after them.
    for thread in threads[1:]:
        thread.join(5)
        assert not thread.is_alive(), "a wait was left without an answer"
    assert waited == ["SHUTTING_DOWN"] * 5
    # An edit may have been sent to nobody after that: silence is right then, any other refusal is not.
    threads[0].join(10)
    assert not threads[0].is_alive()
    assert outcome[-1] in ("SHUTTING_DOWN", "TIMEOUT") and set(outcome[:-1]) == {"ok"}
    server.connection.close()


def test_sigterm_during_a_build(launch, tmp_path):
    server = launch("--no-cache")
    server.open(sample="flower", wait=False)
    time.sleep(0.3)
    os.kill(server.process.pid, signal.SIGTERM)
    assert server.process.wait(20) == 0, server.log


def test_shutdown_request(launch):
    server = launch("--allow-shutdown")
    server.shutdown()
    assert server.process.wait(10) == 0, server.log


def test_shutdown_request_where_it_is_not_allowed(launch, cli):
    server = launch()
    with pytest.raises(limber.LimberError, match="--allow-shutdown") as caught:
        server.shutdown()
    assert caught.value.code == "UNSUPPORTED"
    stopped = cli("stop", endpoint=server.connection.endpoint)
    assert stopped.returncode == 1 and "--allow-shutdown" in stopped.stderr
    assert server.info().protocol_versions == [1]


def test_tcp_on_loopback(launch):
    server = launch(transport="tcp")
    assert server.connection.endpoint.startswith("tcp://127.0.0.1:")
    session = server.open(small_scene(), progress=False)
    with session.stream(timeout=20) as stream:
        session.add(node=tip_of(session), frame=30, displacement=(0, 0, 0.1))
        assert any(frames.result.revision == 1 for frames in stream)
