"""A job of the public relaxation code (a folder with SimulationJob.json), taken further: a load at its highest node."""

import sys

import limber

if len(sys.argv) != 2:
    sys.exit(f"usage: {sys.argv[0]} FOLDER, which has a SimulationJob.json")

with limber.launch() as server:
    roof = server.open(sys.argv[1])
    result = roof.wait()
    solution = roof.solution()
    top = int(solution.positions[:, 2].argmax())
    print(f"{result.status.lower()} by {result.method}: {len(solution.elements)} elements, energy {result.energy:.4g} J, "
          f"node {top} is the highest at {solution.positions[top, 2]:.4g} m")
    for load in (50, 100):
        roof.load(top, force=(0, 0, -1000 * load))
        result = roof.wait()
        print(f"{load} kN on it: {result.status.lower()} in {result.steps} steps and {result.since_edit_ms:.0f} ms, it sinks by "
              f"{1000 * (solution.positions[top, 2] - roof.solution().positions[top, 2]):.3g} mm")
    roof.undo()
    print(f"one back: energy {roof.wait().energy:.4g} J")
