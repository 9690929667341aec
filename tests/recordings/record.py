#!/usr/bin/python3
"""Records one session of each kind against the limberd of LIMBER_BIN, into tests/recordings/VERSION.

usage: tests/recordings/record.py FOLDER"""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "clients/python"), str(ROOT / "tests/integration")]

import limber  # noqa: E402
from conftest import small_scene, tip_of  # noqa: E402
from design_inputs import strip_scene  # noqa: E402
from limber.recorder import Recorder  # noqa: E402


def refused(call, *arguments, **options):
    try:
        call(*arguments, **options)
    except limber.LimberError:
        return
    raise AssertionError("this should have been refused")


def bodies(server):
    session = server.open(small_scene(), session="body", progress=False)
    session.wait()
    tip = tip_of(session)
    held = session.add(node=tip, frame=30, displacement=(0, 0.1, 0))
    session.wait()
    for step in range(4):
        held.move((0, 0.1 + 0.02 * step, 0.01))
        session.wait()
    session.add(node=tip, frame=45, displacement=(0, 0, 0.05))
    session.wait()
    session.undo()
    session.wait()
    refused(session.add, node=10 ** 6, frame=3, displacement=(0, 0, 0))
    refused(session.add, node=tip, frame=10 ** 6, displacement=(0, 0, 0))
    held.remove()
    session.wait()
    session.status()
    session.explain()
    session.close()


def linkages(server):
    session = server.open(strip_scene(), session="linkage", progress=False)
    session.wait()
    session.load(0, force=(0, 0, 1e-3))
    session.wait()
    session.load(0, force=(0, 0, 2e-3))
    session.wait()
    session.undo()
    session.wait()
    refused(session.load, 10 ** 6, force=(0, 0, 1))
    session.conditions()
    session.close()


def beams(server):
    session = server.open(sample="arch", session="beams", progress=False)
    session.wait()
    session.gravity((0, 0, -5.0))
    session.wait()
    session.gravity((0, 0, -9.81))
    session.wait()
    session.undo()
    session.wait()
    session.redo()
    session.wait()
    refused(session.hold, 10 ** 6)
    session.structure()
    session.close()


def main():
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for kind in (bodies, linkages, beams):
        path = folder / f"{kind.__name__}.limberrec"
        path.unlink(missing_ok=True)
        with limber.launch() as running:
            with Recorder(running.connection.endpoint, path, server_version=running.info().server_version) as recorder:
                with limber.connect(recorder.endpoint) as server:
                    kind(server)
        print(f"{path}: {recorder.messages} messages, {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
