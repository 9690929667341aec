#!/usr/bin/env bash
# Poses of one motion, met by another: interpolate_poses.sh [FOLDER]. Needs limber on PATH and a limberd.
set -euo pipefail
out=${1:-out/interpolate_poses}
mkdir -p "$out"
limber open --sample bird --session flight          # a flight to take poses from
limber wait flight
limber export flight --format pvd --stem flight --out "$out"

limber remove flight 1 2 3 4 5 6                    # its position constraints give way to poses
limber keyframe flight --frame 20 --pose "$out/flight_00030.vtu"
limber keyframe flight --frame 45 --pose "$out/flight_00060.vtu" --weight 300
limber keyframe flight --frame 80 --pose "$out/flight_00030.vtu"
limber material flight --optimise dynamics          # so that the way between them needs less force
limber wait flight
limber keyframes flight
limber export flight --format pvd --stem poses --out "$out"
limber close flight
