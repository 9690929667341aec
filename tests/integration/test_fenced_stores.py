"""What limberd acknowledges is kept: where another one writes to its folder, or files of it go, it acknowledges nothing more."""

import contextlib
import os
import shutil
import signal
import sqlite3
import subprocess
import time

import limber
import pytest
from conftest import small_scene
from limber.launching import find_binary
from test_restarts import Restartable
from test_stored_sessions import folder, kept, server  # noqa: F401


def edited(server, count):
    """A session of so many edits, its constraint, and what it was moved to last."""
    session = server.open(small_scene(), session="bar", progress=False)
    held = session.add(node=0, frame=20, displacement=(0, 0.1, 0))
    for step in range(count - 1):
        held.move((0, 0.1 + 0.01 * step, 0))
    assert session.status().revision == count
    return held


def test_of_two_servers_on_a_folder_one_acknowledges(kept, server, limberd, tmp_path, cache_dir, folder):  # noqa: F811
    held = edited(server, 3)
    os.remove(folder / "lock")
    (tmp_path / "second").mkdir()
    second = Restartable(limberd, tmp_path / "second", cache_dir, "--data", str(folder))
    try:
        with limber.connect(second.endpoint) as other:
            assert other.session("bar").undo().revision == 4
            for _ in range(2):
                with pytest.raises(limber.LimberError, match="another limberd has begun to write"):
                    held.move((0, 0.5, 0))
            assert "another limberd" in server.info().store.fault and not other.info().store.fault
            with pytest.raises(limber.LimberError, match="another limberd"):
                server.open(small_scene(), session="new", progress=False)
            assert other.session("bar").redo().revision == 5
        second.restart()
        with limber.connect(second.endpoint) as other:
            assert other.session("bar").status().revision == 5, "what the second one has acknowledged, and no more"
    finally:
        second.close()


def test_without_its_log_nothing_is_acknowledged_and_nothing_is_lost(kept, server, folder):  # noqa: F811
    held = edited(server, 3)
    os.remove(folder / "sessions.sqlite-wal")
    for _ in range(2):
        with pytest.raises(limber.LimberError, match="sessions.sqlite-wal was removed"):
            held.move((0, 0.5, 0))
    assert "was removed" in server.info().store.fault
    kept.restart(signal.SIGKILL)
    assert server.session("bar").status().revision == 3
    assert server.session("bar").undo().revision == 4, "a server that is started again stores again"


def moved(held):
    try:
        held.move((0, 0.2, 0))
    except limber.LimberError as error:
        assert error.code == "IO"
        return False
    return True


def test_a_lock_of_another_process_is_an_error_that_passes(kept, server, folder):  # noqa: F811
    held = edited(server, 2)
    with contextlib.closing(sqlite3.connect(folder / "sessions.sqlite", isolation_level=None)) as file:
        file.execute("BEGIN IMMEDIATE")
        for said in ("the change is made", "nothing was changed", "nothing was changed"):
            began = time.monotonic()
            with pytest.raises(limber.LimberError, match=f"{said}.*another process holds it"):
                held.move((0, 0.2, 0))
            assert time.monotonic() - began < 2.5, "an edit waits for at most 2 s"
            assert server.session("bar").status().revision == 3
        file.execute("ROLLBACK")
    while not moved(held):  # the store tries again by itself
        time.sleep(0.1)
    kept.restart(signal.SIGKILL)
    assert server.session("bar").status().revision == 4, "what was made is stored now, and what was refused is not there"


# --- Copies


def limber_says(*arguments, code=0):
    process = subprocess.run([str(find_binary("limber")), *map(str, arguments)], capture_output=True, text=True, timeout=60)
    assert process.returncode == code, process.stderr
    return process.stdout if code == 0 else process.stderr


def test_a_copy_of_a_running_server_is_a_store(kept, server, folder, tmp_path):  # noqa: F811
    held = edited(server, 5)
    copy = tmp_path / "copy.sqlite"
    assert "1 session," in limber_says("backup", folder, copy)
    held.move((0, 0.5, 0))
    assert "--replace" in limber_says("backup", folder, copy, code=1)
    assert '"sessions": "1"' in limber_says("--json", "backup", "--replace", folder, copy)
    held.move((0, 0.6, 0))
    kept.end()
    shutil.rmtree(folder)
    folder.mkdir()
    shutil.copy(copy, folder / "sessions.sqlite")
    kept.start()
    assert server.session("bar").status().revision == 6
    assert "there is no store in" in limber_says("backup", tmp_path, tmp_path / "other", code=1)
