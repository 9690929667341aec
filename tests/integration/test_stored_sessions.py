"""limberd keeps its sessions in a folder: however it ends, what it had acknowledged comes back."""

import contextlib
import os
import random
import resource
import signal
import sqlite3
import subprocess
import threading
import time

import limber
import numpy as np
import pytest
from conftest import small_scene, tip_of
from design_inputs import strip_scene, strips, until
from limber.messages import service
from test_restarts import Restartable


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "data"


@pytest.fixture
def kept(limberd, tmp_path, cache_dir, folder):
    """A limberd with a store, to be killed."""
    running = Restartable(limberd, tmp_path, cache_dir, "--data", str(folder))
    yield running
    running.close()


@pytest.fixture
def server(kept):
    with limber.connect(kept.endpoint) as connected:
        yield connected


def settle(server):
    """Returns when answers of before are stored: they are written behind what they are of."""
    changes = -1
    while changes != (changes := server.info().store.changes):
        time.sleep(0.1)


def largest_move(one, other):
    return np.abs(one - other).max()


def brought_back(kept, server, session, shown, shape):
    """The session after a kill, whose last frame is what it was."""
    settle(server)
    kept.restart()
    again = server.session(session)
    result = again.wait(timeout=300)
    assert result.converged and result.energy == pytest.approx(shown.energy, rel=1e-6)
    assert largest_move(again.frames()[-1], shape) < 1e-5 * np.ptp(shape)
    return again


def test_a_body_comes_back_with_its_edits_and_its_answer(kept, server):
    session = server.open(small_scene(), session="bar", progress=False)
    session.add(node=tip_of(session), frame=20, displacement=(0, 0.4, 0)).move((0, 0.5, 0.1))
    shown = session.wait()
    motion = session.frames()
    settle(server)
    kept.restart()
    (status,) = server.sessions()
    assert (status.state, status.revision, status.is_stored) == (service.SESSION_STATE_PARKED, 2, True)
    again = server.session("bar")
    result = again.wait()
    assert result.converged and result.revision == 2 and result.sequence > shown.sequence
    assert result.energy == pytest.approx(shown.energy, rel=1e-6)
    assert largest_move(again.frames(), motion) < 1e-3, "of a body of 3 m, shown to 5 %"
    again.undo()
    again.undo()
    assert again.wait().energy == pytest.approx(0, abs=1e-12) and again.constraints() == []
    again.redo()
    again.redo()
    assert again.wait().energy == pytest.approx(shown.energy, rel=1e-6)


def test_a_client_that_was_there_goes_on(kept, server):
    session = server.open(small_scene(), progress=False)
    held = session.add(node=tip_of(session), frame=20, displacement=(0, 0.4, 0))
    session.wait()
    kept.restart()
    held.move((0, 0.2, 0))
    assert session.wait().revision == 2
    assert held.id == session.constraints()[0].id


def test_a_linkage_comes_back_in_its_shape(kept, server):
    session = server.open(sample="hyperboloid", session="shell", progress=False)
    session.wait(timeout=300)
    angle = session.conditions().mean_angle_degrees
    session.deploy(angle - 5)
    shown = session.wait(timeout=300)
    again = brought_back(kept, server, "shell", shown, session.frames()[-1])
    again.undo()
    assert again.conditions().mean_angle_degrees == angle and again.wait(timeout=300).converged


def test_a_beam_structure_comes_back_held_where_it_was(kept, server):
    """To hold a node where it is, is to hold it where it was then."""
    session = server.open(sample="arch", session="roof", progress=False)
    session.wait(timeout=300)
    nodes = session.frames()[-1]
    free = int(np.argmax(np.abs(nodes[:, 2])))
    session.hold(free)
    session.gravity((0, 0, -30.0))
    shown = session.wait(timeout=300)
    shape = session.frames()[-1]
    again = brought_back(kept, server, "roof", shown, shape)
    assert largest_move(again.frames()[-1][free], nodes[free]) < 1e-5 * np.ptp(shape)


