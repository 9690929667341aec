"""The stream iterator: snapshot, order, gaps, end."""

import threading
import time

import limber
import numpy as np
import pytest
from limber import arrays
from limber.newest import MOST, Newest
from limber.v1 import common_pb2 as common
from limber.v1 import service_pb2 as service
from limber.v1 import stream_pb2 as stream

pytestmark = pytest.mark.timeout(30)
REST = np.array([[0, 0, 0], [1, 0, 0]], dtype=np.float32)
BASIS = np.arange(12, dtype=np.float32).reshape(2, 3, 2)


def frames_of(sequence, revision=1, value=1.0):
    data = arrays.to_message(np.full((3, 2), value), np.float32)
    return service.Frames(result=service.ResultInfo(sequence=sequence, revision=revision), frame_count=3, data=data,
                          encoding=service.ENCODING_COORDINATES, basis_hash="b")


def status_message(sequence, state):
    return stream.StreamMessage(version=1, sequence=sequence, session="s", status=service.SessionStatus(state=state))


def stream_threads():
    return sum(thread.name == "limber-stream" for thread in threading.enumerate())


def message(sequence, frames):
    return stream.StreamMessage(version=1, sequence=sequence, session="s", frames=frames)


@pytest.fixture
def session(fake):
    fake.geometry_requests = []

    def geometry(request):
        fake.geometry_requests.append(request.get_geometry.known_basis_hash)
        answer = service.GetGeometryResponse(rest=arrays.to_message(REST, np.float32), basis_hash="b",
                                             tets=arrays.to_message(np.zeros((0, 4)), np.int32),
                                             surface=arrays.to_message(np.zeros((0, 3)), np.int32))
        if request.get_geometry.known_basis_hash != "b":
            answer.basis.CopyFrom(arrays.to_message(BASIS, np.float32))
        return answer

    fake.handlers["get_geometry"] = geometry
    fake.handlers["get_session"] = lambda request: service.GetSessionResponse()
    fake.handlers["get_frames"] = lambda request: service.GetFramesResponse(frames=frames_of(5))
    with limber.connect(fake.requests) as server:
        yield server.session("s")


def test_snapshot_comes_first_and_older_messages_are_discarded(fake, session):
    with session.stream() as frames:
        assert fake.subscribed.wait(5)
        fake.publish("session/s/body/0/coordinates", message(9, frames_of(5)))
        fake.publish("session/s/body/0/coordinates", message(10, frames_of(6, revision=2)))
        first, second = next(frames), frames.next(5)
    assert (first.result.sequence, second.result.sequence, second.result.revision) == (5, 6, 2)
    assert frames.missed == 0


def test_a_gap_is_counted(fake, session):
    with session.stream(snapshot=False) as frames:
        assert fake.subscribed.wait(5)
        for number in (1, 2, 6):
            fake.publish("session/s/body/0/coordinates", message(number, frames_of(number)))
        missed = [frames.next(5).missed for _ in range(3)]
    assert missed == [0, 0, 3]
    assert frames.missed == 3


def test_positions_are_rest_plus_basis_times_coordinates_and_the_basis_is_fetched_once(fake, session):
    with session.stream() as frames:
        positions = next(frames).positions
    expected = REST + BASIS @ np.ones(2, dtype=np.float32)
    assert positions.shape == (3, 2, 3)
    np.testing.assert_allclose(positions, np.broadcast_to(expected, positions.shape), rtol=1e-6)
    np.testing.assert_allclose(session.frames(), positions)
    assert fake.geometry_requests == [""]
    np.testing.assert_array_equal(session.geometry().basis, BASIS)
    assert fake.geometry_requests == ["", "b"]


def test_garbage_and_other_topics_do_not_disturb(fake, session):
    with session.stream(snapshot=False) as frames:
        assert fake.subscribed.wait(5)
        fake.publish("session/s/body/0/coordinates", b"\xff\xff\xff")
        fake.publish("session/s/body/0/coordinatesX", message(77, frames_of(3)))
        fake.publish("session/s/body/0/coordinates", message(1, frames_of(4)))
        assert frames.next(5).result.sequence == 4


def test_silence_is_a_timeout(session):
    with session.stream(snapshot=False) as frames, pytest.raises(limber.LimberError) as caught:
        frames.next(0.1)
    assert caught.value.code == "TIMEOUT"


def test_a_closed_session_ends_the_iteration(fake, session):
    with session.stream(snapshot=False, timeout=5) as frames:
        assert fake.subscribed.wait(5)
        closed = service.SessionStatus(state=service.SESSION_STATE_CLOSED)
        fake.publish("session/s/body/0/coordinates", message(1, frames_of(1)))
        fake.publish("session/s/status", stream.StreamMessage(version=1, sequence=1, session="s", status=closed))
        assert [f.result.sequence for f in frames] == [1]


