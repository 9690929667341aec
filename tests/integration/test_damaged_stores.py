"""Stores with bytes that nobody wrote: named, and nothing else is brought back as what was."""

import contextlib
import os
import signal
import sqlite3
import subprocess
import sys
import time

import limber
import pytest
from conftest import ROOT, small_scene, tip_of
from test_restarts import Restartable
from test_stored_sessions import folder, kept, server, settle  # noqa: F401 (fixtures)


def flip_bit(folder, table, column, name):
    """In the middle of what is stored of that session."""
    with contextlib.closing(sqlite3.connect(folder / "sessions.sqlite")) as file, file:
        (uid,) = file.execute("SELECT uid FROM sessions WHERE name = ?", (name,)).fetchone()
        content = file.execute(f"SELECT {column} FROM {table} WHERE uid = ?", (uid,)).fetchall()[-1][0]
        changed = bytearray(content)
        changed[len(changed) // 2] ^= 4
        assert file.execute(f"UPDATE {table} SET {column} = ? WHERE uid = ? AND {column} = ?",
                            (bytes(changed), uid, content)).rowcount == 1


def wait_for_checkpoint(folder, name, revision):
    """In the file, and without the edits that it stands for: it is written behind their acknowledgements."""
    deadline = time.monotonic() + 30
    found = None
    while found != (revision, 0):
        assert time.monotonic() < deadline, found
        time.sleep(0.02)
        with contextlib.closing(sqlite3.connect(folder / "sessions.sqlite")) as file:
            found = file.execute("SELECT c.revision, (SELECT count(*) FROM edits e WHERE e.uid = c.uid AND e.revision <= c.revision) "
                                 "FROM checkpoints c JOIN sessions s USING(uid) WHERE s.name = ?", (name,)).fetchone()


def test_a_damaged_session_is_named_and_the_others_come_back(kept, server, folder):
    for name in ("first", "second"):
        server.open(small_scene(), session=name, progress=False)
    kept.end()
    with contextlib.closing(sqlite3.connect(folder / "sessions.sqlite")) as file, file:
        file.execute("UPDATE sessions SET scene = x'ff00ff' WHERE name = 'first'")
    kept.start()
    with pytest.raises(limber.LimberError, match="session 'first' is stored and could not be brought back"):
        server.session("first")
    assert server.session("second").wait().converged
    assert {one.session for one in server.sessions()} == {"first", "second"}


@pytest.mark.parametrize(("table", "column", "what"), [
    ("sessions", "scene", "its scene is damaged"),
    ("edits", "edit", "its edit 3 is damaged"),
    ("checkpoints", "checkpoint", "its checkpoint is damaged")])
def test_a_flipped_bit_is_named_and_the_others_come_back(limberd, tmp_path, cache_dir, folder, table, column, what):
    running = Restartable(limberd, tmp_path, cache_dir, "--data", str(folder), "--checkpoint-edits", "2")
    with limber.connect(running.endpoint) as server:
        for name in ("first", "second"):
            session = server.open(small_scene(), session=name, progress=False)
            for frame in (10, 15):
                session.add(node=tip_of(session), frame=frame, displacement=(0, 0.1, 0))
            wait_for_checkpoint(folder, name, 2)
            session.add(node=tip_of(session), frame=20, displacement=(0, 0.1, 0))
            session.wait()
        settle(server)
        running.end()
        flip_bit(folder, table, column, "first")
        running.start()
        for ask in (lambda: server.session("first"), lambda: server.save_session("first", tmp_path / "first")):
            with pytest.raises(limber.LimberError, match=f"{what} in the store") as refused:
                ask()
            assert refused.value.code == "IO"
        assert server.session("second").wait().revision == 3
    running.close()


def test_a_damaged_answer_is_solved_again(kept, server, folder, tmp_path):
    """Its session, of which no edit is lost, is there."""
    session = server.open(small_scene(), session="bar", progress=False)
    session.add(node=tip_of(session), frame=20, displacement=(0, 0.4, 0))
    shown = session.wait()
    server.open(small_scene(frames=9), session="short", progress=False)
    settle(server)

    def exchange(answer):
        with contextlib.closing(sqlite3.connect(folder / "sessions.sqlite")) as file, file:
            changed = file.execute(f"UPDATE answers SET answer = {answer} WHERE uid = "
                                   "(SELECT uid FROM sessions WHERE name = 'bar')")
            assert changed.rowcount == 1

    shortest = "(SELECT answer FROM answers ORDER BY length(answer) LIMIT 1)"

    def exchange_unsealed():
        """As an earlier server may have left it: it can be read, and does not fit."""
        with contextlib.closing(sqlite3.connect(folder / "sessions.sqlite")) as file, file:
            file.execute("DELETE FROM seals")
        exchange(shortest.replace("SELECT answer", "SELECT substr(answer, 1, length(answer) - 15)"))

    left_out = "the stored answer of session bar is damaged, and left out"
    for damage, words in ((lambda: exchange("x'ff00ff'"), left_out), (lambda: flip_bit(folder, "answers", "answer", "bar"), left_out),
                          (lambda: exchange(shortest), left_out), (exchange_unsealed, "could not begin in its stored answer")):
        kept.end()
        damage()
        kept.log.truncate(0)
        kept.start()
        result = server.session("bar").wait()
        assert result.converged and result.revision == 1 and result.sequence > shown.sequence
        assert result.energy == pytest.approx(shown.energy, rel=1e-3)
        assert words in (tmp_path / "log").read_text()
        settle(server)


def test_a_database_of_others_is_left_alone(limberd, tmp_path, folder):
    folder.mkdir()
    with contextlib.closing(sqlite3.connect(folder / "sessions.sqlite")) as file, file:
        file.execute("CREATE TABLE pictures(name TEXT)")
    content = (folder / "sessions.sqlite").read_bytes()
    ended = subprocess.run([str(limberd), "--bind", "tcp://127.0.0.1:0", "--data", str(folder)],
                           capture_output=True, text=True, timeout=20)
    assert ended.returncode == 1 and "not a limberd store" in ended.stderr
    assert (folder / "sessions.sqlite").read_bytes() == content


def test_a_store_that_was_cut_off_is_not_taken_for_a_new_one(limberd, kept, server, folder):
    server.open(small_scene(), session="bar", progress=False)
    kept.end(signal.SIGTERM)
    for length in (0, 1):
        with open(folder / "sessions.sqlite", "rb+") as file:
            file.truncate(length)
        ended = subprocess.run([str(limberd), "--bind", "tcp://127.0.0.1:0", "--data", str(folder)],
                               capture_output=True, text=True, timeout=20)
        assert ended.returncode == 1 and "bring it back from a copy" in ended.stderr


def test_a_damaged_log_is_said(kept, server, folder, tmp_path):
    session = server.open(small_scene(), session="bar", progress=False)
    for _ in range(20):
        session.add(node=tip_of(session), frame=20, displacement=(0, 0.1, 0))
    kept.end()
    with open(folder / "sessions.sqlite-wal", "rb+") as file:
        file.seek(-20000, os.SEEK_END)
        byte = file.read(1)[0]
        file.seek(-20000, os.SEEK_END)
        file.write(bytes([byte ^ 1]))
    kept.start()
    assert "sessions.sqlite-wal is damaged: its last" in (tmp_path / "log").read_text()
    assert server.session("bar").status().revision < 20


def test_a_damaged_page_is_an_error_and_no_crash(kept, server, folder):
    session = server.open(small_scene(), session="bar", progress=False)
    for _ in range(60):
        session.add(node=tip_of(session), frame=20, displacement=(0, 0.1, 0))
    kept.end(signal.SIGTERM)
    file = folder / "sessions.sqlite"
    content = bytearray(file.read_bytes())
    page = int.from_bytes(content[16:18], "big")
    for at in range(page, len(content), page):
        content[at:at + 200] = os.urandom(200)
    file.write_bytes(content)
    kept.ready.unlink(missing_ok=True)
    ended = subprocess.run(kept.command, capture_output=True, text=True, timeout=20)
    assert ended.returncode == 1 and str(file) in ended.stderr and "malformed" in ended.stderr
    assert "disk is full" not in ended.stderr and (folder / "sessions.reserve").exists()


@pytest.mark.timeout(120)
def test_no_bit_that_is_flipped_changes_anything_in_silence():
    """A few of tests/chaos/flips.py."""
    script = ROOT / "tests" / "chaos" / "flips.py"
    ended = subprocess.run([sys.executable, str(script), "--trials", "20", "--seed", "3"], capture_output=True, text=True, timeout=110)
    assert ended.returncode == 0, ended.stdout + ended.stderr