def test_a_closed_session_stays_closed(kept, server):
    server.open(small_scene(), session="gone", progress=False).close()
    server.open(small_scene(), session="parked", progress=False)
    kept.restart()
    assert [one.session for one in server.sessions()] == ["parked"]
    server.session("parked").close()
    kept.restart()
    assert server.sessions() == []


def test_a_parked_session_keeps_its_name(kept, server):
    server.open(small_scene(), session="mine", progress=False)
    kept.restart()
    with pytest.raises(limber.LimberError, match="exists"):
        server.open(small_scene(), session="mine", progress=False)


def test_two_servers_do_not_share_a_folder(kept, limberd, folder):
    other = subprocess.run([str(limberd), "--bind", "tcp://127.0.0.1:0", "--stream", "tcp://127.0.0.1:0", "--data",
                            str(folder)], capture_output=True, text=True, timeout=30)
    assert other.returncode == 1 and "another server has the folder" in other.stderr


@pytest.mark.parametrize("sign, gap", [(signal.SIGTERM, 0), (signal.SIGTERM, 9), (signal.SIGKILL, 0)])
def test_a_stream_goes_on_behind_a_restart(kept, server, sign, gap):
    session = server.open(small_scene(), progress=False)
    held = session.add(node=tip_of(session), frame=20, displacement=(0, 0.1, 0))
    session.wait()
    with session.stream(timeout=20) as frames:
        assert next(frames).result.revision == 1
        kept.end(sign)
        starting = threading.Timer(gap, kept.start)
        starting.start()
        if gap:
            with pytest.raises(limber.LimberError, match="no frames"):
                while True:
                    frames.next(timeout=gap - 1)
        starting.join()
        held.move((0, 0.2, 0))
        assert next(shown for shown in frames if shown.result.revision == 2).result.revision == 2


def test_a_repeated_request_is_known_after_a_restart(kept, server):
    """A client whose reply was lost with the server repeats its request: it is not done twice."""
    session = server.open(small_scene(), session="bar", progress=False)
    edit = service.EditRequest(session="bar")
    edit.edits.add().add.constraint.MergeFrom(small_constraint(tip_of(session)))
    request = service.Request(version=1, id=77, client="a client of its own", edit=edit).SerializeToString()
    first = ask(kept.endpoint, request)
    kept.restart()
    second = ask(kept.endpoint, request)
    assert second.edit == first.edit and second.edit.revision == 1
    assert server.session("bar").status().revision == 1


def small_constraint(node):
    constraint = service.Edit().add.constraint
    constraint.frame, constraint.displacement.y = 20, 0.3
    constraint.nodes.append(node)
    return constraint


def ask(endpoint, request):
    import zmq
    with zmq.Context() as context, context.socket(zmq.DEALER) as socket:
        socket.linger = 0
        socket.connect(endpoint)
        socket.send(request)
        assert socket.poll(20_000)
        return service.Reply.FromString(socket.recv())


@pytest.mark.parametrize("seed", range(6))
def test_no_acknowledged_edit_is_lost_by_kill(kept, server, seed):
    """Killed at a random moment of a drag: what comes back is all that was acknowledged, and at most the edit besides
    that was on its way."""
    session = server.open(small_scene(), session="bar", progress=False)
    held = session.add(node=tip_of(session), frame=20, displacement=(0, 0, 0))
    acknowledged = []

    def drag():
        with contextlib.suppress(limber.LimberError), limber.connect(kept.endpoint, timeout=1) as other:
            mine = other.session("bar")
            while True:
                mine.move(held.id, (0, 1e-3 * (len(acknowledged) + 1), 0))
                acknowledged.append(mine)
    worker = threading.Thread(target=drag)
    worker.start()
    time.sleep(random.Random(seed).uniform(0.1, 0.6))
    kept.end(signal.SIGKILL)
    worker.join(60)
    kept.start()
    again = server.session("bar")
    (constraint,) = again.constraints()
    step = round(constraint.target[1] / 1e-3)
    assert step - len(acknowledged) in (0, 1) and again.status().revision == step + 1
    assert again.wait().converged


