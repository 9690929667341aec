"""Motions that come in parts, as the client asks for them."""

import limber
import numpy as np
import pytest
from limber import arrays, frame_parts
from limber.errors import LimberError
from limber.v1 import service_pb2 as service

pytestmark = pytest.mark.timeout(30)
FRAMES = 10


class Motions:
    """Answers with at most three frames; each request without a result finds a newer one."""

    def __init__(self):
        self.asked, self.newest = [], 0
        self.displaced = 0  # so many parts behind the first are refused
        self.knows_parts = True

    def __call__(self, request):
        asked = service.GetFramesRequest()
        asked.CopyFrom(request)
        self.asked.append(asked)
        if asked.result_sequence and self.displaced:
            self.displaced -= 1
            raise LimberError("FAILED_PRECONDITION", "no such result any more", "result_sequence")
        self.newest += not asked.result_sequence
        sequence = asked.result_sequence or self.newest
        wanted = asked.frame_count or FRAMES - asked.first_frame
        count = min(3, wanted) if asked.most_bytes and self.knows_parts else wanted
        values = 100 * sequence + np.arange(asked.first_frame, asked.first_frame + count)
        frames = service.Frames(result=service.ResultInfo(sequence=sequence), encoding=service.ENCODING_POSITIONS,
                                first_frame=asked.first_frame, frame_count=count,
                                data=arrays.to_message(np.repeat(values, 3).reshape(-1, 1, 3), np.float32))
        return service.GetFramesResponse(frames=frames, frames_left=wanted - count)


@pytest.fixture
def motions():
    return Motions()


def fetched(motions, **request):
    whole = frame_parts.joined(frame_parts.fetch(motions, service.GetFramesRequest(**request)))
    values = arrays.to_numpy(whole.data, "frames")[:, 0, 0]
    assert len(values) == whole.frame_count
    return whole.first_frame, values.astype(int).tolist()


def test_parts_of_one_result_are_put_together(motions):
    assert fetched(motions, first_frame=1, frame_count=8) == (1, [100 + i for i in range(1, 9)])
    assert [(one.first_frame, one.frame_count, one.result_sequence) for one in motions.asked] == [
        (1, 8, 0), (4, 5, 1), (7, 2, 1)]
    assert motions.asked[0].most_bytes == frame_parts.PartSize.LEAST


def over(way_s, bytes_per_s):
    """The size of parts in the end, over a link."""
    size = frame_parts.PartSize()
    for _ in range(20):
        size.note(way_s + size.bytes / bytes_per_s)
    return size.bytes


def test_parts_are_as_large_as_the_link_is_quick():
    size = frame_parts.PartSize
    assert over(1e-4, 1e9) == size.MOST
    assert over(1e-4, 12.5e6) == 4 * size.LEAST  # 21 ms
    assert over(1e-4, 1e6) <= 2 * size.LEAST
    assert over(0.1, 1e9) == size.MOST  # a long way is no slow link
    assert over(0.1, 12.5e6) == 4 * size.LEAST


def test_a_motion_is_asked_for_in_parts_of_that_size(motions):
    times = iter((0, 0.001, 1, 1.001, 2, 3))
    frame_parts.fetch(motions, service.GetFramesRequest(frame_count=8), clock=lambda: next(times))
    assert [one.most_bytes for one in motions.asked] == [frame_parts.PartSize.LEAST * size for size in (1, 2, 4)]


def test_a_motion_whose_result_was_displaced_is_fetched_anew(motions):
    motions.displaced = 2
    assert fetched(motions) == (0, [300 + i for i in range(FRAMES)])


def test_where_results_are_displaced_each_time_it_comes_whole(motions):
    motions.displaced = 1000
    assert fetched(motions)[1] == [100 * motions.newest + i for i in range(FRAMES)]
    assert motions.asked[-1].most_bytes == 0


def test_a_server_that_knows_no_parts_sends_it_whole(motions):
    motions.knows_parts = False
    assert fetched(motions) == (0, [100 + i for i in range(FRAMES)])
    assert len(motions.asked) == 1


def test_an_older_server_that_refuses_what_it_does_not_know_sends_it_whole(motions):
    def older(request):
        if request.most_bytes:
            raise LimberError("INVALID_ARGUMENT", "unknown field number 7 in GetFramesRequest; update the server", "get_frames")
        return motions(request)

    frames = frame_parts.joined(frame_parts.fetch(older, service.GetFramesRequest(frame_count=8)))
    assert frames.frame_count == 8


def test_a_part_without_frames_is_an_error(motions):
    def empty(request):
        answer = motions(request)
        if request.result_sequence:
            answer.frames.frame_count, answer.frames_left = 0, 7
        return answer

    with pytest.raises(LimberError, match="no frames"):
        frame_parts.fetch(empty, service.GetFramesRequest())


def test_other_refusals_are_the_callers(motions):
    def closed(request):
        raise LimberError("NOT_FOUND", "the session is closed", "session")

    with pytest.raises(LimberError, match="closed"):
        frame_parts.fetch(closed, service.GetFramesRequest())


def test_sessions_fetch_in_parts_all_but_quantised_positions(fake, motions):
    fake.handlers["get_session"] = lambda request: service.GetSessionResponse()
    fake.handlers["get_frames"] = lambda request: motions(request.get_frames)
    with limber.connect(fake.requests) as server:
        session = server.session("s")
        assert session.frames(encoding="positions")[:, 0, 0].tolist() == [100 + i for i in range(FRAMES)]
        assert session.raw_frames(encoding="positions").frame_count == FRAMES
        asked = len(motions.asked)
        assert session.raw_frames(encoding="quantised").frame_count == FRAMES
        assert [one.most_bytes for one in motions.asked[asked:]] == [0]
