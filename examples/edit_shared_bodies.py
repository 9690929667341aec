#!/usr/bin/env python3
"""Opens the beam, the dinosaur and the tyrannosaurus of ../shared/data/bodies and edits each of them live.

The dinosaur follows the author's path constraints (shared_bodies.py explains how to read them), the others are bent at the node
farthest from their fixed nodes. Prints a line per edit. Run it with

    PYTHONPATH=clients/python examples/edit_shared_bodies.py [beam] [dino] [tyrannosaurus]
"""

import argparse
import sys
import time

import limber
import numpy as np
import shared_bodies

FRAMES = {"beam": 200, "dino": 400, "tyrannosaurus": 350}  # dino: its last path constraint is in frame 399


def report(session: limber.Session, what: str, start: float) -> limber.Result:
    """Waits for the final result of the last edit, and prints it."""
    acknowledged = time.monotonic()
    result = session.wait()
    print(f"  {what:<44} ack {1e3 * (acknowledged - start):7.2f} ms, final {1e3 * (time.monotonic() - start):8.2f} ms, "
          f"error {result.max_error:.2e}, energy {result.energy:.4g}, {result.status}")
    return result


def edit_far_node(session: limber.Session, fixed: list[int]) -> None:
    """Bends the body at the node farthest from its fixed nodes: to one side, back, up, and drags the first one on."""
    rest = session.geometry().rest
    node = int(np.linalg.norm(rest - rest[fixed].mean(axis=0), axis=1).argmax())
    size = float((rest.max(axis=0) - rest.min(axis=0)).max())
    frames = session.status().frames
    made = []
    for share, direction in ((0.3, (0, 0, 0.2)), (0.5, (0, 0, -0.2)), (0.7, (0, 0.2, 0))):
        start = time.monotonic()
        made.append(session.add(node=node, frame=round(share * frames), displacement=size * np.array(direction)))
        report(session, f"node {node}, frame {made[-1].frame}: {direction} body lengths", start)
    for step in (0.25, 0.3):
        start = time.monotonic()
        made[0].move((0, 0, step * size))
        report(session, f"drag frame {made[0].frame} to {step} body lengths", start)
    start = time.monotonic()
    session.undo()
    report(session, "undo", start)


def edit_dino(session: limber.Session) -> None:
    """The author's path, a third of it at a time, then one target lowered."""
    path = shared_bodies.path_constraints(shared_bodies.folder() / "dino" / "path_con.txt")
    for first in range(0, len(path), 5):
        start = time.monotonic()
        receipt = session.edit([limber.add(frame=c["frame"], nodes=c["nodes"], position=c["position"])
                                for c in path[first:first + 5]])
        report(session, f"path, frames {path[first]['frame']} to {path[first + 4]['frame']}", start)
    start = time.monotonic()
    session.move(receipt.constraint_ids[0], path[10]["position"] - (0, 0.03, 0))
    report(session, f"lower the head in frame {path[10]['frame']}", start)


def edit(server: limber.Server, name: str) -> limber.Session:
    """Opens one body, edits it, and returns its session."""
    options = {"last_end": "free"} if name == "dino" else {}
    scene = shared_bodies.scene(name, FRAMES[name], **options)
    session = server.open(scene)
    status = session.status()
    model = status.model
    print(f"{name}: {status.tets} tets, {len(scene.fixed_nodes)} fixed nodes, {status.frames} frames, "
          f"{model.basis_size} basis columns, {model.cubature_size} cubature tets, {100 * model.error_mean:.2f} % error, "
          f"built in {model.build_s:.1f} s")
    if name == "dino":
        edit_dino(session)
    else:
        edit_far_node(session, list(scene.fixed_nodes))
    return session


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", default=list(FRAMES), help="bodies (default: all three)")
    names = parser.parse_args().names
    for name in names:
        if name not in FRAMES:
            parser.error(f"{name}: choose from {', '.join(FRAMES)}")
    if not shared_bodies.folder().is_dir():
        print(f"no {shared_bodies.folder()}: set LIMBER_SHARED to the folder that holds data/bodies")
        return 1
    with limber.launch() as server:
        for name in names:
            edit(server, name)
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except limber.LimberError as error:
        sys.exit(f"edit_shared_bodies: {error}")
