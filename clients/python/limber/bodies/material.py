"""Materials of motions: frequencies, damping and mixtures of modes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import arrays
from ..messages import service
from ..results import Result


@dataclass(frozen=True)
class Mode:
    """How one mode swings when nothing holds it."""

    frequency: float      # of the undamped mode [Hz]; at most half the frames per second
    damping_ratio: float  # of critical; above 1 it creeps back without a swing
    decay: float          # of the amplitude [1/s]
    stiffness: float      # lambda [1/frame^2]
    damping: float        # d [1/frame]

    @staticmethod
    def from_message(mode: "service.ModeDynamics") -> "Mode":
        return Mode(mode.frequency_hz, mode.damping_ratio, mode.decay_per_s, mode.stiffness, mode.damping)


@dataclass(frozen=True)
class Material:
    """Frequencies, damping and modes of a session's motion."""

    modes: tuple[Mode, ...]    # of the newest result; the rigid motions of a free body (six) first
    initial: tuple[Mode, ...]  # values of the scene itself
    mixing: np.ndarray         # candidate modes x modes: column k is the mixture that mode k is
    result: Result             # the one they belong to

    @staticmethod
    def from_message(message: "service.GetMaterialResponse") -> "Material":
        return Material(tuple(map(Mode.from_message, message.modes)), tuple(map(Mode.from_message, message.initial)),
                        arrays.to_numpy(message.mixing, "mixing"), Result.from_message(message.result))
