"""A gridshell, bent up from a flat grid by moving its rim inwards: then snow on one half, and a rim that gives way."""

import sys

import limber
import numpy as np

OUT = sys.argv[1] if len(sys.argv) > 1 else "out/gridshell"


def report(shell, what, before):
    result, now = shell.wait(), shell.frames()[-1]
    jumped = "".join(f", node {snap.node} snaps by {snap.turn:.2f} rad" for snap in result.snaps)
    low, high = (round(float(z), 2) + 0.0 for z in (now[:, 2].min(), now[:, 2].max()))
    by = result.method.replace("_", " ")  # relaxation, where the branch of equilibria cannot be followed, sees no snaps
    print(f"{what}: {result.status.lower()} by {by}, z from {low:.2f} to {high:.2f} m, "
          f"moved by {np.linalg.norm(now - before, axis=1).max():.3f} m, utilisation {result.utilisation:.2f}{jumped}")
    return now


with limber.launch() as server:
    shell = server.open(sample="gridshell")
    shape = report(shell, "bent up", drawn := shell.geometry().rest)
    shell.edit([limber.beam_edits.load(node, (0, 0, -60)) for node in range(len(drawn)) if drawn[node, 0] > 0])
    shape = report(shell, "snow on one half", shape)
    # All in one request: else the shell would follow each support as it comes, and show the snaps in between.
    shell.edit([limber.beam_edits.move(motion.node, **{axis: 0.7 * getattr(motion, axis) for axis in "xy" if motion.HasField(axis)})
                for motion in shell.structure().motions])
    report(shell, "rim a third back", shape)
    for path in shell.export(OUT, ("vtu", "csv"), stem="gridshell", progress=False):
        print(path)
