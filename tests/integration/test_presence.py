"""Who is in a session, and who made which revision."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

import limber
from limber.messages import service


def names(session):
    return [one.name for one in session.clients()]


def until(holds, patience=10.0):
    """Waits for what another process or thread brings about."""
    deadline = time.monotonic() + patience
    while not holds():
        assert time.monotonic() < deadline, "it did not happen"
        time.sleep(0.02)


@pytest.fixture
def opened(server):
    session = server.open(sample="arch", session="arch")
    yield session
    session.close()


def test_clients_are_listed_by_name_with_what_they_did(server, opened):
    with limber.connect(server.connection.endpoint, name="ana") as ana:
        joined = ana.session("arch")
        first, second = opened.clients()
        assert first.is_self and first.name.startswith("python-") and not second.is_self and second.name == "ana"
        assert [one.is_self for one in joined.clients()] == [False, True]
        assert second.client > first.client and 0 <= second.present_s <= first.present_s
        receipt = joined.load(40, force=(0, 0, -1))
        assert [one.last_revision for one in opened.clients()] == [0, receipt.revision]
        joined.load(40, force=(0, 0, -2))
        opened.undo(anyone=True)
        told = [(one.first, one.revision, one.name, one.edits) for one in opened.revisions()]
        own = first.name
        assert told == [(3, 3, own, ("undo",)), (1, 2, "ana", ("set_beam_load",)), (0, 0, own, ("open_session",))]
        joined.leave()
        assert names(opened) == [own] and opened.revisions()[1].name == "ana"
        joined.load(40, force=(0, 0, -3))
        assert names(opened) == [own, "ana"]
    until(lambda: names(opened) == [own])


def test_joins_and_leaves_come_on_the_status_topic(server, opened):
    import zmq
    from limber.messages import stream
    socket = server.connection.context.socket(zmq.SUB)
    socket.linger = 0
    socket.connect(server.stream_endpoint)
    socket.setsockopt(zmq.SUBSCRIBE, b"session/arch/status")

    def newest(count):
        while socket.poll(5000):
            message = stream.StreamMessage.FromString(socket.recv_multipart()[-1])
            if len(message.status.clients) == count:
                return [one.name for one in message.status.clients][1:]
        raise AssertionError(f"no status with {count} clients")

    assert newest(1) == []
    with limber.connect(server.connection.endpoint, name="ben") as ben:
        ben.session("arch")
        assert newest(2) == ["ben"]
    assert newest(1) == []
    socket.close()


def test_a_killed_client_disappears(server, opened):
    code = ("import limber, sys, time; server = limber.connect(sys.argv[1], name='doomed'); server.session('arch'); "
            "print('in', flush=True); time.sleep(60)")
    process = subprocess.Popen([sys.executable, "-c", code, server.connection.endpoint], stdout=subprocess.PIPE)
    assert process.stdout.readline() == b"in\n" and "doomed" in names(opened)
    process.kill()
    process.wait()
    until(lambda: "doomed" not in names(opened))


@pytest.mark.timeout(90)
def test_a_silent_client_disappears_after_the_heartbeat_limit(launch):
    server = launch(transport="tcp")  # heartbeats find what does not close its connection
    opened = server.open(sample="arch", session="arch")
    code = ("import limber, sys, time; server = limber.connect(sys.argv[1], name='frozen'); server.session('arch'); "
            "print('in', flush=True); time.sleep(300)")
    process = subprocess.Popen([sys.executable, "-c", code, server.connection.endpoint], stdout=subprocess.PIPE)
    assert process.stdout.readline() == b"in\n"
    os.kill(process.pid, signal.SIGSTOP)
    try:
        assert "frozen" in names(opened)
        until(lambda: "frozen" not in names(opened), patience=40)
    finally:
        process.kill()
        process.wait()


@pytest.mark.parametrize("name", ["x" * 65, "ä" * 33, "bell\a"])
def test_bad_names_are_refused(server, opened, name):
    with pytest.raises(limber.LimberError, match="name"):
        limber.connect(server.connection.endpoint, name=name)
    server.connection.client_name, kept = name, server.connection.client_name
    try:
        with pytest.raises(limber.LimberError) as refused:
            opened.undo()
        assert refused.value.code == "INVALID_ARGUMENT" and refused.value.field == "client_name"
    finally:
        server.connection.client_name = kept


def test_nameless_clients_get_one(server, opened):
    connection = limber.connection.Connection(server.connection.endpoint)
    connection.client_name = ""
    answer = connection.call("join_session", limber.messages.presence.JoinSessionRequest(session="arch"))
    assert answer.clients[-1].name == f"client-{answer.client}"
    connection.close()


def test_command_line_tells_who_is_there(server, opened, limberd):
    def run(*arguments):
        command = [str(limberd.parent / "limber"), "--endpoint", server.connection.endpoint, *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout

    run("--name", "shell", "load", "arch", "--node", "40", "--force", "0", "0", "-1")
    text = run("clients", "arch")
    assert opened.clients()[0].name in text and "shell" in text and "set_beam_load" in text
    told = json.loads(run("clients", "arch", "--json"))
    assert [one["name"] for one in told["revisions"]] == ["shell", opened.clients()[0].name]
    assert opened.status().age_s > 0 and service.SessionStatus().age_s == 0


def test_a_session_has_room_for_a_hundred(server, opened):
    connections = [limber.connection.Connection(server.connection.endpoint) for _ in range(100)]
    try:
        request = limber.messages.presence.JoinSessionRequest(session="arch")
        for connection in connections[:99]:
            connection.call("join_session", request)
        with pytest.raises(limber.LimberError) as refused:
            connections[99].call("join_session", request)
        assert refused.value.code == "LIMIT_EXCEEDED" and len(opened.clients()) == 100
        connections[0].close()
        until(lambda: len(opened.clients()) == 99)
    finally:
        for connection in connections:
            connection.close()
