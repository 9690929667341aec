#!/usr/bin/env bash
# With what frequencies and damping did this move? recover_material.sh [FOLDER]. Needs limber on PATH and a limberd.
set -euo pipefail
out=${1:-out/recover_material}
mkdir -p "$out"
limber open --sample bird --session flight          # a motion to recover from; limberd is not needed beyond this
limber dynamics flight --damping-ratio 0.02
limber ends flight --first position_velocity --last free
limber wait flight
limber export flight --format scene pvd --stem flight --out "$out"
limber close flight

sed '0,/{/s//{"base_motion": {"path": "flight.pvd"},/' "$out/flight.json" > "$out/truth.json"
# Forces act as long as the flight is led; what comes behind is how the bird swings by itself.
limber recover "$out/truth.json" --driven 70 --frames 110 --modes 3 --candidate-modes 12 -o "$out/continued.pc2"
