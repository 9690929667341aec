"""Clients that stop or read slowly, a disk that fills, a clock that jumps: whoever is not concerned sees no difference.

Told by what arrives and in which order, not by how long it takes."""

import contextlib
import glob
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import limber
import numpy as np
import pytest
import zmq
from conftest import small_scene, tip_of
from design_inputs import strip_scene
from limber.launching import find_binary
from limber.v1.stream_pb2 import StreamMessage
from test_restarts import Restartable

sys.path.append(str(Path(__file__).resolve().parents[1] / "chaos"))
import power  # noqa: E402

EDITS = 25


class Reader(threading.Thread):
    """Reads a session's stream and keeps which final results came."""

    def __init__(self, endpoint, name):
        super().__init__(daemon=True)
        self.server = limber.connect(endpoint)
        self.stream = self.server.session(name).stream(encoding="positions")
        self.finals, self.missed, self.frames = [], 0, {}
        self.changed = threading.Condition()
        self.start()

    def run(self):
        with contextlib.suppress(limber.LimberError):
            for item in self.stream:
                with self.changed:
                    self.missed += item.missed
                    if item.result.final and item.result.revision not in self.finals:
                        self.finals.append(item.result.revision)
                        self.frames[item.result.revision] = item.positions
                    self.changed.notify_all()

    def wait_for(self, revision):
        with self.changed:
            assert self.changed.wait_for(lambda: revision in self.finals, 30), (revision, self.finals)

    def close(self):
        self.stream.close()
        self.join(10)
        self.server.close()


def drag(session, reader, edits=EDITS):
    """Edits one by one; each result is waited for, and comes to the reader. @returns energies"""
    held = session.add(node=tip_of(session), frame=30, displacement=(0, 0.05, 0))
    energies = []
    for step in range(edits):
        held.move((0, 0.05 + 0.002 * step, 0.01))
        result = session.wait()
        assert result.converged and result.revision == session.revision
        reader.wait_for(result.revision)
        energies.append(result.energy)
    return energies


@pytest.fixture
def watched(server):
    """A session with 400 kB a motion, and somebody who reads all of its stream."""
    session = server.open(small_scene(frames=600), progress=False)
    session.wait()
    reader = Reader(server.connection.endpoint, session.id)
    yield session, reader
    reader.close()
    session.close()


def test_a_subscriber_that_reads_a_message_a_second(server, watched):
    session, reader = watched
    context, received, is_over = zmq.Context(), [], threading.Event()

    def read_slowly():
        socket = context.socket(zmq.SUB)
        socket.linger, socket.rcvhwm, socket.rcvbuf = 0, 1, 4096
        socket.subscribe(f"session/{session.id}/body/0/positions")
        socket.connect(server.stream_endpoint)
        while not is_over.wait(1):
            if socket.poll(0):
                received.append(StreamMessage.FromString(socket.recv_multipart()[1]))
        socket.close()

    slow = threading.Thread(target=read_slowly)
    slow.start()
    try:
        before = server.info().counters["forced"]
        drag(session, reader)
        deadline = time.monotonic() + 30
        while len(received) < 2 and time.monotonic() < deadline:
            time.sleep(0.1)
    finally:
        is_over.set()
        slow.join()
        context.destroy(linger=0)
    # The other one had the final frames of every revision, in order, and they are those of the session.
    assert reader.finals[-EDITS:] == list(range(session.revision - EDITS + 1, session.revision + 1))
    assert np.allclose(reader.frames[session.revision], session.frames(), atol=1e-4)
    sequences = [message.sequence for message in received]
    assert len(sequences) >= 2 and sequences == sorted(set(sequences))
    assert server.info().counters["forced"] > before, "it was so slow that messages went past it"


STOPPED = """
import sys
import limber
from limber.messages import service
endpoint, name, tip = sys.argv[1:]
with limber.connect(endpoint, timeout=120) as server:
    session = server.session(name)
    session.join()
    stream = session.stream(encoding="positions")
    print("ready", flush=True)
    for line in sys.stdin:  # of the test, once it runs again
        break
    held = session.add(node=int(tip), frame=40, displacement=(0, 0, 0.05))
    result = session.wait()
    while stream.next(60).result.revision != result.revision:
        pass
    print(session.revision, result.revision, flush=True)
"""


