"""limberd parks sessions that nobody uses, and brings them back when somebody asks for them."""

import subprocess
import time

import limber
import numpy as np
import pytest
import zmq
from conftest import small_scene, tip_of
from design_inputs import strip_scene, strips, until
from limber.launching import find_binary
from limber.messages import service, stream

PARKED, READY = service.SESSION_STATE_PARKED, service.SESSION_STATE_READY


@pytest.fixture
def parking(launch, tmp_path):
    """A server that parks what was not used for a second."""
    return launch("--data", str(tmp_path / "data"), "--park-after", "1")


def state_of(server, session):
    (status,) = (status for status in server.sessions() if status.session == session)
    return status.state


def rest(server, *sessions):
    for session in sessions:
        until(lambda session=session: state_of(server, session) == PARKED, 60)


@pytest.mark.parametrize("sample", ["", "hyperboloid", "arch"])
def test_a_session_rests_and_comes_back(parking, sample):
    if sample:
        session = parking.open(sample=sample, progress=False)
        session.wait(timeout=300)
    else:
        session = parking.open(small_scene(), progress=False)
        session.add(node=tip_of(session), frame=20, displacement=(0, 0.4, 0))
    before, shape = session.wait(timeout=300), session.frames()
    rest(parking, session.id)
    again = session.wait(timeout=300)
    assert state_of(parking, session.id) == READY
    assert (again.revision, again.converged) == (before.revision, True) and again.sequence > before.sequence
    assert np.abs(session.frames()[-1] - shape[-1]).max() < 1e-3 * np.ptp(shape[-1])


def test_undo_goes_through_what_was_parked(parking):
    session = parking.open(small_scene(), progress=False)
    held = session.add(node=tip_of(session), frame=20, displacement=(0, 0.4, 0))
    energy = session.wait().energy
    rest(parking, session.id)
    held.move((0, 0.8, 0))
    assert session.wait().energy > 1.5 * energy
    rest(parking, session.id)
    session.undo()
    assert session.wait().energy == pytest.approx(energy, rel=1e-6)
    rest(parking, session.id)
    session.redo()
    assert session.wait().revision == 4


def test_who_watches_sees_it_go_and_come(parking):
    session = parking.open(small_scene(), progress=False)
    session.wait()
    socket = parking.connection.context.socket(zmq.SUB)
    socket.linger = 0
    socket.connect(parking.stream_endpoint)
    socket.subscribe(f"session/{session.id}/status")
    seen = []

    def newest():
        while socket.poll(100):
            seen.append(stream.StreamMessage.FromString(socket.recv_multipart()[-1]).status.state)
        return seen

    with limber.connect(parking.connection.endpoint) as other:
        until(lambda: PARKED in newest(), 60)
        other.session(session.id).add(node=tip_of(session), frame=20, displacement=(0, 0.4, 0))
        until(lambda: newest()[-1] == READY, 60)
        assert service.SESSION_STATE_CLOSED not in seen
        (status,) = other.sessions()
        assert len(status.clients) == 2, "who was in it is in it"
    socket.close()


def test_a_session_that_somebody_asks_for_stays(parking):
    session, other = (parking.open(small_scene(), progress=False) for _ in range(2))
    until(lambda: session.status() and state_of(parking, other.id) == PARKED, 60)
    assert state_of(parking, session.id) == READY


def test_a_design_that_was_not_taken_is_not_parked(parking):
    """Its lengths are nowhere else."""
    session = parking.open(strip_scene(), progress=False)
    points, edges = strips()
    drawn = np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1)
    session.set_lengths(drawn * np.random.default_rng(17).uniform(0.99, 1.01, len(drawn)))
    session.wait(timeout=300)
    targets = np.array(session.shape().joints)
    session.undo()
    session.wait(timeout=300)
    design = session.design(targets=targets, distance_weight=1e8, flat_height=0.3)
    until(lambda: design.info().best.holds and design.info().iteration > 2)
    design.stop()
    other = parking.open(small_scene(), progress=False)
    other.wait()
    rest(parking, other.id)
    assert state_of(parking, session.id) == READY
    design.take()
    session.wait(timeout=300)
    rest(parking, session.id)


def resident(server):
    """Memory of the server's process [bytes]."""
    (line,) = (line for line in open(f"/proc/{server.process.pid}/status") if line.startswith("VmRSS"))
    return 1024 * int(line.split()[1])


BOUNDS = ("--max-session-bytes", "50000000", "--max-memory-bytes", "52000000")  # two hyperboloids


def test_memory_bounds_sessions(launch, tmp_path):
    """More are opened than there is memory for: those used last are there, the others parked."""
    server = launch("--data", str(tmp_path / "data"), "--park-after", "0", *BOUNDS)
    sessions = []
    for angle in range(4):
        session = server.open(sample="hyperboloid", progress=False)
        session.wait(timeout=300)
        session.deploy(session.conditions().mean_angle_degrees - angle)
        session.wait(timeout=300)
        sessions.append(session)
        time.sleep(2.2)  # who has just used a session keeps it
    info = server.info()
    assert info.limits.memory_bytes == 52_000_000 >= info.counters["session_bytes"] > 0
    assert [state_of(server, session.id) for session in sessions] == [PARKED, PARKED, READY, READY]
    assert sessions[0].wait(timeout=300).converged, "it comes back, and another goes"
    assert [state_of(server, session.id) for session in sessions] == [READY, PARKED, PARKED, READY]


