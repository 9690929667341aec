"""limberd dies and is started again at the same address, where a stranger takes the same name for a session."""

import json
import os
import signal
import socket
import subprocess
import threading
import time

import limber
import pytest
import zmq
from conftest import small_scene, tip_of
from limber.connection import Connection
from limber.launching import find_binary
from limber.messages import service
from limber.server import Server


class Restartable:
    """A limberd at one address, again and again."""

    def __init__(self, limberd, folder, cache_dir, *arguments):
        with socket.socket() as one, socket.socket() as other:  # both at once: they are two
            for free in (one, other):
                free.bind(("127.0.0.1", 0))
            ports = [free.getsockname()[1] for free in (one, other)]
        self.endpoint, stream = (f"tcp://127.0.0.1:{port}" for port in ports)
        self.ready = folder / "ready"
        self.command = [str(limberd), "--bind", self.endpoint, "--stream", stream, "--ready-file", str(self.ready),
                        "--cache-dir", str(cache_dir), *arguments]
        self.log = open(folder / "log", "ab")
        self.start()

    def start(self):
        self.ready.unlink(missing_ok=True)
        self.process = subprocess.Popen(self.command, stdout=self.log, stderr=self.log)
        deadline = time.monotonic() + 30
        while not self.ready.exists():
            assert self.process.poll() is None and time.monotonic() < deadline
            time.sleep(0.01)
        self.instance = json.loads(self.ready.read_text())["instance"]

    def end(self, sign=signal.SIGKILL):
        self.process.send_signal(sign)
        self.process.wait(20)

    def restart(self, sign=signal.SIGKILL, gap=0.0):
        self.end(sign)
        time.sleep(gap)
        self.start()

    def close(self):
        if self.process.poll() is None:
            self.end()
        self.log.close()


@pytest.fixture
def limberd_at(limberd, tmp_path, cache_dir):
    running = Restartable(limberd, tmp_path, cache_dir)
    yield running
    running.close()


@pytest.fixture
def storing_at(limberd, tmp_path, cache_dir):
    running = Restartable(limberd, tmp_path, cache_dir, "--data", str(tmp_path / "data"), "--allow-shutdown")
    yield running
    running.close()


def test_a_script_goes_on_behind_orderly_restarts(storing_at):
    with limber.connect(storing_at.endpoint) as server:
        session = server.open(small_scene(), session="cup", progress=False)
        held = session.add(node=tip_of(session), frame=30, displacement=(0, 0.1, 0))
        revision = session.revision

        def restart():
            storing_at.end(signal.SIGTERM)
            time.sleep(0.15)
            storing_at.start()

        for _ in range(3):
            restarting = threading.Thread(target=restart)
            restarting.start()
            while restarting.is_alive():
                made = held.move((0, 0.1 + 1e-6 * revision, 0)).revision
                assert made == revision + 1, "each is made once"
                revision = made
            restarting.join()
        assert session.wait().revision == revision >= 4, "one at least of each run"


@pytest.fixture
def building_at(limberd, tmp_path):
    """One that has no models yet."""
    running = Restartable(limberd, tmp_path, tmp_path / "models", "--data", str(tmp_path / "data"))
    yield running
    running.close()


@pytest.mark.timeout(240)  # a build, a silence of 9 s, and the build once more, beside other tests
def test_sessions_are_opened_over_orderly_restarts(building_at):
    with limber.connect(building_at.endpoint) as server:
        begun = server.open(sample="flower", session="begun", progress=False, wait=False)
        assert begun.status().state == service.SESSION_STATE_BUILDING
        restarting = threading.Thread(target=building_at.restart, args=(signal.SIGTERM, 9.0))
        restarting.start()
        assert begun.wait_ready(progress=False, timeout=120).state == service.SESSION_STATE_READY
        assert begun.job == 0, "it ended with its run"
        opened = 0
        while restarting.is_alive() or opened < 1:
            server.open(small_scene(), session=f"s{opened}", progress=False).close()
            opened += 1
        restarting.join()


