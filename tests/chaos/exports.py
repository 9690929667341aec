#!/usr/bin/python3
"""Drags a body while others export another one, and measures how long first frames take.

usage: tests/chaos/exports.py [--exports 60] [--seconds 12] [--rate 30] [--sample flower] [--format pvd] [--json FILE]

Prints one JSON object: exports that were complete, and from the edit to its acknowledgement and to the first frames that contain it, in
milliseconds. Exports are of as many clients, in one process, each with one request under way. --exports 0: nothing beside.
LIMBER_BIN: the folder of limberd."""

import argparse
import contextlib
import multiprocessing
import os
import sys
import tempfile
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "clients/python")]

import limber  # noqa: E402
import numpy as np  # noqa: E402
from limber.exports import fetch  # noqa: E402
from reporting import give_out  # noqa: E402


def export(endpoint, session, options, exported):
    def work():
        with limber.connect(endpoint, timeout=120) as server:
            while True:
                fetch(server.session(session), options.format)
                with exported.get_lock():
                    exported.value += 1

    threads = [threading.Thread(target=work) for _ in range(options.exports)]
    for thread in threads:
        thread.start()


class Arrivals:
    """When the first frames of each revision came."""

    def __init__(self, session):
        self.times, self.last = {}, session.status().revision
        self.stream = session.stream(snapshot=False)
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        with contextlib.suppress(limber.LimberError):
            for frames in self.stream:
                now, newest = time.perf_counter(), frames.result.revision
                self.times.update((revision, now) for revision in range(self.last + 1, newest + 1))
                self.last = max(self.last, newest)


def drag(session, options):
    """@returns times [ms] to acknowledgements and to first frames, and how many frames came not within a second"""
    (held, *_), size = session.constraints(), np.ptp(session.geometry().rest, axis=0).max()
    arrivals, sent, acknowledged = Arrivals(session), {}, []
    begin = time.perf_counter()
    for number in range(round(options.seconds * options.rate)):
        time.sleep(max(0.0, begin + number / options.rate - time.perf_counter()))
        turn = 0.2 * number
        at = time.perf_counter()
        revision = session.move(held.id, np.add(held.target, 0.02 * size * np.array([np.cos(turn), np.sin(turn), 0]))).revision
        acknowledged.append(1e3 * (time.perf_counter() - at))
        sent[revision] = at
    time.sleep(1)
    first = [1e3 * (arrivals.times[revision] - at) for revision, at in sent.items() if revision in arrivals.times]
    return acknowledged, first, sum(late > 1e3 for late in first) + len(sent) - len(first)


def run(options):
    exported = multiprocessing.Value("i", 0)
    with tempfile.TemporaryDirectory() as folder, limber.launch(cache_dir=folder) as server:
        dragged, other = (server.open(sample=options.sample, session=name, progress=False) for name in ("dragged", "other"))
        dragged.wait(timeout=300)
        other.wait(timeout=300)
        beside = multiprocessing.Process(target=export, args=(server.connection.endpoint, other.id, options, exported))
        beside.start()
        time.sleep(3)
        before = exported.value
        acknowledged, first, missed = drag(dragged, options)
        complete = exported.value - before
        beside.kill()
    result = {"exports": options.exports, "exported": complete, "edits": len(acknowledged), "missed": missed, "load": os.getloadavg()[0]}
    for name, times in (("ack", acknowledged), ("first", first)):
        result |= {f"{name}_p{share}_ms": round(float(np.percentile(times, share)), 2) for share in (50, 99)}
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--exports", type=int, default=60)
    parser.add_argument("--seconds", type=float, default=12)
    parser.add_argument("--rate", type=float, default=30, help="edits a second")
    parser.add_argument("--sample", default="flower")
    parser.add_argument("--format", default="pvd")
    parser.add_argument("--json", help="file for the result")
    options = parser.parse_args()
    give_out(run(options), options.json)


if __name__ == "__main__":
    sys.exit(main())
