#!/usr/bin/env bash
# A motion as what is edited next: edit_motion.sh [FOLDER]. Needs limber on PATH and a limberd ($LIMBER_ENDPOINT).
set -euo pipefail
out=${1:-out/edit_motion}
mkdir -p "$out"
limber open --sample bird --session flight          # its own constraints make the first motion
limber wait flight
limber export flight --format scene pvd --stem first --out "$out"

# The same scene with that motion as its base motion.
sed '0,/{/s//{"base_motion": {"path": "first.pvd"},/' "$out/first.json" > "$out/second.json"
limber open "$out/second.json" --session second
limber add second --node 0 --frame 75 --displacement 0 0.02 0.05 --weight 10
limber wait second
limber export second --format pvd --stem second --out "$out"
limber close flight
limber close second