@pytest.mark.timeout(200)
def test_a_client_that_is_stopped(server, watched):
    """As a laptop that sleeps. LIMBER_STOPPED_SECONDS: for how long at least (5)."""
    session, reader = watched
    path = os.pathsep.join([os.path.dirname(__file__), *sys.path])
    client = subprocess.Popen([sys.executable, "-c", STOPPED, server.connection.endpoint, session.id, str(tip_of(session))],
                              env=dict(os.environ, PYTHONPATH=path), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        assert client.stdout.readline() == "ready\n"
        client.send_signal(signal.SIGSTOP)
        began = time.monotonic()
        drag(session, reader)
        while time.monotonic() < began + float(os.environ.get("LIMBER_STOPPED_SECONDS", "5")):
            time.sleep(0.1)
        revision = session.revision
        client.send_signal(signal.SIGCONT)
        output, _ = client.communicate("\n", timeout=90)
        # It goes on where the others are now.
        assert output == f"{revision + 1} {revision + 1}\n"
        reader.wait_for(revision + 1)
    finally:
        client.kill()
        client.wait()
    assert reader.finals[-EDITS - 1:] == list(range(revision - EDITS + 1, revision + 2))


@pytest.mark.timeout(120)
def test_a_disk_that_fills(tmp_path):
    """While nothing can be written, who edits is refused by name; who reads and watches another session sees nothing of it."""
    disk = power.OnDisk(tmp_path)
    with contextlib.closing(disk), limber.connect(disk.endpoint) as server, limber.connect(disk.endpoint) as other:
        edited = server.open(small_scene(), session="edited", progress=False)
        held = edited.add(node=tip_of(edited), frame=20, displacement=(0, 0.01, 0))
        other.open(strip_scene(), session="watched", progress=False)
        watched = other.session("watched")
        watched.wait()
        shape = watched.frames()
        disk.full.touch()
        codes = set()
        for step in range(20):
            try:
                held.move((0, 0.01 * step, 0))
            except limber.LimberError as error:
                codes.add(error.code)
            assert watched.wait().converged and np.allclose(watched.frames(), shape, atol=1e-6)
            assert watched.status().revision == 0
        assert codes == {"IO"} and server.info().store.fault
        assert edited.wait().converged  # what is in memory is solved on
        disk.full.unlink()
        deadline = time.monotonic() + 30
        while server.info().store.fault and time.monotonic() < deadline:
            time.sleep(0.05)
        held.move((0, 0.25, 0))
        watched.load(0, force=(0, 0, 1e-6))
        revision = edited.status().revision
        disk.cut()
        disk.start()
        (constraint,) = other.session("edited").constraints()
        assert constraint.target[1] == pytest.approx(0.25)
        assert (other.session("edited").status().revision, other.session("watched").status().revision) == (revision, 1)


class WithClock(Restartable):
    """A limberd whose wall clock is set by a file; what waits and measures uses another clock, which it leaves alone."""

    def __init__(self, folder, library, *arguments):
        self.clock = folder / "clock"
        self.set("+0")
        self.library = library
        super().__init__(find_binary("limberd"), folder, folder / "cache", *arguments)

    def set(self, offset):
        beside = self.clock.with_suffix(".new")
        beside.write_text(f"{offset}\n")
        beside.replace(self.clock)

    def start(self):
        plain = self.command
        self.command = ["/usr/bin/env", f"LD_PRELOAD={self.library}", f"FAKETIME_TIMESTAMP_FILE={self.clock}", "FAKETIME_NO_CACHE=1",
                        "FAKETIME_DONT_FAKE_MONOTONIC=1", *plain]
        try:
            super().start()
        finally:
            self.command = plain


@pytest.fixture
def clocked(tmp_path):
    found = glob.glob("/usr/lib/*/faketime/libfaketimeMT.so.1")
    if not found:
        pytest.skip("faketime (Debian) is not installed")
    running = WithClock(tmp_path, found[0], "--data", str(tmp_path / "data"), "--retain", "7")
    yield running
    running.close()


@pytest.mark.timeout(120)
def test_a_clock_that_jumps(clocked, server):
    """The same edits, at a server whose clock jumps by hours between them and at one whose clock does not."""
    offsets = ["+0", "+5h", "-3h", "+20h", "-20h", "+1h"]
    results = []
    with limber.connect(clocked.endpoint) as jumping:
        for one, is_jumping in ((server, False), (jumping, True)):
            session = one.open(small_scene(), session="clock", progress=False)
            session.join()
            reader = Reader(one.connection.endpoint, session.id)
            held = session.add(node=tip_of(session), frame=30, displacement=(0, 0.05, 0))
            seen = []
            for step, offset in enumerate(offsets * 2):
                if is_jumping:
                    clocked.set(offset)
                held.move((0, 0.05 + 0.01 * step, 0))
                result = session.wait()
                reader.wait_for(result.revision)
                status = session.status()
                seen.append((result.revision, result.converged, status.state, len(status.clients), len(one.sessions())))
            with pytest.raises(limber.LimberError) as late:
                session.wait(revision=session.revision + 1, timeout=0.3)
            seen.append(late.value.code)
            reader.close()
            results.append((seen, session.frames()))
        (plain, frames), (jumped, others) = results
        assert jumped == plain
        assert np.allclose(frames, others, atol=1e-6)
        # And over the ends of the server.
        for offset in ("+9h", "-9h"):
            clocked.set(offset)
            revision = jumping.session("clock").status().revision
            clocked.restart()
            back = jumping.session("clock")
            assert back.status().revision == revision
            back.undo()
            assert back.wait().revision == revision + 1
    server.session("clock").close()
