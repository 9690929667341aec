#!/usr/bin/python3
"""Kills limberd at random moments while clients edit sessions of all kinds, and looks for what it had acknowledged.

usage: tests/chaos/kills.py [--kills 500] [--seed 1] [--outlives power|process] [--checkpoint-edits 2000] [--json FILE]

Prints one JSON object: kills, acknowledged edits, lost ones (0 is wanted), sessions that did not come back (0), and how long
a restart and the first answer about a parked session took. LIMBER_BIN: the folder of limberd."""

import argparse
import contextlib
import random
import signal
import statistics
import sys
import tempfile
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "clients/python"), str(ROOT / "tests/integration")]

import limber  # noqa: E402
from conftest import small_scene, tip_of  # noqa: E402
from design_inputs import strip_scene  # noqa: E402
from limber.launching import find_binary  # noqa: E402
from reporting import end_with  # noqa: E402
from test_restarts import Restartable  # noqa: E402


class Drag:
    """One session under edits: sets a number, undoes and redoes, and knows what must be there."""

    def __init__(self, server, name, scene):
        self.name = name
        session = server.open(session=name, progress=False, **scene)
        session.wait(timeout=120)
        self.begin(session)
        self.revision = session.status().revision
        self.past, self.future, self.number, self.acknowledged = [0], [], 0, 0
        self.history = {self.revision: ([0], [])}

    def begin(self, session):
        self.write(session, 0)

    def step(self, session, random_number):
        """One edit. What it leads to is possible from the moment it is sent, and certain once it is answered."""
        past, future = list(self.past), list(self.future)
        if random_number < 0.15 and len(past) > 1:
            future.append(past.pop())
            self.sent = (past, future)
            session.undo()
        elif random_number < 0.3 and future:
            past.append(future.pop())
            self.sent = (past, future)
            session.redo()
        else:
            self.number += 1
            past.append(self.number)
            self.sent = (past, [])
            self.write(session, self.number)
        self.past, self.future = self.sent
        self.revision += 1
        self.acknowledged += 1
        self.history[self.revision] = self.sent

    def check(self, session):
        """Whether what came back is what was acknowledged, or with the edit besides that was on its way."""
        revision, found = session.status().revision, self.read(session)
        if revision == self.revision + 1:
            self.past, self.future = self.history[revision] = self.sent
            self.revision += 1
        return revision == self.revision and found == self.past[-1]

    def go_back(self, session):
        """Of a session that may have lost its last edits: goes on from what is there.
        @returns how many are lost; None where it is as it never was"""
        revision, found = session.status().revision, self.read(session)
        past, future = self.history.get(revision, (None, None))
        if past is None or past[-1] != found:
            return None
        lost, self.revision, self.past, self.future = self.revision - revision, revision, past, future
        return lost


class Body(Drag):
    def begin(self, session):
        self.held = session.add(node=tip_of(session), frame=20, displacement=(0, 0, 0)).id

    def write(self, session, number):
        session.move(self.held, (0, 1e-6 * number, 0))

    def read(self, session):
        (constraint,) = session.constraints()
        return round(constraint.target[1] / 1e-6)


class Linkage(Drag):
    def write(self, session, number):
        session.load(0, force=(0, 0, 1e-6 * number))

    def read(self, session):
        loads = session.conditions().loads
        return round(loads[0].force.z / 1e-6) if loads else 0


class Beams(Drag):
    def write(self, session, number):
        session.gravity((0, 0, -1e-3 * (number + 1)))

    def read(self, session):
        return round(session.structure().gravity.z / -1e-3) - 1


def work(drag, endpoint, seed):
    numbers = random.Random(seed)
    with contextlib.suppress(limber.LimberError), limber.connect(endpoint, timeout=0.5) as server:
        session = server.session(drag.name)
        while True:
            drag.step(session, numbers.random())


def run(options):
    numbers = random.Random(options.seed)
    faults, restarts, returns = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        running = Restartable(find_binary("limberd"), folder, folder / "cache", "--data", str(folder / "data"),
                              "--data-outlives", options.outlives, "--checkpoint-edits", str(options.checkpoint_edits))
        with contextlib.closing(running), limber.connect(running.endpoint, timeout=60) as server:
            drags = [Body(server, "body", {"scene": small_scene()}), Linkage(server, "linkage", {"scene": strip_scene()}),
                     Beams(server, "beams", {"sample": "arch"})]
            for kill in range(options.kills):
                workers = [threading.Thread(target=work, args=(drag, running.endpoint, numbers.random())) for drag in drags]
                for worker in workers:
                    worker.start()
                time.sleep(numbers.uniform(0.02, 0.4))
                running.end(signal.SIGKILL)
                for worker in workers:
                    worker.join(60)
                begin = time.perf_counter()
                running.start()
                restarts.append(time.perf_counter() - begin)
                for drag in drags:
                    begin = time.perf_counter()
                    try:
                        session = server.session(drag.name)
                        returns.append(time.perf_counter() - begin)
                        if not drag.check(session):
                            faults.append(f"kill {kill}: {drag.name} is not as it was acknowledged")
                        if kill % 10 == 9 and not session.wait(timeout=60).final:
                            faults.append(f"kill {kill}: {drag.name} is not solved")
                    except limber.LimberError as error:
                        faults.append(f"kill {kill}: {drag.name} does not come back: {error}")
                if faults:
                    break
            edits = sum(drag.acknowledged for drag in drags)
    return {"kills": kill + 1, "outlives": options.outlives, "acknowledged": edits, "faults": faults,
            "restart_p50_ms": 1e3 * statistics.median(restarts), "restart_max_ms": 1e3 * max(restarts),
            "back_p50_ms": 1e3 * statistics.median(returns), "back_max_ms": 1e3 * max(returns)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--outlives", choices=("power", "process"), default="power")
    parser.add_argument("--checkpoint-edits", type=int, default=2000, help="as of limberd: few, for many checkpoints")
    parser.add_argument("--json", help="file for the result")
    options = parser.parse_args()
    return end_with(run(options), options.json)


if __name__ == "__main__":
    sys.exit(main())
