"""Undo is of one's own: whatever others did meanwhile, unless they changed the same."""

import limber
import numpy as np
import pytest
from conftest import small_scene, tip_of


@pytest.fixture
def pair(server):
    """A body, and the session as ana and ben have it."""
    with limber.connect(server.connection.endpoint, name="ana") as ana, \
            limber.connect(server.connection.endpoint, name="ben") as ben:
        opened = ana.open(small_scene(), progress=False)
        yield opened, ben.session(opened.id)
        opened.close()


def targets(session):
    return {one.id: tuple(np.round(one.target, 6)) for one in session.constraints()}


def test_ones_own_edit_is_taken_back_under_those_of_others(pair):
    ana, ben = pair
    tip = tip_of(ana)
    first = ana.add(node=tip, frame=20, displacement=(0, 0.4, 0))
    second = ben.add(node=tip, frame=40, displacement=(0, 0.1, 0))
    assert ana.undo().revision == 3
    assert list(targets(ana)) == [second.id]
    assert ana.redo().revision == 4
    assert sorted(targets(ana)) == sorted([first.id, second.id])
    ben.undo()
    assert list(targets(ana)) == [first.id]
    assert ana.wait(revision=5).converged


def test_steps_of_a_drag_are_taken_back_one_by_one(pair):
    ana, ben = pair
    tip = tip_of(ana)
    held = ana.add(node=tip, frame=20, displacement=(0, 0.1, 0))
    before = targets(ana)[held.id]
    held.move((0, 0.2, 0))
    held.move((0, 0.3, 0))
    after = targets(ana)[held.id]
    ben.add(node=tip, frame=40, displacement=(0, 0.1, 0))
    ana.edit([limber.undo(), limber.undo()])
    assert targets(ana)[held.id] == before
    ana.undo()
    assert held.id not in targets(ana)
    for _ in range(3):
        ana.redo()
    assert targets(ana)[held.id] == after
    with pytest.raises(limber.LimberError, match="nothing"):
        ana.redo()


def test_what_others_changed_since_is_not_taken_back(pair):
    ana, ben = pair
    held = ana.add(node=tip_of(ana), frame=20, displacement=(0, 0.4, 0))
    ben.edit([limber.move(held.id, (0, 0.6, 0))])
    with pytest.raises(limber.LimberError, match=f"constraint {held.id} was changed since by ben") as refused:
        ana.undo()
    assert refused.value.code == "FAILED_PRECONDITION" and ana.status().revision == 2
    ana.undo(anyone=True)
    assert ana.undo().revision == 4 and targets(ana) == {}


def test_who_made_nothing_has_nothing_to_undo(pair):
    ana, ben = pair
    ana.add(node=tip_of(ana), frame=20, displacement=(0, 0.4, 0))
    with pytest.raises(limber.LimberError, match="nothing of yours to undo, the newest edit is by ana"):
        ben.undo()
    ben.undo(anyone=True)
    assert targets(ana) == {}
    assert ana.redo().revision == 3, "it is ana's"


def test_who_has_undone_all_has_nothing_more_to_undo(pair):
    ana, ben = pair
    tip = tip_of(ana)
    ana.add(node=tip, frame=20, displacement=(0, 0.4, 0))
    ben.add(node=tip, frame=40, displacement=(0, 0.1, 0))
    ana.undo()
    with pytest.raises(limber.LimberError, match="nothing more of yours to undo, the newest edit is by ben"):
        ana.undo()


@pytest.mark.parametrize("sample, mine, other, same", [
    ("hyperboloid", lambda one: one.pin(3), lambda one: one.load(5, force=(0, 0, -2)), lambda one: one.pin(3, position=(0, 0, 0.5))),
    ("arch", lambda one: one.load(10, force=(0, 0, -3)), lambda one: one.gravity((0, 0, -5)),
     lambda one: one.load(10, force=(0, 0, -1))),
])
def test_other_kinds_do_the_same(server, sample, mine, other, same):
    with limber.connect(server.connection.endpoint, name="ana") as ana, \
            limber.connect(server.connection.endpoint, name="ben") as ben:
        opened = ana.open(sample=sample, progress=False)
        opened.wait(timeout=300)
        of_ben = ben.session(opened.id)
        energy = opened.wait(timeout=300).energy
        mine(opened)
        other(of_ben)
        opened.wait(timeout=300)
        opened.undo()
        of_ben.undo()
        result = opened.wait(revision=4, timeout=300)
        assert (result.revision, result.converged) == (4, True)
        assert result.energy == pytest.approx(energy, rel=1e-5, abs=1e-12)
        opened.redo()
        same(of_ben)
        with pytest.raises(limber.LimberError, match="was changed since by ben"):
            opened.undo()
        opened.close()


def test_whose_edits_are_whose_is_known_after_a_restart(launch, tmp_path):
    folder = str(tmp_path / "data")
    with limber.connect(launch("--data", folder).connection.endpoint, name="ana") as ana:
        opened = ana.open(small_scene(), session="bar", progress=False)
        first = opened.add(node=tip_of(opened), frame=20, displacement=(0, 0.4, 0))
        with limber.connect(ana.connection.endpoint, name="ben") as ben:
            second = ben.session("bar").add(node=tip_of(opened), frame=40, displacement=(0, 0.1, 0))
        opened.wait()
        ana.save_session("bar", tmp_path / "bar.session")
    with limber.connect(launch("--data", str(tmp_path / "other")).connection.endpoint, name="ana") as ana:
        again = ana.restore_session(tmp_path / "bar.session")
        assert [made.name for made in again.revisions()] == ["ben", "ana"]
        again.undo()
        assert list(targets(again)) == [second.id] and first.id != second.id
