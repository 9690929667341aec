"""Three poses of a bird's wings and a partial constraint, interpolated: prints their errors and the cost."""

import limber
import numpy as np


def bent(rest, curvature):
    """Both wings (along z, up is y) rolled up from the body on, by so much per unit of length."""
    x, y, z = rest.T
    turn = curvature * np.maximum(abs(z) - 0.06, 0)  # the body, which is held, stays
    across = abs(z) - turn / curvature + (1 / curvature - y) * np.sin(turn)
    return np.stack([x, y * np.cos(turn) + (1 - np.cos(turn)) / curvature, np.sign(z) * across], axis=1)


with limber.launch() as server:
    scene = server.sample("bird")
    scene.frames, scene.model.candidate_modes = 41, 60  # for materials to mix
    del scene.constraints[:]
    bird = server.open(scene)
    rest = bird.geometry().rest.astype(float)
    poses = {10: bent(rest, 1.5), 20: bent(rest, -1.0), 30: bent(rest, 1.5)}
    bird.edit([limber.add_keyframe(frame=frame, positions=pose) for frame, pose in poses.items()])
    tip = int(rest[:, 2].argmax())
    bird.add(frame=25, node=tip, position=rest[tip], axes="y")  # in between, one wing tip is level
    print(f"optimised     energy  poses missed  tip missed   of a span of {np.ptp(rest[:, 2]):.3g}")
    for variables in ("motion", "all"):
        bird.optimise(variables)
        result = bird.wait()
        print(f"{variables:>9} {result.energy:10.2e} {result.max_keyframe_error:13.2e} {result.max_error:11.2e}")
