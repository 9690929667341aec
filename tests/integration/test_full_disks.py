"""A disk without any room left: limberd starts on it, what is stored can be read, and sessions that go make room."""

import contextlib
import signal
import subprocess
import time

import limber
import pytest
from conftest import small_scene, tip_of
from limber.messages import service
from test_restarts import Restartable


class SmallDisk:
    """6 MB, of which others may take what is left."""

    def __init__(self, folder):
        self.folder = folder
        folder.mkdir()
        made = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=6m", "tmpfs", str(folder)], capture_output=True, text=True)
        if made.returncode != 0:
            folder.rmdir()
            pytest.skip(f"no disk of its own can be mounted: {made.stderr.strip()}")
        self.data, self.filler = folder / "data", folder / "filler"

    def fill(self):
        with contextlib.suppress(OSError), open(self.filler, "ab", buffering=0) as file:
            while True:
                file.write(bytes(1024))

    def close(self):
        subprocess.run(["umount", str(self.folder)], check=True)


@pytest.fixture
def disk(tmp_path):
    mounted = SmallDisk(tmp_path / "disk")
    yield mounted
    mounted.close()


@pytest.fixture
def kept(disk, limberd, tmp_path, cache_dir):
    running = Restartable(limberd, tmp_path, cache_dir, "--data", str(disk.data))
    yield running
    running.close()


@pytest.fixture
def server(kept):
    with limber.connect(kept.endpoint) as connected:
        for name in ("bar", "other"):
            session = connected.open(small_scene(), session=name, progress=False)
            session.add(node=tip_of(session), frame=20, displacement=(0, 0.1, 0))
            session.wait()
        yield connected


def edit_until_refused(disk, session):
    """Returns the newest acknowledged revision. What the log of the store frees is taken from it, too."""
    for _ in range(1000):
        disk.fill()
        revision = session.status().revision
        try:
            session.add(node=tip_of(session), frame=21, displacement=(0, 0.1, 0))
        except limber.LimberError as error:
            assert error.code == "IO" and "full" in str(error)
            return revision
    raise AssertionError("the disk has room without end")


def until_writable(server):
    deadline = time.monotonic() + 30
    while server.info().store.fault and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not server.info().store.fault


@pytest.mark.parametrize("has_reserve", [True, False])
def test_a_server_that_was_killed_starts_on_a_full_disk(disk, kept, server, tmp_path, has_reserve):
    revision = edit_until_refused(disk, server.session("bar"))
    kept.end()
    if not has_reserve:
        (disk.data / "sessions.reserve").unlink()
    disk.fill()
    kept.start()
    assert "full" in server.info().store.fault, "known before anybody asks for a change"
    assert {one.session: one.state for one in server.sessions()} == dict.fromkeys(("bar", "other"), service.SESSION_STATE_PARKED)
    with pytest.raises(limber.LimberError, match="nothing was changed"):
        server.session("other").undo()
    server.save_session("bar", tmp_path / "bar.limber")
    assert (tmp_path / "bar.limber").stat().st_size > 0
    back = server.session("bar")
    assert back.wait().converged and back.status().revision == revision
    disk.filler.unlink()
    until_writable(server)
    back.undo()
    kept.restart()
    assert server.session("bar").status().revision == revision + 1


def test_a_server_that_ended_in_order_starts_on_a_full_disk(disk, kept, server):
    kept.end(signal.SIGTERM)
    disk.fill()
    kept.start()
    assert {one.session for one in server.sessions()} == {"bar", "other"}
    assert server.session("bar").wait().converged


@pytest.mark.parametrize("large_edits", [0, 30])
def test_a_session_that_is_removed_makes_room_on_a_full_disk(disk, kept, server, limberd, tmp_path, large_edits):
    """Also one that takes more than the reserve has for its removal."""
    bar = server.session("bar")
    held = bar.constraints()[0].id
    for _ in range(large_edits):
        bar.edit([limber.move(held, (0, 0.1, 0))] * 3000)
    if large_edits:
        assert server.info().store.bytes > 2_000_000
    edit_until_refused(disk, bar)
    disk.fill()
    removed = subprocess.run([str(limberd.parent / "limber"), "--endpoint", kept.endpoint, "sessions", "remove", "bar"],
                             capture_output=True, text=True, timeout=60)
    assert removed.returncode == 0, removed.stderr
    assert "gives up its reserve" in (tmp_path / "log").read_text()
    until_writable(server)
    other = server.session("other")
    other.undo()
    revision = other.status().revision
    kept.restart()
    assert [(one.session, one.revision) for one in server.sessions()] == [("other", revision)]
    disk.filler.unlink()
    deadline = time.monotonic() + 30
    while not (disk.data / "sessions.reserve").exists() and time.monotonic() < deadline:
        server.session("other").add(node=0, frame=22, displacement=(0, 0.1, 0))
        time.sleep(0.5)
    assert (disk.data / "sessions.reserve").stat().st_blocks * 512 >= 1 << 20, "it holds its room again"


def test_changes_that_are_lost_are_an_exit_code(limberd, tmp_path, cache_dir):
    running = Restartable(limberd, tmp_path, cache_dir, "--data", str(tmp_path / "data"), "--data-bytes", "200kb")
    with contextlib.closing(running), limber.connect(running.endpoint) as server:
        session = server.open(small_scene(), session="bar", progress=False)
        held = session.add(node=tip_of(session), frame=20, displacement=(0, 0.1, 0))
        running.end(signal.SIGTERM)
        assert running.process.returncode == 0
        running.start()
        with pytest.raises(limber.LimberError, match="the change is made"):
            for _ in range(100):
                server.session("bar").edit([limber.move(held.id, (0, 0.1, 0))] * 500)
        running.end(signal.SIGTERM)
        assert running.process.returncode == 1
        assert "1 changes of sessions are lost" in (tmp_path / "log").read_text()


def test_an_opening_that_cannot_be_stored_says_that_nothing_was_opened(limberd, tmp_path, cache_dir):
    running = Restartable(limberd, tmp_path, cache_dir, "--data", str(tmp_path / "data"), "--data-bytes", "300kb")
    with contextlib.closing(running), limber.connect(running.endpoint) as server:
        server.open(small_scene(), session="bar", progress=False)
        server.save_session("bar", tmp_path / "bar.limber")
        with pytest.raises(limber.LimberError, match="nothing was opened"):
            for copy in range(100):
                server.restore_session(tmp_path / "bar.limber", session=f"imported{copy}")
        with pytest.raises(limber.LimberError, match="nothing was"):
            for copy in range(100):
                server.open(small_scene(), session=f"opened{copy}", progress=False)
