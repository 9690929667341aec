"""Sessions with many edits: what edits have made of a session is stored in their place, and nobody notices."""

import contextlib
import random
import signal
import sqlite3
import threading
import time

import limber
import numpy as np
import pytest
from conftest import small_scene, tip_of
from design_inputs import strip_scene
from limber.messages import scene as messages
from limber.messages import service
from test_restarts import Restartable
from test_stored_sessions import settle

EVERY = 25


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "data"


@pytest.fixture
def kept(limberd, tmp_path, cache_dir, folder):
    running = Restartable(limberd, tmp_path, cache_dir, "--data", str(folder), "--checkpoint-edits", str(EVERY))
    yield running
    running.close()


@pytest.fixture
def people(kept):
    with limber.connect(kept.endpoint, name="ana", timeout=60) as ana, \
            limber.connect(kept.endpoint, name="ben", timeout=60) as ben:
        yield ana, ben


class Body:
    opening = staticmethod(lambda: {"scene": small_scene()})

    def begin(self, ana, ben):
        tip = tip_of(ana)
        self.held = [ana.add(node=tip, frame=20, displacement=(0, 0, 0)).id, ben.add(node=tip, frame=40, displacement=(0, 0, 0)).id]

    def write(self, session, who, number):
        session.move(self.held[who], (0, 1e-3 * number, 0))

    def read(self, session):
        return {one.id: tuple(np.round(one.target, 9)) for one in session.constraints()}

    def new_id(self, session):
        return session.add(node=tip_of(session), frame=30, displacement=(0, 0, 0)).id


class Linkage:
    @staticmethod
    def opening():
        scene = strip_scene()
        scene.linkage.conditions.pins.add(joint=0, held=messages.HELD_MOTION)
        return {"scene": scene}

    def begin(self, ana, ben):
        pass

    def write(self, session, who, number):
        session.load(who, force=(0, 0, 1e-6 * number))

    def read(self, session):
        return {one.joint: one.force.z for one in session.conditions().loads}, len(session.conditions().targets)

    def new_id(self, session):
        return session.attach(joint=2, position=(0, 0, 1), stiffness=1e-6).id


class Beams:
    opening = staticmethod(lambda: {"sample": "arch"})

    def begin(self, ana, ben):
        pass

    def write(self, session, who, number):
        if who == 0:
            session.gravity((0, 0, -1e-3 * number))
        else:
            session.load(3, force=(0, 0, -1e-3 * number))

    def read(self, session):
        structure = session.structure()
        return structure.gravity.z, sorted((one.node, one.force.z) for one in structure.loads)


def rows(folder):
    with contextlib.closing(sqlite3.connect(folder / "sessions.sqlite", timeout=60)) as database:
        return [database.execute(f"SELECT count(*) FROM {table}").fetchone()[0] for table in ("edits", "checkpoints")]


def rows_once(folder, is_reached):
    """They are written, and removed, behind the acknowledgements."""
    until = time.monotonic() + 60
    while not is_reached(found := rows(folder)):
        assert time.monotonic() < until, found
        time.sleep(0.05)
    return found


def edit_at_random(kind, sessions, numbers, count):
    for _ in range(count):
        who = numbers.randrange(2)
        with contextlib.suppress(limber.LimberError):  # nothing to undo
            choice = numbers.random()
            if choice < 0.1:
                sessions[who].undo()
            elif choice < 0.2:
                sessions[who].redo()
            else:
                kind.write(sessions[who], who, numbers.randrange(1, 100))


def turns(kind, sessions, count):
    """What there is after each of so many own undos and redos of both."""
    found = []
    for turn in ("undo", "redo"):
        for _ in range(count):
            for session in sessions:
                try:
                    getattr(session, turn)()
                except limber.LimberError as refusal:
                    found.append(str(refusal))
                found.append(kind.read(session))
    return found


@pytest.mark.parametrize("kind", [Body(), Linkage(), Beams()], ids=lambda kind: type(kind).__name__)
def test_all_there_was_is_there_after_a_kill(kept, people, folder, tmp_path, kind):
    opened = people[0].open(session="one", progress=False, **kind.opening())
    opened.wait(timeout=300)
    sessions = [opened, people[1].session("one")]
    kind.begin(*sessions)
    edit_at_random(kind, sessions, random.Random(1), 12 * EVERY)
    shown = opened.wait(timeout=300)
    status = opened.status()
    edits, checkpoints = rows_once(folder, lambda found: found[1] == 1 and found[0] <= 6 * EVERY)
    assert edits < status.revision and checkpoints == 1
    settle(people[0])
    people[0].save_session("one", tmp_path / "one.limber")
    copies = [people[0].restore_session(tmp_path / "one.limber", "copy"), people[1].session("copy")]
    assert copies[0].status().revision == status.revision
    kept.restart()
    sessions = [one.session("one") for one in people]
    again = sessions[0].status()
    assert again.revision == status.revision
    runs = [[(run.first, run.revision, run.name, list(run.edits)) for run in one.revisions] for one in (again, status)]
    assert runs[0] == runs[1]
    assert sessions[0].wait(timeout=300).energy == pytest.approx(shown.energy, rel=1e-6, abs=1e-12)
    assert kind.read(sessions[0]) == kind.read(copies[0])
    # Once more, so that what is compared has come back from a checkpoint of a session that came back from one.
    edit_at_random(kind, sessions, random.Random(2), 3 * EVERY)
    edit_at_random(kind, copies, random.Random(2), 3 * EVERY)
    kept.restart()
    sessions, copies = ([one.session(name) for one in people] for name in ("one", "copy"))
    assert turns(kind, sessions, 15) == turns(kind, copies, 15)
    if hasattr(kind, "new_id"):
        before = set(kind.read(sessions[0])) if isinstance(kind, Body) else set()
        found = kind.new_id(sessions[0])
        assert found not in before and found == kind.new_id(copies[0])


