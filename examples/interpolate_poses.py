"""Three poses of a bird's wings and a partial constraint, interpolated: `interpolate_poses.py` prints what it costs."""

import numpy as np

import limber


def bent(rest, curvature):
    """Both wings (along z, up is y) rolled up from the body on, by so much per unit of length."""
    x, y, z = rest.T
    along = np.maximum(abs(z) - 0.06, 0)  # the body, which is held, stays
    turn = curvature * along
    return np.stack([x, y * np.cos(turn) + (1 - np.cos(turn)) / curvature,
                     np.sign(z) * (abs(z) - along - y * np.sin(turn) + np.sin(turn) / curvature)], axis=1)


with limber.launch() as server:
    scene = server.sample("bird")
    scene.frames, scene.material_optimisation.variables = 41, limber.optimise("all").set_material.variables
    del scene.constraints[:]
    bird = server.open(scene)
    bird.wait_ready()
    rest = bird.geometry().rest.astype(float)
    bird.edit([limber.add_keyframe(frame=frame, positions=bent(rest, curvature))
               for frame, curvature in ((10, 1.5), (20, -1.0), (30, 1.5))])
    tip = int(rest[:, 2].argmax())
    bird.add(frame=25, node=tip, position=rest[tip], axes="y")  # on the way, one wing tip is level
    print(f"{'optimised':>9} {'energy':>10} {'poses missed':>12} {'tip missed':>10}   of a span of {np.ptp(rest[:, 2]):.3g}")
    for variables in ("motion", "all"):
        bird.optimise(variables)
        result = bird.wait()
        print(f"{variables:>9} {result.energy:10.3e} {result.max_keyframe_error:12.2e} {result.max_error:10.2e}")
