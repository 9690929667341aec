"""A gridshell, bent up from a flat grid by moving its rim inwards: then snow on one half, and a rim that gives way."""

import sys

import limber

OUT = sys.argv[1] if len(sys.argv) > 1 else "out/gridshell"


def tell(shell, what):
    result = shell.wait()
    jumped = "".join(f", node {snap.node} snaps by {snap.turn:.2f} rad" for snap in result.snaps)
    print(f"{what}: {result.status.lower()}, {result.steps} shapes, highest point {shell.frames()[-1][:, 2].max():.3f} m, "
          f"utilisation {result.utilisation:.2f}{jumped}")


with limber.launch() as server:
    shell = server.open(sample="gridshell")
    tell(shell, "bent up")
    drawn = shell.geometry().rest
    shell.edit([limber.beam_edits.load(node, (0, 0, -15)) for node in range(len(drawn)) if drawn[node, 0] > 0])
    tell(shell, "snow on one half")
    for motion in shell.structure().motions:
        shell.move_support(motion.node, **{axis: 0.7 * getattr(motion, axis) for axis in "xy" if motion.HasField(axis)})
    tell(shell, "rim a third back")
    for path in shell.export(OUT, ("vtu", "csv"), stem="gridshell", progress=False):
        print(path)
