#!/usr/bin/python3
"""Very many edits of one stored session of each kind, one after the other, as fast as limberd takes them: whether memory, file and
the time to come back stay bounded, and whether the answer in the end is that of the scene.

usage: tests/chaos/million.py [--edits 1000000] [--minutes 15] [--kinds body,linkage,beams] [--in-flight 200] [--json FILE]

Each kind gets a limberd of its own. Requests of one edit each are sent ahead of their replies; two people make them, and now and then
undo and redo their own. At 10,000, 100,000 and 1,000,000 edits, and in the end (--minutes of each kind at most): resident memory of
limberd, the size of its folder, and how long the session takes to be there in another limberd that begins with a copy of the store.
In the end limberd is killed (kill -9) and begins again; the session must be at the acknowledged revision, 20 steps of undo must lead
where they did, and its energy must be that of the scene opened anew. Prints one JSON object. LIMBER_BIN: the folder of limberd."""

import argparse
import contextlib
import json
import signal
import sqlite3
import sys
import tempfile
import time
from pathlib import Path

from kills import Beams, Body, Linkage

import limber
import zmq
from conftest import small_scene
from design_inputs import strip_scene
from limber.launching import find_binary
from limber.messages import service
from test_restarts import Restartable
from week import resident, size_of

MARKS = (10_000, 100_000, 1_000_000)


class Angle(Linkage):
    """Opens and closes: what is asked for is always reached."""

    def write(self, session, number):
        session.deploy(57 + 1e-3 * number)

    def read(self, session):
        return session.conditions().mean_angle_degrees


KINDS = {"body": (Body, lambda: {"scene": small_scene()}), "linkage": (Angle, lambda: {"scene": strip_scene()}),
         "beams": (Beams, lambda: {"sample": "arch"})}


def edit_of(drag, number):
    """The message of the edit that writes a number."""
    edit = service.Edit()
    if isinstance(drag, Body):
        edit.move.id, edit.move.target.y = drag.held, 1e-6 * number
    elif isinstance(drag, Angle):
        edit.set_mean_angle.angle_degrees = 57 + 1e-3 * (number % 1000)
    else:
        edit.set_gravity.gravity.z = -1e-3 * (1 + number % 1000)
    return edit


class Stream:
    """Edits of two people, from one connection each, so many on their way."""

    def __init__(self, stack, endpoint, drag, in_flight):
        context = stack.enter_context(zmq.Context())
        self.sockets = []
        for _ in range(2):
            socket = stack.enter_context(context.socket(zmq.DEALER))
            socket.linger, socket.sndhwm, socket.rcvhwm = 0, 0, 0
            socket.connect(endpoint)
            self.sockets.append(socket)
        self.drag, self.in_flight, self.sent, self.answered, self.made, self.refused = drag, in_flight, 0, 0, 0, 0

    def send(self):
        self.sent += 1
        who = self.sent // 50 % 2
        request = service.Request(version=1, id=self.sent, client=f"million-{who}", client_name=f"person {who}")
        request.edit.session = self.drag.name
        if self.sent % 50 == 7:
            request.edit.edits.add().undo.SetInParent()
        elif self.sent % 50 == 8:
            request.edit.edits.add().redo.SetInParent()
        else:
            request.edit.edits.add().CopyFrom(edit_of(self.drag, self.sent))
        self.sockets[who].send(request.SerializeToString())

    def run_to(self, count, until):
        while self.answered < count and (time.monotonic() < until or self.answered < self.sent):
            while self.sent < count and self.sent - self.answered < self.in_flight and time.monotonic() < until:
                self.send()
            for socket in self.sockets:
                while socket.poll(0 if socket is self.sockets[0] else 5):
                    reply = service.Reply.FromString(socket.recv())
                    self.answered += 1
                    if reply.HasField("error"):
                        self.refused += 1
                        self.fault = reply.error.message
                    else:
                        self.made = max(self.made, reply.edit.revision)


def settle(server):
    changes = -1
    while changes != (changes := server.info().store.changes):
        time.sleep(0.5)


def rows(folder):
    """Of edits, and of replies, which are kept for ten minutes."""
    with contextlib.closing(sqlite3.connect(folder / "sessions.sqlite")) as database:
        return {table: database.execute(f"SELECT count(*) FROM {table}").fetchone()[0] for table in ("edits", "replies")}