def test_ids_are_not_given_again(kept, people, folder):
    """Those of what was removed before the checkpoint, too."""
    session = people[0].open(small_scene(), session="bar", progress=False)
    tip = tip_of(session)
    last = [session.add(node=tip, frame=20, displacement=(0, 0.1, 0)) for _ in range(5)][-1]
    last.remove()
    for i in range(3 * EVERY):
        session.move(1, (0, 1e-3 * i, 0))
    rows_once(folder, lambda found: found[1] == 1)
    kept.restart()
    assert people[0].session("bar").add(node=tip, frame=20, displacement=(0, 0.1, 0)).id == last.id + 1


@pytest.mark.parametrize("seed", range(4))
def test_a_kill_at_any_moment_loses_nothing(kept, people, seed):
    """As many checkpoints as possible, and kills among them."""
    kept.command[-1] = "1"
    kept.restart()
    numbers = random.Random(seed)
    session = people[0].open(small_scene(), session="bar", progress=False)
    held = session.add(node=tip_of(session), frame=20, displacement=(0, 0, 0))
    acknowledged = []

    def drag():
        with contextlib.suppress(limber.LimberError), limber.connect(kept.endpoint, timeout=1) as other:
            mine = other.session("bar")
            while True:
                mine.move(held.id, (0, 1e-3 * (len(acknowledged) + 1), 0))
                acknowledged.append(mine)

    for _ in range(4):
        worker = threading.Thread(target=drag)
        worker.start()
        time.sleep(numbers.uniform(0.05, 0.4))
        kept.end(signal.SIGKILL)
        worker.join(60)
        kept.start()
        session = people[0].session("bar")
        (constraint,) = session.constraints()
        step = round(constraint.target[1] / 1e-3)
        assert step - len(acknowledged) in (0, 1) and session.status().revision == step + 1
        acknowledged.extend([None] * (step - len(acknowledged)))


def test_a_session_of_before_gets_its_checkpoint(kept, people, folder):
    """One that was stored by a server without them."""
    kept.command[-1] = "0"
    kept.restart()
    session = people[0].open(small_scene(), session="bar", progress=False)
    held = session.add(node=tip_of(session), frame=20, displacement=(0, 0, 0))
    for i in range(4 * EVERY):
        held.move((0, 1e-3 * i, 0))
    assert rows(folder) == [4 * EVERY + 1, 0]
    kept.command[-1] = str(EVERY)
    kept.restart()
    session = people[0].session("bar")
    assert rows(folder) == [4 * EVERY + 1, 0]
    session.move(held.id, (0, 1, 0))
    rows_once(folder, lambda found: found[1] == 1 and found[0] <= 1)
    kept.restart()
    session = people[0].session("bar")
    assert session.status().revision == 4 * EVERY + 2
    for i in reversed(range(4 * EVERY)):
        session.undo(anyone=True)
        assert session.constraints()[0].target[1] == pytest.approx(1e-3 * i, abs=1e-12)


def test_a_damaged_checkpoint_is_refused(kept, people, tmp_path):
    session = people[0].open(small_scene(), session="bar", progress=False)
    content = service.SaveSessionRequest(session="bar")
    stored = people[0].connection.call("save_session", content).content
    damaged = stored[:-10] + b"\x4a\x04\x08\x07\x22\x00"  # in place of the checksum: checkpoint { revision: 7 beams {} }
    (tmp_path / "bar.limber").write_bytes(damaged)
    with pytest.raises(limber.LimberError, match="no checkpoint of an elastic body"):
        people[0].restore_session(tmp_path / "bar.limber", "other")
    (tmp_path / "bar.limber").write_bytes(stored[:-10] + b"\x4a\x02\x08\x07")
    with pytest.raises(limber.LimberError, match="no checkpoint of an elastic body"):
        people[0].restore_session(tmp_path / "bar.limber", "other")
    session.close()
