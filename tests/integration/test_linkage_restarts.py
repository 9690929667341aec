"""The final answer of a linkage is the same after a restart: nothing is solved anew."""

import random
import signal

import limber
import numpy as np
import pytest
from linkage_inputs import RECTANGLE
from test_restarts import storing_at  # noqa: F401


def answer_of(session):
    result = session.wait(timeout=60)
    return result, session.frames(encoding="positions")[-1]


def open_grid(server):
    """The sample, pinned at three joints."""
    session = server.open(sample="grid", session="grid", progress=False)
    session.wait()
    for joint in (0, 8, 40):
        session.pin(joint)
    session.wait()
    return session


def open_arch(server):
    """Between pins that have moved together, with a pin that holds a joint where it was by then."""
    points = [[0, -.05, 0], [0, 0, 0], [0, .05, 0], [1, -.05, 0], [1, 0, 0], [1, .05, 0], [.5, 0, 0], [.5, .05, 0], [.5, -.05, 0]]
    edges = [[0, 1], [1, 2], [1, 6], [6, 4], [3, 4], [4, 5], [8, 6], [6, 7]]
    session = server.open(limber.linkage_scene(points, edges, section={"rectangle": RECTANGLE["rectangle"]},
                                               edges_per_segment=8), session="arch", progress=False)
    session.pin(0, "both")
    session.wait()
    session.pin(1, position=(0.93, 0, 0.002), held="both")
    session.load(2, force=(0, 0, 0.01))
    session.wait()
    session.pin(2, "angle")
    return session


def assert_same(now, before):
    (is_now, shape), (was, shape_before) = now, before
    assert (is_now.status, is_now.solve_failed) == (was.status, was.solve_failed)
    assert is_now.energy == pytest.approx(was.energy, rel=1e-9)
    assert is_now.iterations == 0
    assert np.abs(shape - shape_before).max() < 1e-6 * np.ptp(shape_before)


@pytest.mark.timeout(300)
@pytest.mark.parametrize("sign", (signal.SIGKILL, signal.SIGTERM))
def test_pins_and_loads_of_a_linkage_come_back(storing_at, sign):  # noqa: F811
    chance = random.Random(5)
    with limber.connect(storing_at.endpoint) as server:
        session = open_grid(server)
        for _ in range(6):
            for _ in range(3):
                session.load(chance.randrange(81), force=[chance.uniform(-2, 2) for _ in range(3)])
                before = answer_of(session)
            conditions = session.conditions()
            storing_at.restart(sign)
            session = server.session("grid")
            after = answer_of(session)
            if not before[0].solve_failed:  # the answer to a wait for one that failed may come before it is stored
                assert_same(after, before)
            assert session.conditions() == conditions


@pytest.mark.timeout(300)
def test_a_buckled_linkage_comes_back(storing_at):  # noqa: F811
    with limber.connect(storing_at.endpoint) as server:
        session = open_arch(server)
        before = answer_of(session)
        assert before[0].converged and np.ptp(before[1][:, 2]) > 0.05, "an arch"
        for sign in (signal.SIGKILL, signal.SIGTERM, signal.SIGKILL):
            storing_at.restart(sign)
            session = server.session("arch")
            assert_same(answer_of(session), before)
        session.load(2, force=(0, 0, 0.02))
        assert session.wait().converged
