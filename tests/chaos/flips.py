#!/usr/bin/python3
"""Single bits of a store that are flipped while no server has it: whether limberd says so wherever something is not as it was.

usage: tests/chaos/flips.py [--trials 300] [--seed 1] [--json FILE]

A store of six sessions (bodies with 0 to 25 edits, some behind checkpoints, and the arch of beams) is copied for each trial, one bit of
sessions.sqlite is flipped, mostly where SQLite keeps headers, pointers and the keys of rows, and limberd begins with it. All sessions are
brought back and compared with what they are without a flip: revisions, and energies to 1e-3. Prints how many trials ended how; `silent`
has those in which something differs and neither a client nor the log (warn, error) nor the store's fault says anything. Exits with 1 where
there are any. LIMBER_BIN: the folder of limberd."""

import argparse
import collections
import random
import shutil
import signal
import sys
import tempfile
from pathlib import Path

import kills  # noqa: F401 (where limber and the tests are)
from reporting import give_out

import limber
from conftest import small_scene, tip_of
from limber.launching import find_binary
from test_restarts import Restartable

EDITS = (0, 3, 25, 20, 7)


def begin(folder, data):
    return Restartable(find_binary("limberd"), folder, folder / "cache", "--data", str(data), "--data-outlives", "process",
                       "--checkpoint-edits", "10")


def make(folder, data):
    running = begin(folder, data)
    with limber.connect(running.endpoint) as server:
        for number, edits in enumerate(EDITS):
            session = server.open(small_scene(frames=20 + number), session=f"body-{number}", progress=False)
            for step in range(edits):
                session.add(node=tip_of(session), frame=5 + step % 10, displacement=(0, 0.01 * step, 0))
                session.wait()
        server.open(sample="arch", session="arch", progress=False).wait()
    running.end(signal.SIGTERM)
    running.close()


def seen(server):
    """Of each session its revision and energy, or the code of the error that it has."""
    states = {}
    for status in server.sessions():
        try:
            session = server.session(status.session)
            result = session.wait(timeout=30)
            states[status.session] = (result.revision, result.energy)
        except limber.LimberError as error:
            states[status.session] = error.code
    return states


def is_same(one, other):
    if isinstance(one, str) or isinstance(other, str) or one[0] != other[0]:
        return False
    return abs(one[1] - other[1]) <= 1e-3 * abs(other[1]) + 1e-12


def place(rng, length, page):
    """A byte: of a page's header, of its pointers to cells, of a cell, or any."""
    begin_of_page = page * rng.randrange(length // page)
    within = rng.choice((rng.randrange(12), rng.randrange(8, 60), page - 1 - rng.randrange(200), rng.randrange(page)))
    return min(begin_of_page + within + (100 if begin_of_page == 0 else 0), length - 1)


def trial(folder, data, truth):
    """@returns how it ended, and the states that were seen"""
    (folder / "log").unlink(missing_ok=True)
    try:
        running = begin(folder, data)
    except AssertionError:
        return "refused to start", None
    with limber.connect(running.endpoint, timeout=60) as server:
        states, fault = seen(server), server.info().store.fault
    running.end(signal.SIGTERM)
    running.close()
    log = (folder / "log").read_text(errors="replace")
    is_said = bool(fault) or " warn " in log or " error " in log or any(isinstance(state, str) for state in states.values())
    if set(states) == set(truth) and all(is_same(states[name], truth[name]) for name in truth):
        return ("same, said" if is_said else "same"), states
    return ("differs, said" if is_said else "silent"), states


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", help="file for the result")
    options = parser.parse_args()
    rng, counts, silent = random.Random(options.seed), collections.Counter(), []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        make(folder, folder / "store")
        data = folder / "data"
        shutil.copytree(folder / "store", data)
        running = begin(folder, data)
        with limber.connect(running.endpoint) as server:
            truth = seen(server)
        running.close()
        content = (folder / "store" / "sessions.sqlite").read_bytes()
        page = int.from_bytes(content[16:18], "big")
        for _ in range(options.trials):
            shutil.rmtree(data)
            shutil.copytree(folder / "store", data)
            at, bit = place(rng, len(content), page), rng.randrange(8)
            flipped = bytearray(content)
            flipped[at] ^= 1 << bit
            (data / "sessions.sqlite").write_bytes(flipped)
            how, states = trial(folder, data, truth)
            counts[how] += 1
            if how == "silent":
                silent.append({"byte": at, "bit": bit, "seen": states, "truth": truth})
    give_out({"trials": options.trials, "seed": options.seed, **counts, "silent": silent}, options.json)
    return 1 if silent else 0


if __name__ == "__main__":
    sys.exit(main())