def time_of_return(source, cache, name, revision):
    """Of the session in a limberd that begins with a copy of the store. @returns [s] until its status, and until its answer, is there"""
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        folder = Path(folder)
        (folder / "data").mkdir()
        with contextlib.closing(sqlite3.connect(source / "sessions.sqlite")) as one, \
                contextlib.closing(sqlite3.connect(folder / "data/sessions.sqlite")) as other:
            one.backup(other)
        running = Restartable(find_binary("limberd"), folder, cache, "--data", str(folder / "data"))
        stack.callback(running.close)
        server = stack.enter_context(limber.connect(running.endpoint, timeout=600))
        return returned(server, name, revision)


def returned(server, name, revision):
    begin = time.perf_counter()
    session = server.session(name)
    found = session.status().revision
    there = time.perf_counter() - begin
    session.wait(timeout=600)
    assert found == revision, f"{name} came back at revision {found}, not {revision}"
    return {"back_s": round(there, 3), "solved_s": round(time.perf_counter() - begin, 3)}


def states(session, drag, steps):
    """What steps of undo lead to, and back."""
    found = []
    for _ in range(steps):
        session.edit([limber.undo(anyone=True)])
        found.append(drag.read(session))
    for _ in range(steps):
        session.edit([limber.redo(anyone=True)])
    return found


def relative_difference(server, session, scene):
    """Of the energy from that of the scene opened anew."""
    warm = session.wait(timeout=600).energy
    cold = server.open(scene, session="anew", progress=False).wait(timeout=600).energy
    return abs(warm - cold) / max(abs(cold), 1e-300)


def scene_of(server, kind, opened):
    """As edited. What edits do not change is that of the opened scene, where there is one."""
    request = service.GetSessionRequest(session=kind, with_scene=True)
    edited = server.connection.call("get_session", request).scene
    scene = opened.get("scene")
    if scene is None:
        return edited
    if kind == "body":
        del scene.constraints[:]
        scene.constraints.extend(edited.constraints)
    else:
        scene.linkage.conditions.CopyFrom(edited.linkage.conditions)
    return scene


def run(kind, options):
    drag_class, opening = KINDS[kind]
    result = {"marks": {}}
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        folder = Path(folder)
        cache = folder / "cache"
        running = Restartable(find_binary("limberd"), folder, cache, "--data", str(folder / "data"))
        stack.callback(running.close)
        server = stack.enter_context(limber.connect(running.endpoint, timeout=600))
        drag = drag_class(server, kind, opening())
        stream = Stream(stack, running.endpoint, drag, options.in_flight)
        begin, until, paused = time.monotonic(), time.monotonic() + 60 * options.minutes, 0.0

        def note(name):
            nonlocal paused
            pause = time.monotonic()
            settle(server)
            values = {"rss_mb": round(resident(running.process.pid) / 1e6, 1), "file_mb": round(size_of(folder / "data") / 1e6, 2)}
            values.update(rows(folder / "data"))
            values.update(time_of_return(folder / "data", cache, kind, max(stream.made, drag.revision)))
            result["marks"][name] = values
            paused += time.monotonic() - pause

        for mark in sorted({*(one for one in MARKS if one < options.edits), options.edits}):
            stream.run_to(mark, until + paused)
            if stream.answered < mark:
                break
            note(str(mark))
        seconds = time.monotonic() - begin - paused
        if str(stream.answered) not in result["marks"]:
            note(str(stream.answered))
        session = server.session(kind)
        before = states(session, drag, 20)
        revision, shown = session.status().revision, session.wait(timeout=600).energy
        settle(server)
        running.end(signal.SIGKILL)
        running.start()
        result["killed"] = returned(server, kind, revision)
        session = server.session(kind)
        result["same_undo"] = states(session, drag, 20) == before
        result["energy_off"] = abs(session.wait(timeout=600).energy - shown) / max(abs(shown), 1e-300)
        result["energy_off_cold"] = relative_difference(server, session, scene_of(server, kind, opening()))
        result.update(edits=stream.answered, refused=stream.refused, edits_per_s=round(stream.answered / seconds))
        if stream.refused:
            result["fault"] = stream.fault
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--edits", type=int, default=1_000_000)
    parser.add_argument("--minutes", type=float, default=15)
    parser.add_argument("--kinds", default=",".join(KINDS))
    parser.add_argument("--in-flight", type=int, default=200)
    parser.add_argument("--json", help="file for the result")
    options = parser.parse_args()
    results = {}
    for kind in options.kinds.split(","):
        results[kind] = run(kind, options)
        print(json.dumps({kind: results[kind]}), flush=True)
    if options.json:
        Path(options.json).write_text(json.dumps(results, indent=1) + "\n")
    is_sound = all(one["same_undo"] and one["energy_off"] < 1e-6 and one["energy_off_cold"] < 1e-6 for one in results.values())
    return 0 if is_sound else 1


if __name__ == "__main__":
    sys.exit(main())