def test_the_command_line_goes_on_behind_orderly_restarts(storing_at, tmp_path):
    limber_binary = str(find_binary("limber"))
    environment = dict(os.environ, LIMBER_ENDPOINT=storing_at.endpoint)

    def run(*arguments, **options):
        return subprocess.Popen([limber_binary, *map(str, arguments)], env=environment, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True, **options)

    def done(process):
        out, errors = process.communicate(timeout=60)
        assert process.returncode == 0, errors
        return out

    with limber.connect(storing_at.endpoint) as server:
        made = server.open(small_scene(), session="made", progress=False)
        tip = tip_of(made)
        [scene] = [path for path in made.export(tmp_path / "saved", formats=("scene",)) if str(path).endswith(".json")]
    done(run("open", scene, "--session", "cup"))
    watching = run("watch", "cup", "--count", 1000, "--silence", 15)
    waiting = run("wait", "cup", "--revision", 2, "--wait", 120)
    time.sleep(1.0)  # both have begun
    edits = 0
    for gap in (0.0, 8.5):  # a silence that long ends what awaits no other run
        restarting = threading.Thread(target=storing_at.restart, args=(signal.SIGTERM, gap))
        restarting.start()
        while restarting.is_alive():
            done(run("open", scene, "--session", f"next{edits}", "--timeout", 30, "--connect-timeout", 30))
            done(run("list", "--timeout", 30, "--connect-timeout", 30))
            done(run("add", "--timeout", 30, "--connect-timeout", 30, "cup", "--node", tip, "--frame", 30 + edits, "--displacement", 0, 0.1, 0))
            edits += 1
        restarting.join()
    done(run("add", "cup", "--node", tip, "--frame", 20, "--displacement", 0, 0.1, 0))
    done(waiting)
    seen, errors = watching.communicate(timeout=60)
    assert watching.returncode == 4 and "no result for 15" in errors
    revisions = [int(line.split()[0]) for line in seen.splitlines() if line.split()[:1] and line.split()[0].isdigit()]
    assert revisions[-1] == edits + 1 and revisions == sorted(revisions)


