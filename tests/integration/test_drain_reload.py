"""SIGTERM drains, SIGHUP reads options again, and who is connected notices nothing of it."""

import contextlib
import json
import signal
import sqlite3
import threading
import time

import limber
import pytest
import zmq
from conftest import small_scene, tip_of
from limber.messages import service
from limber.v1 import stream_pb2 as stream
from pages import ask, ready_file


@pytest.fixture
def config(tmp_path):
    """A function that writes the file of --config."""
    path = tmp_path / "limberd.toml"

    def write(text):
        path.write_text(text)
        return str(path)
    return write


def hang_up(server, word="SIGHUP"):
    """Returns the lines of the log about it."""
    before = len(server.log)
    server.process.send_signal(signal.SIGHUP)
    deadline = time.monotonic() + 20
    while word not in server.log[before:]:
        assert time.monotonic() < deadline, server.log
        time.sleep(0.01)
    time.sleep(0.1)
    return server.log[before:]


@contextlib.contextmanager
def locked(folder):
    """Nobody can write the store meanwhile; within 5 s that is no fault."""
    with contextlib.closing(sqlite3.connect(folder / "sessions.sqlite", isolation_level=None)) as file:
        file.execute("BEGIN IMMEDIATE")
        yield
        file.execute("ROLLBACK")


def until_made(server):
    """Returns when the edit is made, and waits for the store."""
    while server.info(status=True).status.sessions[0].edits == 0:
        time.sleep(0.01)


def test_what_is_under_way_is_acknowledged_and_new_sessions_are_refused(launch, tmp_path):
    data = tmp_path / "data"
    server = launch("--data", str(data), "--web", "127.0.0.1:0")
    address = ready_file(server)["web"].removeprefix("http://")
    session = server.open(small_scene(), session="s", progress=False)
    session.wait()
    acknowledged = []

    def edit():
        with limber.connect(server.connection.endpoint) as other:
            acknowledged.append(other.session("s").add(node=tip_of(session), frame=20, displacement=(0, 0.1, 0)))

    with locked(data):
        waiting = threading.Thread(target=edit)
        waiting.start()
        until_made(server)
        server.process.send_signal(signal.SIGTERM)
        while server.info(status=True).status.phase != 3:
            time.sleep(0.01)
        status, _, body = ask(address, "/readyz")
        assert status == 503 and b"draining" in body
        assert ask(address, "/healthz")[0] == 200
        with pytest.raises(limber.ServerStopped, match="draining") as refused:
            server.connection.call("open_session", service.OpenSessionRequest(session="t"), timeout=1)
        assert refused.value.details == {"send_again": "true"}, "the next run may open it"
        assert session.status().revision == 1, "what is open goes on"
        assert not acknowledged
    waiting.join(20)
    assert acknowledged and server.process.wait(20) == 0
    assert "drained after" in server.log and "not acknowledged" not in server.log
    again = launch("--data", str(data))
    assert again.session("s").status().revision == 1


def test_edits_that_never_cease_do_not_hold_up_a_drain_and_none_is_lost(launch, tmp_path):
    data = tmp_path / "data"
    server = launch("--data", str(data), "--drain-seconds", "3600")
    session = server.open(small_scene(), session="s", progress=False)
    held = session.add(node=tip_of(session), frame=20, displacement=(0, 0.1, 0))
    acknowledged, refused = [0, 0, 0], []

    def drag(number):
        with limber.connect(server.connection.endpoint) as other:
            dragged = other.session("s")
            try:
                for step in range(100_000):
                    acknowledged[number] = dragged.move(held.id, (0, 0.1 + 1e-6 * step, 0)).revision
            except limber.LimberError as error:
                refused.append(error.code)

    threads = [threading.Thread(target=drag, args=(number,)) for number in range(3)]
    for thread in threads:
        thread.start()
    while min(acknowledged) < 20:
        time.sleep(0.01)
    server.process.send_signal(signal.SIGTERM)
    assert server.process.wait(20) == 0
    for thread in threads:
        thread.join(20)
    assert "not acknowledged" not in server.log
    again = launch("--data", str(data))
    assert again.session("s").status().revision >= max(acknowledged) > 20
    assert len(refused) == 3 and set(refused) <= {"SHUTTING_DOWN", "TIMEOUT"}, refused


def test_a_drain_ends_in_time(launch, tmp_path):
    data = tmp_path / "data"
    server = launch("--data", str(data), "--drain-seconds", "0.2")
    session = server.open(small_scene(), session="s", progress=False)

    def edit():
        with limber.connect(server.connection.endpoint) as other, contextlib.suppress(limber.LimberError):
            other.session("s").add(node=tip_of(session), frame=20, displacement=(0, 0.1, 0))

    with locked(data):
        waiting = threading.Thread(target=edit)
        waiting.start()
        until_made(server)
        server.process.send_signal(signal.SIGTERM)
        deadline = time.monotonic() + 20
        while "1 requests are not acknowledged" not in server.log:
            assert time.monotonic() < deadline, server.log
            time.sleep(0.01)
    waiting.join(20)
    assert server.process.wait(20) == 0


