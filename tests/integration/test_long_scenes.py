"""Motions of many frames: what changes comes as ranges, what matters first."""

import time

import limber
import numpy as np
import pytest
from conftest import small_scene, tip_of

FRAMES = 12_000


@pytest.fixture(scope="module")
def long_session(server):
    """A bar that is held in four frames, far from each other."""
    session = server.open(small_scene(frames=FRAMES), progress=False)
    tip = tip_of(session)
    session.edit([limber.add(node=tip, frame=frame, displacement=(0, 0.02, 0.1)) for frame in (1_000, 4_000, 7_000, 10_000)])
    session.wait(until="checked")
    yield session
    session.close()


def read_until_final(stream, revision):
    """Updates up to the final result of a revision."""
    updates = [next(stream)]
    while not (updates[-1].whole and updates[-1].result.final and updates[-1].result.revision >= revision):
        updates.append(next(stream))
    return updates


def begin(session):
    stream = session.follow(timeout=30)
    next(stream)
    session.wait(until="checked")
    while stream.sequence < session.status().result.sequence:
        next(stream)
    return stream


def covers(update, frame):
    return update.first_frame <= frame < update.first_frame + update.frame_count


def moved(session, step):
    constraint = next(c for c in session.constraints() if c.frame == 1_000)
    return constraint.move((0.01 * step, 0.02 + 0.03 * step, 0.1)).revision


def test_what_lies_near_an_edit_comes_first_and_the_motion_follows(long_session):
    with begin(long_session) as stream:
        updates = read_until_final(stream, moved(long_session, 1))
        assert updates[0].early and covers(updates[0], 1_000)
        assert updates[0].frame_count < 1_000
        assert not updates[-1].early and updates[-1].result.exact
        expected = long_session.frames(encoding="coordinates")
        np.testing.assert_allclose(stream.coordinates, expected, atol=3e-7 * np.abs(expected).max())
        np.testing.assert_allclose(stream.positions(990, 20), long_session.frames(990, 20), atol=1e-5)
        assert not stream.coordinates.flags.writeable


def test_a_client_that_looks_at_the_far_end_of_a_long_scene(long_session):
    with begin(long_session) as stream:
        long_session.look_at(11_500, 200)
        updates = read_until_final(stream, moved(long_session, 2))
        early = [update for update in updates if update.early]
        assert any(covers(update, 11_500) and covers(update, 11_699) for update in early), early
        assert any(covers(update, 1_000) for update in early), "and what was edited"
        first_whole = next(i for i, update in enumerate(updates) if update.whole)
        assert all(updates.index(update) < first_whole for update in early[:2])
        expected = long_session.frames(encoding="coordinates")
        np.testing.assert_allclose(stream.coordinates, expected, atol=3e-7 * np.abs(expected).max())
    with pytest.raises(limber.LimberError) as refused:
        long_session.look_at(FRAMES)
    assert refused.value.field == "first_frame" and refused.value.code == "OUT_OF_RANGE"


def test_a_subscriber_that_joins_between_two_ranges(server, long_session):
    """Others join and leave while ranges come: each has the whole motion in the end."""
    watching = begin(long_session)
    joined = []
    for step in range(3, 11):
        revision = moved(long_session, step)
        next(watching)
        joined.append(limber.connect(server.connection.endpoint).session(long_session.reference).follow(timeout=30))
    long_session.wait(revision, until="checked")
    expected = long_session.frames(encoding="coordinates")
    for stream in (watching, *joined):
        with stream:
            deadline = time.monotonic() + 30
            while stream.sequence < long_session.status().result.sequence:
                assert time.monotonic() < deadline
                next(stream)
            np.testing.assert_allclose(stream.coordinates, expected, atol=3e-7 * np.abs(expected).max())


def test_frames_that_did_not_change_are_not_sent_again(long_session):
    with begin(long_session) as stream:
        held = next(c for c in long_session.constraints() if c.frame == 10_000)
        held.move(held.target)
        updates = read_until_final(stream, long_session.revision)
        long_session.wait(until="checked")
        assert sum(update.frame_count for update in updates if not update.early) < FRAMES / 10, updates


def test_beams_are_followed_too(server):
    """Few frames without a basis: all of them with every result."""
    session = server.open(server.sample("arch"), progress=False)
    session.wait(until="checked")
    with session.follow(timeout=30) as stream:
        update = next(stream)
        while stream.sequence < session.status().result.sequence:
            update = next(stream)
        assert update.whole and update.first_frame == 0
        np.testing.assert_array_equal(stream.coordinates, session.frames(encoding="coordinates"))
    with pytest.raises(limber.LimberError, match="long motion"):
        limber.Session.look_at(session, 0)
    session.close()