def test_an_edit_under_way_at_a_kill_is_sent_to_the_next_run(storing_at, tmp_path):
    """As soon as that is there, not after half of the request's time."""
    with limber.connect(storing_at.endpoint) as server:
        session = server.open(small_scene(), session="cup", progress=False)
        held = session.add(node=tip_of(session), frame=30, displacement=(0, 0.1, 0))
        script = tmp_path / "edits.json"
        script.write_text("\n".join(json.dumps({"move": {"id": str(held.id), "target": {"y": 0.1 + 1e-4 * i}}})
                                    for i in range(400)))
        begin = time.monotonic()
        editing = subprocess.Popen([str(find_binary("limber")), "--endpoint", storing_at.endpoint, "--timeout", "60",
                                    "edit-script", "cup", str(script), "--wait", "none"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        while session.status().revision < 20:
            time.sleep(0.005)
        storing_at.restart()
        _, errors = editing.communicate(timeout=60)
        assert editing.returncode == 0, errors
        assert session.status().revision == 401
        assert time.monotonic() - begin < 25, "half of 60 s"


def test_who_waits_gets_the_result_from_the_next_run(storing_at):
    with limber.connect(storing_at.endpoint) as server, limber.connect(storing_at.endpoint) as other:
        session = server.open(small_scene(), session="cup", progress=False)
        session.wait()
        found = []
        waiting = threading.Thread(target=lambda: found.append(session.wait(revision=1).revision))
        waiting.start()
        while server.info().counters["open_requests"] < 2:  # with this one
            time.sleep(0.01)
        storing_at.restart(signal.SIGTERM, 9.0)
        tip = tip_of(session)
        other.session("cup").add(node=tip, frame=30, displacement=(0, 0.1, 0))
        waiting.join(45)
        assert found == [1]


def test_a_server_that_is_stopped_on_purpose_says_so_at_once(storing_at):
    with limber.connect(storing_at.endpoint) as server, limber.connect(storing_at.endpoint) as other:
        session = server.open(small_scene(), session="cup", progress=False)
        threading.Timer(0.5, other.shutdown).start()
        begin = time.monotonic()
        with pytest.raises(limber.ServerStopped):
            session.wait(revision=99, timeout=60)
        assert time.monotonic() - begin < 2.5, "not only when it is seen to be silent"


def test_where_no_other_run_comes_the_refusal_is_told_in_time(storing_at, monkeypatch):
    monkeypatch.setattr("limber.connection.NEXT_RUN", 6.0)
    with limber.connect(storing_at.endpoint) as server:
        session = server.open(small_scene(), session="cup", progress=False)
        threading.Timer(0.5, lambda: storing_at.process.send_signal(signal.SIGTERM)).start()
        begin = time.monotonic()
        with pytest.raises(limber.ServerStopped, match="going down"):
            session.wait(revision=99, timeout=60)
        assert time.monotonic() - begin < 16, "not only at the end of the wait"


def test_a_stale_handle_never_reaches_a_strangers_session(limberd_at, tmp_path):
    with limber.connect(limberd_at.endpoint) as server:
        session = server.open(small_scene(), session="cup", progress=False)
        assert server.info().instance == limberd_at.instance
        held = session.add(node=tip_of(session), frame=30, displacement=(0, 0.1, 0))
        limberd_at.restart()
        with limber.connect(limberd_at.endpoint) as elsewhere:
            stranger = elsewhere.open(small_scene(), session="cup", progress=False)
            server.info()  # that the client has heard of the new run makes no difference
            attempts = [lambda: held.move((0, 0.2, 0)), session.undo, session.status, session.wait, session.frames,
                        session.cancel, session.solve_cold, lambda: session.export(tmp_path), session.constraints,
                        lambda: session.stream(), session.close]
            for attempt in attempts * 2:
                with pytest.raises(limber.ServerRestarted, match="it was restarted"):
                    attempt()
            assert stranger.status().revision == 0
            assert stranger.status().state == service.SESSION_STATE_READY
            assert stranger.uid != session.uid
        # The same client continues with the new run.
        opened = server.open(small_scene(), session="bowl", progress=False)
        opened.add(node=tip_of(opened), frame=30, displacement=(0, 0.1, 0))
        assert opened.wait().revision == 1
        with pytest.raises(limber.ServerRestarted):
            session.status()


def test_jobs_of_before_are_distinguished_from_those_of_strangers(limberd_at):
    with limber.connect(limberd_at.endpoint) as server:
        session = server.open(small_scene(), session="cup", progress=False)
        job = session.solve_cold()
        limberd_at.restart()
        with limber.connect(limberd_at.endpoint) as elsewhere:
            elsewhere.open(small_scene(), session="cup", progress=False).solve_cold()
            assert job not in [one.job for one in elsewhere.jobs()]
            for _ in range(2):
                with pytest.raises(limber.ServerRestarted, match=f"job {job} is of another run"):
                    server.wait_job(job)
                with pytest.raises(limber.ServerRestarted):
                    server.cancel_job(job)
            with pytest.raises(limber.LimberError) as caught:
                elsewhere.wait_job(7)
            assert caught.value.code == "NOT_FOUND"


@pytest.mark.parametrize("name_is_taken", [True, False])
def test_a_stream_says_that_the_server_was_restarted(limberd_at, monkeypatch, name_is_taken):
    monkeypatch.setattr(limber.stream, "SILENCE", 1.0)
    with limber.connect(limberd_at.endpoint) as server:
        session = server.open(small_scene(), session="cup", progress=False)
        stream = session.stream()
        assert stream.next(10).result.revision == 0
        limberd_at.restart()
        with limber.connect(limberd_at.endpoint) as elsewhere:
            elsewhere.open(small_scene(), session="cup" if name_is_taken else "bowl", progress=False)
            with pytest.raises(limber.ServerRestarted, match="restarted"):
                while True:  # what was in transit before comes first
                    assert stream.next(20).result.sequence <= 4  # with what was found out about it


def test_a_wait_says_that_the_server_was_restarted(limberd_at, monkeypatch):
    monkeypatch.setattr(limber.connection, "SILENCE", 0.5)
    with limber.connect(limberd_at.endpoint) as server:
        session = server.open(small_scene(), session="cup", progress=False)
        threading.Timer(1, limberd_at.restart).start()
        start = time.monotonic()
        with pytest.raises((limber.ServerRestarted, limber.ServerUnreachable)):  # the latter: asked amid the restart
            session.wait(revision=99, timeout=60)
        assert time.monotonic() - start < 20


def test_a_stream_says_that_the_server_was_stopped(limberd_at):
    with limber.connect(limberd_at.endpoint) as server:
        stream = server.open(small_scene(), session="cup", progress=False).stream(snapshot=False)
        limberd_at.end(signal.SIGTERM)
        with pytest.raises(limber.ServerUnreachable) as caught:
            while True:
                stream.next(20)
        assert caught.value.code == "SHUTTING_DOWN" and "session cup with it" in str(caught.value)


def test_a_stream_ends_when_its_session_is_closed_and_its_name_taken(launch):
    server = launch()
    session = server.open(small_scene(), session="cup", progress=False)
    stream = session.stream(snapshot=False)
    session.close()
    again = server.open(small_scene(), session="cup", progress=False)
    assert all(frames.result.sequence <= 4 for frames in stream)  # ends: none of them is waited for
    with pytest.raises(limber.LimberError) as caught:
        session.status()
    assert caught.value.code == "NOT_FOUND" and "another one has its name" in str(caught.value)
    assert server.session("cup").uid == again.uid != session.uid
    assert server.session(again.reference).id == "cup"


class LosesReplies:
    """Between a client and limberd: hands on everything but the first reply to an edit."""

    def __init__(self, endpoint, folder):
        self.endpoint = f"ipc://{folder}/lossy"
        self._context = zmq.Context()
        self._front, self._back = self._context.socket(zmq.ROUTER), self._context.socket(zmq.DEALER)
        self._front.bind(self.endpoint)
        self._back.connect(endpoint)
        self.edits = self.lost = 0
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self):
        while not self._stop.is_set():
            if self._front.poll(5):
                parts = self._front.recv_multipart()
                self.edits += service.Request.FromString(parts[-1]).HasField("edit")
                self._back.send_multipart([parts[0], b"", parts[-1]])
            while self._back.poll(0):
                parts = self._back.recv_multipart()
                if service.Reply.FromString(parts[-1]).HasField("edit") and self.lost == 0:
                    self.lost = 1
                else:
                    self._front.send_multipart(parts)

    def close(self):
        self._stop.set()
        self._thread.join()
        self._context.destroy(linger=0)


def test_an_edit_whose_answer_is_lost_is_applied_once(launch, tmp_path):
    server = launch()
    session = server.open(small_scene(), session="cup", progress=False)
    lossy = LosesReplies(server.connection.endpoint, tmp_path)
    try:
        with Server(Connection(lossy.endpoint, timeout=4.0)) as behind:
            receipt = behind.session("cup").add(node=tip_of(session), frame=30, displacement=(0, 0.1, 0))
    finally:
        lossy.close()
    assert (lossy.edits, lossy.lost) == (2, 1)
    assert receipt.id > 0 and session.status().revision == 1 and len(session.constraints()) == 1
    assert server.info().counters["repeated_requests"] == 1


def limber_command(*arguments):
    return [str(find_binary("limber")), *arguments]


def test_limber_watch_says_that_the_server_was_restarted(limberd_at):
    with limber.connect(limberd_at.endpoint) as server:
        server.open(small_scene(), session="cup", progress=False)
    watching = subprocess.Popen(limber_command("--endpoint", limberd_at.endpoint, "watch", "cup"), text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=dict(os.environ, LC_ALL="C"))
    watching.stdout.readline()
    limberd_at.restart()
    with limber.connect(limberd_at.endpoint) as elsewhere:
        elsewhere.open(small_scene(), session="cup", progress=False)
        _, printed = watching.communicate(timeout=30)
    assert watching.returncode == 1
    assert "restarted: sessions and jobs of before are gone" in printed and "[RESTARTED]" in printed


def test_limber_takes_sessions_with_their_uid(limberd_at):
    def run(*arguments):
        return subprocess.run(limber_command("--endpoint", limberd_at.endpoint, *arguments), capture_output=True, text=True,
                              timeout=30)

    with limber.connect(limberd_at.endpoint) as server:
        reference = server.open(small_scene(), session="cup", progress=False).reference
    assert run("show", reference).returncode == 0
    assert json.loads(run("--json", "show", "cup").stdout)["status"]["uid"] == reference.partition("@")[2]
    limberd_at.restart()
    with limber.connect(limberd_at.endpoint) as elsewhere:
        stranger = elsewhere.open(small_scene(), session="cup", progress=False)
        refused = run("close", reference)
        assert refused.returncode == 1 and "[RESTARTED]" in refused.stderr
        assert stranger.status().state == service.SESSION_STATE_READY