def test_a_failed_session_raises(fake, session):
    with session.stream(snapshot=False, timeout=5) as frames:
        assert fake.subscribed.wait(5)
        failed = service.SessionStatus(state=service.SESSION_STATE_FAILED, message="tet 7 is flat")
        fake.publish("session/s/status", stream.StreamMessage(version=1, sequence=1, session="s", status=failed))
        with pytest.raises(limber.LimberError, match="tet 7 is flat"):
            frames.next(5)


def test_quantised_frames_decode_to_their_box(session):
    raw = service.Frames(encoding=service.ENCODING_POSITIONS_QUANTISED,
                         data=arrays.to_message([[[0, 65535, 32768]]], np.uint16),
                         origin=common.Vector3(x=-1, y=-1, z=0), extent=common.Vector3(x=2, y=3, z=1))
    from limber.results import decode
    np.testing.assert_allclose(decode(raw, None), [[[-1, 2, 32768 / 65535]]], atol=1e-6)


def test_who_pauses_finds_the_newest_and_the_number_of_the_others(fake, session):
    with session.stream() as frames:
        assert fake.subscribed.wait(5)
        for number in range(6, 106):
            fake.publish("session/s/body/0/coordinates", message(number, frames_of(number)))
            fake.publish("session/s/status", status_message(number, service.SESSION_STATE_READY))
        while frames._reception.newest._newest[0] < 105:
            time.sleep(0.01)
        assert frames.missed == 0, "nothing was handed out yet"
        read = [frames.next(5) for _ in range(MOST)]
        assert [one.result.sequence for one in read] == list(range(106 - MOST, 106))
        # The snapshot is one of those that had to go.
        assert [one.missed for one in read] == [101 - MOST] + [0] * (MOST - 1)
        assert frames.missed == 101 - MOST
        fake.publish("session/s/body/0/coordinates", message(106, frames_of(106)))
        assert frames.next(5).missed == 0


def test_the_end_of_the_session_is_heard_behind_many_frames(fake, session):
    with session.stream(snapshot=False, timeout=5) as frames:
        assert fake.subscribed.wait(5)
        for number in range(1, 50):
            fake.publish("session/s/body/0/coordinates", message(number, frames_of(number)))
        fake.publish("session/s/status", status_message(1, service.SESSION_STATE_CLOSED))
        while frames._reception.newest._status is None:
            time.sleep(0.01)
        assert [one.result.sequence for one in frames] == list(range(50 - MOST, 50))


def test_frames_that_are_sent_again_are_not_missed():
    newest = Newest()
    newest.begin_with(frames_of(5))
    newest.put_frames(1, frames_of(4))
    newest.put_frames(2, frames_of(5))
    newest.put_frames(3, frames_of(6))
    newest.put_frames(7, frames_of(6))
    newest.put_frames(8, frames_of(7))
    assert [newest.take(0).missed for _ in range(3)] == [0, 0, 3]
    assert newest.take(0) is None


def eventually(holds, within: float = 5) -> bool:
    deadline = time.monotonic() + within
    while not holds() and time.monotonic() < deadline:
        time.sleep(0.01)
    return holds()


def test_a_stream_that_is_closed_wakes_its_reader_and_leaves_no_thread(session):
    frames = session.stream(snapshot=False)
    threading.Timer(0.2, frames.close).start()
    with pytest.raises(StopIteration):
        frames.next(20)
    frames.close()
    assert eventually(lambda: stream_threads() == 0)
    dropped, second = session.stream(snapshot=False), session.stream(snapshot=False)
    assert eventually(lambda: stream_threads() == 2)
    del dropped
    assert eventually(lambda: stream_threads() == 1)
    session.connection.close()
    assert eventually(lambda: stream_threads() == 0)
    with pytest.raises(StopIteration):
        second.next(5)


def test_a_silent_stream_pings_the_server(fake, session, monkeypatch):
    monkeypatch.setattr(limber.stream, "SILENCE", 0.2)
    monkeypatch.setattr(limber.connection, "PATIENCE", 0.2)
    with session.stream(snapshot=False) as frames:
        with pytest.raises(limber.LimberError) as caught:
            frames.next(1)
        assert caught.value.code == "TIMEOUT" and not isinstance(caught.value, limber.ServerUnreachable)
        del fake.handlers["get_server_info"]
        start = time.monotonic()
        with pytest.raises(limber.ServerUnreachable):
            frames.next()
    assert time.monotonic() - start < 3