def test_a_full_disk_is_said_and_nothing_is_lost(limberd, tmp_path, cache_dir, folder):
    """The store may grow to 200 kB: edits that do not fit are refused by name, and the session goes on once they do."""
    running = Restartable(limberd, tmp_path, cache_dir, "--data", str(folder), "--data-bytes", "200kb")
    with contextlib.closing(running), limber.connect(running.endpoint) as server:
        session = server.open(small_scene(), session="bar", progress=False)
        held = session.add(node=tip_of(session), frame=20, displacement=(0, 0.1, 0))
        with pytest.raises(limber.LimberError) as refused:
            for _ in range(100):
                session.edit([limber.move(held.id, (0, 0.1, 0))] * 500)
        assert refused.value.code == "IO" and "full" in str(refused.value)
        revision = session.status().revision
        with pytest.raises(limber.LimberError, match="nothing was changed"):
            session.undo()
        assert session.wait().converged and session.status().revision == revision
        assert "full" in server.info().store.fault
        running.restart()
        again = server.session("bar")
        # The edit that was refused as not stored may be lost, those before are not.
        assert revision - 1 <= again.status().revision <= revision


def test_a_file_size_limit_of_the_system_is_a_full_disk(kept, server):
    session = server.open(small_scene(), session="bar", progress=False)
    size = server.info().store.bytes
    resource.prlimit(kept.process.pid, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))
    with pytest.raises(limber.LimberError) as refused:
        for _ in range(500):
            session.add(node=tip_of(session), frame=20, displacement=(0, 0.1, 0))
    assert refused.value.code == "IO"
    resource.prlimit(kept.process.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    deadline = time.monotonic() + 20
    while server.info().store.fault and time.monotonic() < deadline:
        time.sleep(0.05)
    session.add(node=tip_of(session), frame=21, displacement=(0, 0.1, 0))
    revision = session.status().revision
    kept.restart()
    assert server.session("bar").status().revision == revision, "what had waited is stored, too"


def test_what_is_listed_after_a_kill_is_what_was_shown(kept, server):
    session = server.open(small_scene(), session="bar", progress=False)
    for frame in (10, 15, 20):
        session.add(node=tip_of(session), frame=frame, displacement=(0, 0.1, 0))
    session.wait()
    settle(server)
    kept.restart()
    (status,) = server.sessions()
    assert status.state == service.SESSION_STATE_PARKED
    assert (status.revision, status.constraints, status.result.revision) == (3, 3, 3)
    coming = server.session("bar")
    assert coming.status().result.revision == 3
    assert coming.wait().energy == pytest.approx(status.result.total_energy, rel=1e-3)


def test_a_folder_that_cannot_be_written_is_named(limberd, tmp_path):
    (tmp_path / "file").write_text("")
    ended = subprocess.run([str(limberd), "--bind", "tcp://127.0.0.1:0", "--data", str(tmp_path / "file" / "data")],
                           capture_output=True, text=True, timeout=20)
    assert ended.returncode == 1 and str(tmp_path / "file" / "data") in ended.stderr


@pytest.mark.parametrize("what", ["folder", "file"])
def test_a_store_that_is_taken_away_is_noticed(kept, server, folder, tmp_path, what):
    session = server.open(small_scene(), session="bar", progress=False)
    held = session.add(node=tip_of(session), frame=20, displacement=(0, 0.1, 0))
    session.wait()
    settle(server)
    taken = folder if what == "folder" else folder / "sessions.sqlite"
    taken.rename(tmp_path / "elsewhere")
    with pytest.raises(limber.LimberError, match="removed or moved away"):
        held.move((0, 0.2, 0))
    with pytest.raises(limber.LimberError, match="removed or moved away"):
        server.open(small_scene(), session="other", progress=False)
    assert "removed or moved away" in server.info().store.fault
    (tmp_path / "elsewhere").rename(taken)
    for _ in range(200):
        if not server.info().store.fault:
            break
        time.sleep(0.05)
    held.move((0, 0.3, 0))
    kept.restart()
    (constraint,) = server.session("bar").constraints()
    assert constraint.target[1] == pytest.approx(0.3)


def test_a_session_goes_into_a_file_and_comes_out_of_it(kept, server, launch, tmp_path):
    session = server.open(small_scene(), session="bar", progress=False)
    session.add(node=tip_of(session), frame=20, displacement=(0, 0.4, 0))
    shown = session.wait()
    settle(server)
    server.save_session("bar", tmp_path / "bar.limber")
    elsewhere = launch("--data", str(tmp_path / "elsewhere"))
    again = elsewhere.restore_session(tmp_path / "bar.limber")
    assert again.id == "bar" and again.status().revision == 1
    assert again.wait().energy == pytest.approx(shown.energy, rel=1e-6)
    (tmp_path / "noise.limber").write_bytes(b"\xff\xff")
    with pytest.raises(limber.LimberError, match="no session that was exported"):
        elsewhere.restore_session(tmp_path / "noise.limber")
    with pytest.raises(limber.LimberError, match="exists"):
        elsewhere.restore_session(tmp_path / "bar.limber")
    whole = (tmp_path / "bar.limber").read_bytes()
    for at in range(0, len(whole), 7):  # each is refused, whatever the bit means
        (tmp_path / "flipped.limber").write_bytes(whole[:at] + bytes([whole[at] ^ 1 << at % 8]) + whole[at + 1:])
        with pytest.raises(limber.LimberError, match="no session that was exported|checksum|of form"):
            elsewhere.restore_session(tmp_path / "flipped.limber", "flipped")
    copy = elsewhere.restore_session(tmp_path / "bar.limber", "copy")
    assert copy.wait().energy == pytest.approx(shown.energy, rel=1e-6)


def test_a_server_without_a_folder_says_so(launch):
    server = launch()
    server.open(small_scene(), session="bar", progress=False)
    with pytest.raises(limber.LimberError, match="--data"):
        server.save_session("bar", "/dev/null")
    assert not server.sessions()[0].is_stored


@pytest.mark.parametrize("taken", ["by itself", "on request"])
def test_a_design_that_was_taken_comes_back(kept, server, taken):
    """Its lengths are an edit that nobody sent, or one whose values only the server knew."""
    points, edges = strips()
    drawn = np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1)
    session = server.open(strip_scene(), session="strip", progress=False)
    session.set_lengths(drawn * np.random.default_rng(17).uniform(0.99, 1.01, len(drawn)))
    session.wait()
    targets = np.array(session.shape().joints)
    session.undo()
    session.wait()
    design = session.design(targets=targets, distance_weight=1e8, flat_height=0.3)
    if taken == "by itself":
        assert design.wait().taken == 3
    else:
        until(lambda: design.info().best.holds and design.info().iteration > 2)
        design.stop()
        design.take()
    lengths = session.lengths()
    session.pin(0)
    shown = session.wait()
    settle(server)
    kept.restart()
    again = server.session("strip")
    np.testing.assert_array_equal(again.lengths(), lengths)
    assert again.status().revision == 4
    assert again.wait().energy == pytest.approx(shown.energy, rel=1e-6)
    again.undo()
    again.undo()
    assert again.lengths().size == 0, "as drawn"


def test_the_command_line_lists_exports_imports_and_removes(kept, server, limberd, tmp_path):
    def run(*arguments, code=0):
        ended = subprocess.run([str(limberd.parent / "limber"), "--endpoint", kept.endpoint, *arguments], capture_output=True, text=True,
                               timeout=60)
        assert ended.returncode == code, ended.stderr
        return ended.stdout + ended.stderr
    server.open(small_scene(), session="bar", progress=False)
    kept.restart()
    assert "bar" in run("sessions") and "parked" in run("sessions") and "1 stored, 1 of them parked" in run("sessions")
    run("sessions", "export", "bar", str(tmp_path / "bar.limber"))
    assert "session tulip (bodies), revision 0" in run("sessions", "import", str(tmp_path / "bar.limber"), "--as", "tulip")
    refused = run("sessions", "remove", "rose", "bar", "iris", "tulip", code=1)
    assert "'rose'" in refused and "'iris'" in refused and "tulip is removed" in refused
    assert server.sessions() == []
    assert "there is no session 'bar'" in run("sessions", "remove", "bar", code=1)
