#!/usr/bin/python3
"""Edits of a week in as long as there is: sessions of all kinds are edited without a pause, watched, and others are opened and
closed beside them. What limberd takes over time is drawn.

usage: tests/chaos/week.py [--minutes 60] [--week 201600] [--picture FILE.png] [--json FILE]

A week: --week edits of each session (one a second, eight hours on seven days); it ends when all sessions had theirs, or after
--minutes. Prints one JSON object: edits, seconds, resident memory and acknowledgements in the first and last tenth of the time
(a minute at least), file sizes, and how long the sessions took to come back after kill -9. LIMBER_BIN: the folder of limberd."""

import argparse
import contextlib
import os
import signal
import statistics
import sys
import tempfile
import threading
import time
from pathlib import Path

from kills import Beams, Body, Linkage
from reporting import give_out

import limber
from conftest import small_scene
from design_inputs import strip_scene
from limber.launching import find_binary
from test_restarts import Restartable

SAMPLE_SECONDS = 2.0


class Editor(threading.Thread):
    """Edits a session, and now and then waits for its answer, or undoes and redoes."""

    def __init__(self, drag, endpoint, edits):
        super().__init__(daemon=True)
        self.drag, self.endpoint, self.edits = drag, endpoint, edits
        self.latencies, self.fault, self.is_over = [], None, threading.Event()
        self.start()

    def run(self):
        try:
            with limber.connect(self.endpoint, timeout=120) as server:
                session = server.session(self.drag.name)
                while self.drag.acknowledged < self.edits and not self.is_over.is_set():
                    count = self.drag.acknowledged
                    begin = time.perf_counter()
                    self.drag.step(session, 0.1 if count % 50 == 49 else 0.2 if count % 50 == 0 else 1.0)
                    self.latencies.append(time.perf_counter() - begin)
                    if len(self.drag.past) > 1000:  # what the server may have forgotten, too
                        self.drag.past = self.drag.past[-500:]
                    self.drag.history.clear()
                    if count % 100 == 0 and not session.wait(timeout=120).final:
                        raise AssertionError(f"{self.drag.name} is not solved")
        except Exception as fault:  # noqa: BLE001  (told by the main thread)
            self.fault = fault


class Watcher(threading.Thread):
    """Reads the stream of a session, from a connection of its own, anew every half minute."""

    def __init__(self, endpoint, name):
        super().__init__(daemon=True)
        self.endpoint, self.name, self.is_over, self.messages = endpoint, name, threading.Event(), 0
        self.start()

    def run(self):
        with contextlib.suppress(limber.LimberError):
            while not self.is_over.is_set():
                with limber.connect(self.endpoint, timeout=60) as server, server.session(self.name).stream() as stream:
                    until = time.monotonic() + 30
                    while time.monotonic() < until and not self.is_over.is_set():
                        with contextlib.suppress(limber.ServerUnreachable):
                            stream.next(1)
                            self.messages += 1


def resident(pid):
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def size_of(folder):
    return sum(path.stat().st_size for path in folder.iterdir() if not path.name.endswith("-shm"))


def run(minutes, week):
    samples = []
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        folder = Path(folder)
        running = Restartable(find_binary("limberd"), folder, folder / "cache", "--data", str(folder / "data"))
        stack.callback(running.close)
        server = stack.enter_context(limber.connect(running.endpoint, timeout=120))
        drags = [Body(server, "body", {"scene": small_scene()}), Linkage(server, "linkage", {"scene": strip_scene()}),
                 Beams(server, "beams", {"sample": "arch"})]
        editors = [Editor(drag, running.endpoint, week) for drag in drags]
        watchers = [Watcher(running.endpoint, drag.name) for drag in drags]
        begin, visits = time.monotonic(), 0
        while any(editor.is_alive() for editor in editors) and time.monotonic() < begin + 60 * minutes:
            time.sleep(SAMPLE_SECONDS)
            with limber.connect(running.endpoint, timeout=120) as visitor:
                visitor.open(small_scene(), session="visit", progress=False).close()
            visits += 1
            latencies = [value for editor in editors for value in take(editor.latencies)]
            samples.append({"s": time.monotonic() - begin, "edits": sum(drag.acknowledged for drag in drags),
                            "rss_mb": resident(running.process.pid) / 1e6, "file_mb": size_of(folder / "data") / 1e6,
                            "ack_p50_ms": 1e3 * statistics.median(latencies) if latencies else None,
                            "ack_p99_ms": 1e3 * sorted(latencies)[int(0.99 * len(latencies))] if latencies else None})
        for thread in editors + watchers:
            thread.is_over.set()
        for thread in editors + watchers:
            thread.join(120)
        faults = [f"{editor.drag.name}: {editor.fault}" for editor in editors if editor.fault]
        seconds = time.monotonic() - begin
        running.end(signal.SIGKILL)
        running.start()
        returns = {}
        for drag in drags:
            before = time.perf_counter()
            try:
                session = server.session(drag.name)
                returns[drag.name] = time.perf_counter() - before
                if session.status().revision != drag.revision:
                    faults.append(f"{drag.name} is not as it was acknowledged")
            except limber.LimberError as fault:
                faults.append(f"{drag.name} does not come back: {fault}")
    return samples, {"seconds": seconds, "edits": {drag.name: drag.acknowledged for drag in drags}, "visits": visits,
                     "messages": sum(watcher.messages for watcher in watchers), "faults": faults, "back_s": returns,
                     "first": summary(samples, False), "last": summary(samples, True)}


def take(values):
    count = len(values)
    taken = values[:count]
    del values[:count]
    return taken


def summary(samples, of_end):
    """Of the first or last tenth of the time, a minute at least; not of the first ten seconds."""
    end = samples[-1]["s"]
    span = max(60.0, end / 10)
    chosen = [one for one in samples if (one["s"] >= end - span if of_end else 10 <= one["s"] <= 10 + span)] or samples
    return {name: round(statistics.median(one[name] for one in chosen if one[name] is not None), 3)
            for name in ("rss_mb", "file_mb", "ack_p50_ms", "ack_p99_ms")}


def draw(samples, path):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(3, 1, figsize=(7, 7), sharex=True, constrained_layout=True)
    edits = [one["edits"] / 1e3 for one in samples]
    axes[0].plot(edits, [one["rss_mb"] for one in samples])
    axes[0].set_ylabel("resident memory [MB]")
    axes[1].plot(edits, [one["ack_p50_ms"] for one in samples], label="median")
    axes[1].plot(edits, [one["ack_p99_ms"] for one in samples], label="99 %")
    axes[1].set_ylabel("acknowledged after [ms]")
    axes[1].set_yscale("log")
    axes[1].legend()
    axes[2].plot(edits, [one["file_mb"] for one in samples])
    axes[2].set_ylabel("stored [MB]")
    axes[2].set_xlabel("edits of three sessions [thousand]")
    for one in axes:
        one.grid(alpha=0.3)
    axes[0].set_ylim(bottom=0)
    axes[2].set_ylim(bottom=0)
    figure.savefig(path, dpi=90)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=60)
    parser.add_argument("--week", type=int, default=7 * 8 * 3600)
    parser.add_argument("--picture", help="file of the drawing, .png")
    parser.add_argument("--json", help="file for the result with all samples")
    options = parser.parse_args()
    samples, result = run(options.minutes, options.week)
    give_out(result, options.json, {"samples": samples})
    if options.picture:
        draw(samples, options.picture)
    return 1 if result["faults"] else 0


if __name__ == "__main__":
    sys.exit(main())
