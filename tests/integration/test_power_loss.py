"""The power is taken from limberd: its disk (tests/chaos/disk.c) keeps what was synced, and of the rest what it likes."""

import sys
from pathlib import Path

import limber
import pytest
from conftest import small_scene, tip_of

sys.path.append(str(Path(__file__).resolve().parents[1] / "chaos"))
import power  # noqa: E402
from design_inputs import strip_scene  # noqa: E402


@pytest.mark.timeout(240)
@pytest.mark.parametrize("early", [0, 50, 100])
def test_acknowledged_edits_outlive_the_power(early):
    """Nothing, half, or all of what was not synced is on the disk besides."""
    result = power.run(cuts=3, seed=7 + early, early=early)
    assert result["acknowledged"] > 0
    assert (result["lost"], result["gone"], result["faults"]) == (0, 0, [])


@pytest.mark.timeout(120)
def test_without_syncs_they_are_lost_and_that_is_noticed():
    """What --data-outlives process promises is less: the test above can fail."""
    result = power.run(cuts=3, seed=3, outlives="process", early=0)
    assert result["lost"] > 0 and result["faults"] == []


@pytest.mark.timeout(120)
def test_a_disk_that_lies_is_noticed():
    result = power.run(cuts=3, seed=4, is_lying=True, early=0)
    assert result["lost"] > 0 or result["faults"]


def test_an_answer_that_was_waited_for_outlives_the_power(tmp_path):
    """Of kinds where another answer could be found: the very one comes back, whatever the power did behind the reply."""
    disk = power.OnDisk(tmp_path, early=0, sync_ms=60)
    kinds = [(power.Body, {"scene": small_scene()}), (power.Linkage, {"scene": strip_scene()}), (power.Beams, {"sample": "arch"})]
    try:
        with limber.connect(disk.endpoint) as server:
            for kind, scene in kinds:
                name = kind.__name__
                drag, session = kind(server, name, scene), server.session(name)
                drag.step(session, 1)
                shown = session.wait()
                disk.cut()
                disk.start()
                listed = next(one for one in server.sessions() if one.session == name)
                assert listed.result.revision == shown.revision
                assert listed.result.sequence >= shown.sequence, "an amendment may have followed"
                if listed.result.sequence == shown.sequence:
                    assert server.session(name).wait().energy == pytest.approx(shown.energy, rel=1e-9, abs=1e-15)
    finally:
        disk.close()


@pytest.fixture
def disk(tmp_path):
    running = power.OnDisk(tmp_path)
    yield running
    running.close()


def test_a_sync_that_fails_is_not_acknowledged(disk):
    """An error of the disk is the answer to the edit; what was acknowledged before and after it is there."""
    with limber.connect(disk.endpoint) as server:
        session = server.open(small_scene(), session="held", progress=False)
        held = session.add(node=tip_of(session), frame=20, displacement=(0, 0, 0))
        disk.broken.touch()
        with pytest.raises(limber.LimberError) as caught:
            held.move((0, 1e-6, 0))
        assert caught.value.code == "IO"
        disk.broken.unlink()
        while server.info().store.fault:
            pass
        held.move((0, 2e-6, 0))
        revision = session.status().revision
        disk.cut()
        disk.start()
        back = server.session("held")
        assert back.status().revision == revision
        (constraint,) = back.constraints()
        assert round(constraint.target[1] / 1e-6) == 2
