"""Motions of the body without reduction: actions on it, and results."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Callable, Iterable, Sequence

import numpy as np

from .. import arrays, checks, scenes
from ..errors import invalid
from ..messages import common
from ..messages import scene as messages
from ..messages import service

_PROFILES = {"constant": messages.FORCE_PROFILE_CONSTANT, "ramp": messages.FORCE_PROFILE_RAMP,
             "sine": messages.FORCE_PROFILE_SINE}
_SCHEMES = {"midpoint": messages.TIME_STEPPING_IMPLICIT_MIDPOINT, "euler": messages.TIME_STEPPING_IMPLICIT_EULER}
PART_BYTES = 2 << 20  # of one answer: frames of a large motion are fetched in several


@dataclass(frozen=True)
class Simulation:
    """A simulated motion and how it went."""

    positions: np.ndarray  # (frames, nodes, 3), float32, or float64 far from the origin [length unit]
    kinetic: np.ndarray  # energy in every frame [J]
    elastic: np.ndarray  # [J]
    work: np.ndarray  # done by the loads from frame 0 on [J]
    energy_drift: float  # loss by damping, else the error of the scheme; relative to the largest energy
    steps: int
    shortened_steps: int  # of them: taken in parts, since Newton's method failed
    smallest_volume_ratio: float  # of a tet to that at rest, over all frames; below 0: turned inside out
    frames_per_second: float
    message: str  # notes for the user; empty if none
    warnings: tuple[str, ...]  # of the scene
    job: int


def force(nodes: "int | Iterable[int]", newtons: Sequence[float], *, from_frame: float = 0,
          until_frame: float | None = None, profile: str = "constant",
          period_frames: float | None = None) -> "messages.NodalForce":
    """A force [N, x y z] that these nodes share equally, between two frames (default: to the last).

    profile: "constant"; "ramp", from nothing to all of it; "sine" of a period [frames]: twice the interval is one push
    that swells and fades.
    """
    named = [nodes] if np.ndim(nodes) == 0 else nodes
    made = messages.NodalForce(nodes=checks.wholes(named, "nodes"), force=_vector(newtons, "newtons"),
                               from_frame=checks.real(from_frame, "from_frame"),
                               profile=_PROFILES[checks.one_of(profile, _PROFILES, "profile")])
    if until_frame is not None:
        made.until_frame = checks.real(until_frame, "until_frame")
    if period_frames is not None:
        made.period_frames = checks.real(period_frames, "period_frames")
    return made


def simulation(*, gravity: Sequence[float] = (0, 0, 0), forces: "Iterable[messages.NodalForce]" = (),
               displacements: Any = None, modes: Iterable[float] = (), velocities: Any = None,
               velocity: Sequence[float] = (0, 0, 0), frames_per_second: float | None = None, steps_per_frame: int = 8,
               mass_damping: float = 0, relaxation_time: float = 0, scheme: str = "midpoint") -> "messages.Simulation":
    """A simulation for `server.simulate` or as the `simulation` of a scene.

    gravity [m/s^2]; forces: of force(). The state in frame 0 is the sum of displacements (nodes x 3, length unit) and amplitudes
    of the lowest vibration modes (length unit, of the node that moves most). Velocities are added in the same way: nodes x 3
    (length unit / s) and one of all nodes that are not fixed. `frames_per_second`: default those of the scene; mass_damping [1/s]
    slows every motion, relaxation_time [s] only deformation; scheme: "midpoint" keeps energy, "euler" loses it.
    """
    made = messages.Simulation(gravity=_vector(gravity, "gravity"), forces=list(checks.several(forces, "forces")),
                               steps_per_frame=checks.whole(steps_per_frame, "steps_per_frame"),
                               mass_damping=checks.real(mass_damping, "mass_damping"),
                               relaxation_time=checks.real(relaxation_time, "relaxation_time"),
                               scheme=_SCHEMES[checks.one_of(scheme, _SCHEMES, "scheme")])
    if frames_per_second is not None:
        made.frames_per_second = checks.real(frames_per_second, "frames_per_second")
    initial = made.initial
    initial.modes.extend(checks.real(mode, f"modes[{k}]") for k, mode in enumerate(checks.several(modes, "modes")))
    initial.velocity.CopyFrom(_vector(velocity, "velocity"))
    for name, field in (("displacements", displacements), ("velocities", velocities)):
        if field is not None:
            getattr(initial, name).CopyFrom(arrays.to_message(checks.numeric(field, name), np.float64))
    return made


def request(scene: scenes.SceneLike, of: "messages.Simulation | None") -> "service.SimulateRequest":
    """The scene with this simulation, or its own; without its base motion, which may be the file that is to be made."""
    made = service.SimulateRequest(scene=scenes.to_message(scene, base_motion=False))
    if of is not None:
        if not isinstance(of, messages.Simulation):
            raise invalid("simulation", f"simulation is what limber.simulation() makes, not {type(of).__name__}")
        made.scene.simulation.CopyFrom(of)
    return made


def fetch_positions(job: int, frames: int, part_bytes: int,
                    call: Callable[["service.GetFramesRequest"], "service.GetFramesResponse"],
                    nodes: int | None = None) -> np.ndarray:
    """All frames of a job's motion, in answers of at most so many bytes (but of a frame at least)."""
    def part(first: int, count: int) -> np.ndarray:
        asked = service.GetFramesRequest(job=job, first_frame=first, frame_count=count)
        return arrays.to_numpy(call(asked).frames.data, "positions")

    step = 1 if nodes is None else max(1, part_bytes // max(1, 12 * nodes))
    begin = part(0, min(step, frames))
    if nodes is None:
        step = max(1, part_bytes // max(1, 12 * begin.shape[1]))
    positions = np.empty((frames, *begin.shape[1:]), begin.dtype)
    positions[:len(begin)] = begin
    for first in range(len(begin), frames, step):
        count = min(step, frames - first)
        positions[first:first + count] = part(first, count)
    return positions


def fetch(job: "service.GetJobResponse", warnings: tuple[str, ...], part_bytes: int,
          call: Callable[["service.GetFramesRequest"], "service.GetFramesResponse"]) -> Simulation:
    """The motion of a job that is done."""
    report, number = job.simulation, job.status.job
    positions = fetch_positions(number, report.frames, part_bytes, call, report.nodes)
    return Simulation(positions, np.array(report.kinetic_energy), np.array(report.elastic_energy),
                      np.array(report.work), report.energy_drift, report.steps, report.shortened_steps,
                      report.smallest_volume_ratio, report.frames_per_second, report.message, warnings, number)


def _vector(value: Any, field: str) -> "common.Vector3":
    numbers = [checks.real(number, f"{field}[{axis}]") for axis, number in enumerate(checks.several(value, field))]
    if len(numbers) != 3:
        raise invalid(field, f"{field} takes x, y and z, not {len(numbers)} numbers")
    return common.Vector3(x=numbers[0], y=numbers[1], z=numbers[2])