def test_a_server_without_a_store_refuses_what_is_too_much(launch):
    server = launch(*BOUNDS)
    for _ in range(2):
        server.open(sample="hyperboloid", progress=False).wait(timeout=300)
    with pytest.raises(limber.LimberError, match="of all sessions together") as refused:
        server.open(sample="hyperboloid", progress=False)
    assert refused.value.code == "LIMIT_EXCEEDED"
    assert len(server.sessions()) == 2


@pytest.mark.parametrize("sample", ["flower", "hyperboloid", "gridshell"])
def test_estimates_are_about_what_sessions_take(launch, sample):
    server = launch()
    server.open(sample=sample, progress=False).wait(timeout=300)
    time.sleep(2)  # what is found out about the result in the background
    before = resident(server)
    more = [server.open(sample=sample, progress=False) for _ in range(2)]
    for session in more:
        session.wait(timeout=300)
    time.sleep(2)
    estimated = sum(status.memory_bytes for status in server.sessions()[1:])
    assert 0.4 * estimated < resident(server) - before < 2.5 * estimated


def test_jobs_of_one_client_do_not_stop_another_from_opening(launch):
    server = launch("--max-jobs", "1")
    with limber.connect(server.connection.endpoint) as busy:
        scene = small_scene(frames=50_000)
        scene.simulation.gravity.y = -9.81
        job = busy.connection.call("simulate", service.SimulateRequest(scene=scene)).job
        with limber.connect(server.connection.endpoint) as other:
            assert other.open(small_scene(), progress=False).wait().converged
            (state,) = (one.state for one in other.jobs() if one.job == job)
            assert state == service.JOB_STATE_RUNNING
        busy.connection.call("cancel", service.CancelRequest(job=job))


def test_who_only_watches_wakes_nobody(parking, monkeypatch):
    monkeypatch.setattr(limber.stream, "SILENCE", 3.0)
    session = parking.open(small_scene(), progress=False)
    session.wait()
    watch = subprocess.Popen([str(find_binary("limber")), "--endpoint", parking.connection.endpoint, "watch", session.id],
                             stdout=subprocess.DEVNULL)
    try:
        with session.stream() as stream:
            rest(parking, session.id)
            with pytest.raises(limber.LimberError, match="no frames"):
                while True:
                    stream.next(8)
            assert parking.info().counters["brought_back"] == 0 and state_of(parking, session.id) == PARKED
            session.add(node=tip_of(session), frame=20, displacement=(0, 0.4, 0))
            while stream.next(20).result.revision < 1:  # the stored answer first
                pass
    finally:
        watch.kill()
        watch.wait()


def test_what_is_stored_comes_back_whatever_limits_hold_now(launch, tmp_path):
    data, exported = str(tmp_path / "data"), tmp_path / "bar.session"
    before = launch("--data", data)
    session = before.open(small_scene(), session="bar", progress=False)
    for frame in (20, 30, 40):
        session.add(node=tip_of(session), frame=frame, displacement=(0, 0.1, 0))
    session.wait()
    before.save_session("bar", exported)
    before.close()
    server = launch("--data", data, "--max-tets", "100", "--max-frames", "30", "--max-constraints", "1")
    again = server.session("bar")
    assert again.wait().converged and len(again.constraints()) == 3
    again.undo()
    again.redo()
    assert again.wait().revision == 5 and len(again.constraints()) == 3
    for attempt in (lambda: server.open(small_scene(), progress=False), lambda: server.restore_session(exported, session="copy")):
        with pytest.raises(limber.LimberError) as refused:
            attempt()
        assert refused.value.code == "LIMIT_EXCEEDED"


def test_who_finds_no_room_is_told_which_sessions_are_in_use(launch, tmp_path):
    server = launch("--data", str(tmp_path / "data"), "--park-after", "0", *BOUNDS)
    for name in ("one", "two"):
        server.open(sample="hyperboloid", session=name, progress=False).wait(timeout=300)
    for name in ("one", "two"):
        server.session(name).revisions()
        server.session(name).deploy(80)
    with pytest.raises(limber.LimberError, match="2 sessions are in use .one, two. and make room once they rest: try again") as refused:
        server.open(sample="hyperboloid", session="three", progress=False)
    assert refused.value.code == "LIMIT_EXCEEDED" and refused.value.details["limit"] == "52000000"
    for name in ("one", "two"):
        server.session(name).wait(timeout=300)
    time.sleep(2.2)
    assert server.open(sample="hyperboloid", session="three", progress=False).wait(timeout=300).converged
