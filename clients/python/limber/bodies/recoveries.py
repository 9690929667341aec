"""Materials of motions: the recovered material, and how the motion continues with it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import arrays, checks, scenes
from ..messages import scene as scene_messages
from ..messages import service
from . import edits
from .material import Mode

_STARTS = {"principal": service.RECOVERY_START_PRINCIPAL_COMPONENTS, "spectrum": service.RECOVERY_START_SPECTRUM}


@dataclass(frozen=True)
class Recovery:
    """A recovered material and the motion that it continues. Errors are of displacements against those of the base
    motion, relative."""

    positions: np.ndarray      # (frames, nodes, 3), float32, or float64 far from the origin [length unit]: recovered_frames of them, then continued
    modes: tuple[Mode, ...]    # frequencies and damping; of a free body the six rigid motions (zeros) first
    mixing: np.ndarray         # S, candidate modes x modes: column k is the mixture that mode k is
    recovered_frames: int
    converged: bool
    steps: int
    force_energy: float        # E_f, unitless: the part of forces that the material does not explain
    constraint_energy: float   # E_c: half the squared distance from the poses, modal coordinates
    projection_error: float    # the part of the base motion outside the candidate modes: no material avoids it
    recovered_error: float     # of the frames recovered from
    continued_error: float     # of those behind them that the base motion has; 0: none
    final_frame_error: float   # of the last one of these
    frames_per_second: float
    message: str               # notes for the user; empty if none
    warnings: tuple[str, ...]  # of the scene
    job: int


def request(scene: scenes.SceneLike, *, variables: str, modes: "int | None", candidate_modes: "int | None",
            recovered_frames: int, driven_frames: int, total_frames: int, weight: float, column_weight: float,
            start: str) -> "service.RecoverRequest":
    """The scene with these numbers of modes, or its own."""
    made = service.RecoverRequest(
        scene=scenes.to_message(scene), variables=edits.VARIABLES[checks.one_of(variables, edits.VARIABLES, "variables")],
        recovered_frames=checks.whole(recovered_frames, "recovered_frames"),
        driven_frames=checks.whole(driven_frames, "driven_frames"),
        total_frames=checks.whole(total_frames, "total_frames"), weight=checks.real(weight, "weight"),
        column_weight=checks.real(column_weight, "column_weight"),
        start=_STARTS[checks.one_of(start, _STARTS, "start")])
    model: "scene_messages.Model" = made.scene.model
    if modes is not None:
        model.modes = checks.whole(modes, "modes")
    if candidate_modes is not None:
        model.candidate_modes = checks.whole(candidate_modes, "candidate_modes")
    return made


def made_of(job: "service.GetJobResponse", positions: np.ndarray, warnings: tuple[str, ...]) -> Recovery:
    """Recovery of a job that is done, with its frames."""
    report = job.recovery
    return Recovery(positions, tuple(map(Mode.from_message, report.modes)), arrays.to_numpy(report.mixing, "mixing"),
                    report.recovered_frames, report.converged, report.steps, report.force_energy,
                    report.constraint_energy, report.projection_error, report.recovered_error, report.continued_error,
                    report.final_frame_error, report.frames_per_second, report.message, warnings, job.status.job)
