"""A simulated flower, edited: `edit_simulation.py [FRAMES]` prints the error of its constraint and the cost."""

import sys

import limber

frames = int(sys.argv[1]) if len(sys.argv) > 1 else 120
with limber.launch() as server:
    scene = server.sample("flower")
    tip = scene.constraints[0].nodes[0]
    scene.frames, scene.dynamics.period_frames = frames, 0  # time as the simulation has it: in seconds
    del scene.constraints[:]
    push = limber.force(tip, (0.05, 0, 0), until_frame=30, profile="sine", period_frames=60)
    made = server.simulate(scene, limber.simulation(forces=[push], steps_per_frame=2, relaxation_time=0.01))
    print(f"{len(made.positions)} frames simulated in {made.steps} steps; {made.message or 'no tet is inside out'}")

    scene.base_motion.CopyFrom(limber.base_motion(made.positions))
    session = server.open(scene)
    frame = 3 * frames // 4
    at = made.positions[frame, tip]
    held = session.add(node=tip, frame=frame, position=at)
    print(f"{'lift':>6} {'missed':>10} {'energy':>10}   of node {tip} in frame {frame}")
    for lift in (0.0, 0.05, 0.1, 0.2):
        held.move(at + (0, 0, lift))
        result = session.wait()
        print(f"{lift:6.2f} {result.max_error:10.2e} {result.energy:10.2e}")
