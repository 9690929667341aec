"""A flower led along a path: `fit_material.py [SAMPLE]` prints the forces it takes with its own material and a fitted one."""

import sys

import limber

sample = sys.argv[1] if len(sys.argv) > 1 else "flower"
with limber.launch() as server:
    session = server.open(sample=sample, optimise="all")
    print(f"{'optimised':>12} {'forces':>10} {'missed':>10} {'steps':>6}")
    for variables in ("all", "dynamics", "motion"):
        session.edit([limber.reset_material(), limber.optimise(variables)])
        result = session.wait()
        print(f"{variables:>12} {result.unit_force_energy:10.2e} {result.max_error:10.2e} {result.material_iterations:6}")
        if variables == "all":
            fitted = session.material()
    print(f"\n{'mode':>4} {'scene [Hz]':>10} {'fitted [Hz]':>11} {'damping ratio':>13} {'decay [1/s]':>11}")
    for k, (mode, own) in enumerate(zip(fitted.modes[:8], fitted.initial), start=1):
        print(f"{k:4} {own.frequency:10.3f} {mode.frequency:11.3f} {mode.damping_ratio:13.2e} {mode.decay:11.2e}")
