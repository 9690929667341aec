"""Motions that are kept up to date by what changes of them."""

import limber
import numpy as np
import pytest
from limber import arrays
from limber.v1 import service_pb2 as service
from limber.v1 import stream_pb2 as stream

pytestmark = pytest.mark.timeout(30)
TOPIC = "session/s/body/0/changes"
FRAMES = 10


def changes(number, sequence, first, values, base=0, **fields):
    """A message: `values` are those of its frames."""
    data = arrays.to_message(np.repeat(np.array(values, float)[:, None], 2, axis=1).reshape(-1, 2), np.float32)
    frames = service.Frames(result=service.ResultInfo(sequence=sequence, revision=1), first_frame=first,
                            frame_count=len(values), data=data, encoding=service.ENCODING_COORDINATES, basis_hash="b",
                            changes=service.FrameChanges(motion_frames=FRAMES, base_sequence=base, **fields))
    return stream.StreamMessage(version=1, sequence=number, session="s", frames=frames)


@pytest.fixture
def motion(fake):
    fake.fetched = []

    def whole(request):
        fake.fetched.append(request)
        data = arrays.to_message(np.full((FRAMES, 2), 7.0), np.float32)
        return service.GetFramesResponse(frames=service.Frames(
            result=service.ResultInfo(sequence=7), frame_count=FRAMES, data=data, basis_hash="b",
            encoding=service.ENCODING_COORDINATES))

    fake.handlers["get_session"] = lambda request: service.GetSessionResponse()
    fake.handlers["get_frames"] = whole
    with limber.connect(fake.requests) as server, server.session("s").follow(timeout=5) as stream:
        assert fake.subscribed.wait(5)
        yield stream


def held(motion):
    return motion.coordinates[:, 0].tolist()


def test_there_is_no_motion_before_the_first_update(motion):
    with pytest.raises(limber.LimberError, match="before the first update"):
        motion.coordinates  # noqa: B018


def test_ranges_of_a_result_are_put_together(fake, motion):
    fake.publish(TOPIC, changes(1, 1, 0, [1] * 4, more=True))
    fake.publish(TOPIC, changes(2, 1, 4, [2] * 6, part=1))
    fake.publish(TOPIC, changes(3, 2, 8, [3, 3], base=1, more=True))
    fake.publish(TOPIC, changes(4, 2, 0, [4], base=1, part=1))
    updates = [next(motion) for _ in range(4)]
    assert [update.whole for update in updates] == [False, True, False, True]
    assert [(update.first_frame, update.frame_count) for update in updates] == [(0, 4), (4, 6), (8, 2), (0, 1)]
    assert held(motion) == [4, 1, 1, 1, 2, 2, 2, 2, 3, 3]
    assert motion.sequence == 2 and not fake.fetched


def test_early_frames_are_shown_and_belong_to_no_result(fake, motion):
    fake.publish(TOPIC, changes(1, 1, 0, [1] * 10))
    fake.publish(TOPIC, changes(2, 0, 5, [9], base=1, early=True))
    fake.publish(TOPIC, changes(3, 0, 6, [9], base=12, early=True))  # of another motion than ours
    fake.publish(TOPIC, changes(4, 2, 5, [6], base=1))
    updates = [next(motion) for _ in range(3)]
    assert [update.early for update in updates] == [False, True, False]
    assert held(motion) == [1, 1, 1, 1, 1, 6, 1, 1, 1, 1]


def test_a_lost_result_has_the_motion_fetched(fake, motion):
    fake.publish(TOPIC, changes(1, 1, 0, [1] * 10))
    fake.publish(TOPIC, changes(5, 5, 0, [5], base=4))
    fake.publish(TOPIC, changes(6, 6, 0, [6], base=5))  # older than what was fetched
    fake.publish(TOPIC, changes(7, 8, 0, [8], base=7))
    updates = [next(motion) for _ in range(3)]
    assert [update.result.sequence for update in updates] == [1, 7, 8] and updates[1].missed == 3
    assert held(motion) == [8] + [7] * 9
    assert len(fake.fetched) == 1


def test_who_joins_between_two_ranges_fetches_the_motion(fake, motion):
    fake.publish(TOPIC, changes(1, 1, 4, [2] * 6, part=1))
    assert next(motion).whole and held(motion) == [7] * 10


@pytest.mark.parametrize("lost", [0, 1])
def test_a_message_lost_within_a_result_has_the_motion_fetched(fake, motion, lost):
    fake.publish(TOPIC, changes(1, 1, 0, [1] * 10))
    assert next(motion).whole
    for part in range(3):
        if part != lost:
            fake.publish(TOPIC, changes(2 + part, 2, part, [2], base=1, part=part, more=part < 2))
    updates = [next(motion)]
    while not updates[-1].whole:
        updates.append(next(motion))
    assert motion.sequence == 7 and held(motion) == [7] * 10