def test_an_idle_server_ends_at_once(launch):
    server = launch("--drain-seconds", "3600")
    server.open(small_scene(), progress=False)
    server.process.send_signal(signal.SIGTERM)
    assert server.process.wait(20) == 0


def test_a_hangup_applies_what_can_be_changed_and_names_what_cannot(launch, config):
    server = launch("--config", config("max-sessions = 5\nthreads = 2\n"), "--max-jobs", "7")
    assert server.info().limits.sessions == 5
    config("max-sessions = 2\nthreads = 4\nlog-level = 'debug'\nmax-constraints = 1\nmax-jobs = 3\n")
    said = hang_up(server, "log-level")
    assert "max-sessions = 2, it was 5" in said and "threads = 4 needs a restart: it stays 2" in said
    assert "max-jobs" not in said, "the command line wins"
    limits = server.info().limits
    assert (limits.sessions, limits.jobs, limits.constraints) == (2, 7, 1)
    server.open(small_scene(), session="a", progress=False)
    server.open(small_scene(), session="b", progress=False)
    with pytest.raises(limber.LimberError) as refused:
        server.open(small_scene(), session="c", progress=False)
    assert refused.value.code == "LIMIT_EXCEEDED" and "the limit of 2" in str(refused.value)
    assert " debug " in server.log and "refused: ERROR_CODE_LIMIT_EXCEEDED" in server.log
    config("max-sessions = 3\n")
    hang_up(server, "max-sessions = 3, it was 2")
    server.open(small_scene(), session="c", progress=False)
    assert "no option has changed" in hang_up(server)


@pytest.mark.parametrize("text, words", [("max-sessions = 0\n", "--max-sessions: must be > 0"),
                                         ("max-sessions = 4\nnonsense = 1\n", "there is no option 'nonsense'")])
def test_a_file_that_is_wrong_changes_nothing(launch, config, text, words):
    server = launch("--config", config("max-sessions = 5\n"))
    config(text)
    said = hang_up(server)
    assert "everything stays as it was" in said and words in said
    assert server.info().limits.sessions == 5
    assert server.process.poll() is None


class Listener:
    """Every message of the topic `session/s/status`, by a plain socket whose queue has no bound."""

    def __init__(self, server):
        self.socket = zmq.Context.instance().socket(zmq.SUB)
        self.socket.rcvhwm = 0
        self.socket.connect(server.info().stream_endpoint)
        self.socket.subscribe("session/s/status")
        self.numbers, self.revision = [], 0

    def until(self, is_done):
        deadline = time.monotonic() + 30
        while not is_done():
            assert time.monotonic() < deadline, self.numbers
            if not self.socket.poll(20):
                continue
            _, payload = self.socket.recv_multipart()
            message = stream.StreamMessage.FromString(payload)
            self.numbers.append(message.sequence)
            self.revision = message.status.result.revision

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        self.socket.close(0)


def test_subscribers_keep_their_places_over_hangups(launch, config):
    server = launch("--config", config("max-sessions = 5\n"))
    session = server.open(small_scene(), session="s", progress=False)
    session.wait()
    with Listener(server) as listener:
        listener.until(lambda: listener.numbers)
        for step in range(1, 31):
            if step % 6 == 0:
                config(f"max-sessions = {step}\n")
                hang_up(server, f"max-sessions = {step}")
            session.add(node=tip_of(session), frame=20, displacement=(0, 0.001 * step, 0))
        session.wait()
        listener.until(lambda: listener.revision == 30)
        numbers = listener.numbers
    assert len(numbers) >= 10
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))


def test_lines_of_the_log_are_json_where_that_is_asked_for(launch):
    server = launch("--log-format", "json", "--log-level", "debug")
    session = server.open(small_scene(), session="s", progress=False)
    with pytest.raises(limber.LimberError):
        session.add(node=10**6, frame=20, displacement=(0, 0.1, 0))
    server.process.send_signal(signal.SIGTERM)
    assert server.process.wait(20) == 0
    lines = [json.loads(line) for line in server.log.splitlines()]
    for line in lines:
        assert list(line)[:3] == ["time", "level", "message"]
        assert time.strptime(line["time"], "%Y-%m-%dT%H:%M:%S." + line["time"][20:23] + "Z")
        assert line["level"] in ("error", "warn", "info", "debug")
    assert [line for line in lines if line.get("session") == "s" and "opened" in line["message"]]
    refused, = [line for line in lines if "refused" in line["message"]]
    assert refused["error"] == "ERROR_CODE_OUT_OF_RANGE" and refused["field"] and int(refused["client"]) > 0


def test_other_signals_end_nothing(launch):
    """SIGUSR1 says how the server does, SIGUSR2 nothing."""
    server = launch()
    server.open(small_scene(), progress=False).wait()
    server.process.send_signal(signal.SIGUSR2)
    server.process.send_signal(signal.SIGUSR1)
    deadline = time.monotonic() + 20
    while "status: up" not in server.log:
        assert time.monotonic() < deadline, server.log
        time.sleep(0.01)
    assert "sessions: 1 in memory" in server.log
    assert server.info().server_version and server.process.poll() is None
