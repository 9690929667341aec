#!/usr/bin/python3
"""Ends and starts limberd again, and compares the final answers of two linkages: a grid with pins and random loads, and a
buckled arch under other loads, its pins moved.

usage: tests/chaos/linkage_restarts.py [--restarts 100] [--seed 1] [--force 2] [--json FILE]

Prints one JSON object: restarts, answers compared (converged, or balanced but not certified as stable) and failed solves (not
compared), and the largest relative differences of energy (1e-9 is allowed) and shape (1e-6). LIMBER_BIN: the folder of limberd."""

import argparse
import contextlib
import random
import signal
import sys
import tempfile
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "clients/python"), str(ROOT / "tests/integration")]

import limber  # noqa: E402
import numpy as np  # noqa: E402
from limber.launching import find_binary  # noqa: E402
from reporting import end_with  # noqa: E402
from test_linkage_restarts import answer_of, open_arch, open_grid  # noqa: E402
from test_restarts import Restartable  # noqa: E402

ENERGY, SHAPE = 1e-9, 1e-6


def load_grid(session, numbers, force):
    for _ in range(3):
        session.load(numbers.randrange(81), force=[numbers.uniform(-force, force) for _ in range(3)])
        session.wait(timeout=120)


def load_arch(session, numbers, force):
    """Sometimes from above, so that it snaps through."""
    session.pin(1, position=(numbers.uniform(0.9, 0.97), 0, 0.002), held="both")
    session.load(2, force=(0, 0, numbers.uniform(-0.1, 0.1) * force))


def compare(before, after):
    """@returns relative differences of energy and shape, and what else differs"""
    (was, shape_before), (now, shape) = before, after
    faults = [f"{name} was {old}, is {new}" for name, old, new in (
        ("status", was.status, now.status), ("solve_failed", was.solve_failed, now.solve_failed),
        ("revision", was.revision, now.revision), ("iterations", 0, now.iterations)) if old != new]
    energy = abs(now.energy - was.energy) / max(abs(was.energy), 1e-12)
    moved = np.abs(shape - shape_before).max() / np.ptp(shape_before)
    if not energy <= ENERGY:
        faults.append(f"energy was {was.energy}, is {now.energy}")
    if not moved <= SHAPE:
        faults.append(f"the shape moved by {moved} of its size")
    return energy, moved, faults


def run(options):
    numbers = random.Random(options.seed)
    energies, shapes, faults, statuses = [0.0], [0.0], [], Counter()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        running = Restartable(find_binary("limberd"), folder, folder / "cache", "--data", str(folder / "data"))
        with contextlib.closing(running), limber.connect(running.endpoint, timeout=60) as server:
            edits = {"grid": load_grid, "arch": load_arch}
            sessions = {"grid": open_grid(server), "arch": open_arch(server)}
            for restart in range(options.restarts):
                before, conditions = {}, {}
                for name, session in sessions.items():
                    edits[name](session, numbers, options.force)
                    before[name], conditions[name] = answer_of(session), session.conditions()
                running.restart(signal.SIGKILL if restart % 2 else signal.SIGTERM)
                for name in sessions:
                    sessions[name] = server.session(name)
                    after = answer_of(sessions[name])
                    if sessions[name].conditions() != conditions[name]:
                        faults.append(f"restart {restart}: {name} has other conditions")
                    if before[name][0].solve_failed:  # the answer may come before it is stored
                        statuses["failed"] += 1
                        continue
                    statuses[before[name][0].status] += 1
                    energy, shape, others = compare(before[name], after)
                    energies.append(energy)
                    shapes.append(shape)
                    faults += [f"restart {restart}: {name}: {other}" for other in others]
    return {"restarts": options.restarts, "answers": dict(statuses), "faults": faults,
            "energy_max": max(energies), "shape_max": max(shapes)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--restarts", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--force", type=float, default=2, help="largest component of a load on the grid [N]; 1/10 of it on the arch")
    parser.add_argument("--json", help="file for the result")
    options = parser.parse_args()
    return end_with(run(options), options.json)


if __name__ == "__main__":
    sys.exit(main())
