#!/usr/bin/python3
"""Exchanges limberd for another build, and back, while clients edit and watch sessions of all kinds.

usage: tests/chaos/upgrade.py --before FOLDER [--rounds 3] [--seed 1] [--json FILE]

--before: the folder with the other build's limberd; LIMBER_BIN: this one's. Each round ends the server with SIGTERM, as a
service manager does, and starts the other build at the same address with the same data. Clients are this build's, keep their
connections and subscriptions, and do not know. The last start is of this build. --forward-only: from the other build to
this one once, where that cannot read what this one wrote.

Prints one JSON object: exchanges, acknowledged edits, faults (an edit lost, a session that is not there, a subscriber that
sees nothing of what is edited later: none is wanted), for how long edits had to wait (the longest, each exchange)."""

import argparse
import contextlib
import random
import signal
import sys
import tempfile
import threading
import time
from pathlib import Path

from kills import Beams, Body, Linkage
from reporting import end_with

import limber
from conftest import small_scene
from design_inputs import strip_scene
from limber.launching import find_binary
from test_restarts import Restartable


class Client:
    """Edits a session and watches it, through whatever happens to the server."""

    def __init__(self, drag, endpoint, seed):
        self.drag, self.numbers, self.faults, self.waits, self.seen = drag, random.Random(seed), [], [0.0], 0
        self.is_over = False
        self.server = limber.connect(endpoint, timeout=20)
        self.session = self.server.session(drag.name)
        self.stream = self.session.stream()
        self.threads = [threading.Thread(target=self.edit), threading.Thread(target=self.watch, daemon=True)]
        for thread in self.threads:
            thread.start()

    def edit(self):
        while not self.is_over:
            begin = time.perf_counter()
            try:
                self.drag.step(self.session, self.numbers.random())
            except limber.LimberError as error:
                self.look_again(error)
            self.waits.append(time.perf_counter() - begin)
            time.sleep(0.01)

    def look_again(self, error):
        """After an edit that was not answered: it may have been made."""
        try:
            self.session = self.server.session(self.drag.name)
            if not self.drag.check(self.session):
                self.faults.append(f"{self.drag.name} is not as it was acknowledged, after: {error}")
                self.is_over = True
        except limber.ServerUnreachable:
            time.sleep(0.05)
        except limber.LimberError as second:
            self.faults.append(f"{self.drag.name} is not there: {second}, after: {error}")
            self.is_over = True

    def watch(self):
        try:
            for frames in self.stream:
                self.seen = max(self.seen, frames.result.revision)
        except limber.LimberError as error:
            if not self.is_over:
                self.faults.append(f"{self.drag.name}: the subscription ended: {error}")

    def longest_wait(self):
        longest, self.waits = max(self.waits), [0.0]
        return longest

    def end(self):
        self.is_over = True
        self.threads[0].join(60)
        revision = self.session.wait(timeout=60).revision
        deadline = time.monotonic() + 10
        while self.seen < revision and time.monotonic() < deadline:
            time.sleep(0.05)
        if self.seen < revision:
            self.faults.append(f"{self.drag.name}: the subscriber has seen revision {self.seen} of {revision}")
        if not self.drag.check(self.session):
            self.faults.append(f"{self.drag.name} is not as it was acknowledged at the end")
        self.stream.close()
        self.server.close()


def run(options):
    numbers = random.Random(options.seed)
    builds = [str(Path(options.before) / "limberd"), str(find_binary("limberd"))]
    waits, exchanges = [], 0
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        running = Restartable(builds[0], folder, folder / "cache", "--data", str(folder / "data"))
        with contextlib.closing(running):
            with limber.connect(running.endpoint, timeout=60) as server:
                drags = [Body(server, "body", {"scene": small_scene()}), Linkage(server, "linkage", {"scene": strip_scene()}),
                         Beams(server, "beams", {"sample": "arch"})]
            clients = [Client(drag, running.endpoint, numbers.random()) for drag in drags]
            for number in range(1 if options.forward_only else 2 * options.rounds - 1):
                time.sleep(numbers.uniform(1, 2))
                running.end(signal.SIGTERM)
                running.command[0] = builds[(number + 1) % 2]
                running.start()
                exchanges += 1
                time.sleep(3)
                waits.append(max(client.longest_wait() for client in clients))
            for client in clients:
                client.end()
    return {"exchanges": exchanges, "waits_s": [round(wait, 3) for wait in waits], "acknowledged": sum(drag.acknowledged for drag in drags),
            "faults": [fault for client in clients for fault in client.faults], "longest_wait_s": max(waits)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--before", required=True, help="folder of the other build's limberd")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--forward-only", action="store_true")
    parser.add_argument("--json", help="file for the result")
    options = parser.parse_args()
    return end_with(run(options), options.json)


if __name__ == "__main__":
    sys.exit(main())
