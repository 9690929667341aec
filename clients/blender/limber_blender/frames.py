"""Frames of Blender's timeline and of a motion."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Clock:
    """Blender's frames count from scene.frame_start (1 in new files), those of a motion from 0. Each has its own rate."""

    start: int        # the frame of Blender's timeline that shows the motion's first
    scene_rate: float  # frames a second of Blender's scene now
    rate: float       # of the motion
    frames: int       # of the motion

    def motion_frame(self, frame: float) -> float:
        """Which of the motion is shown, in fractions where rates differ: before it the first, after it the last."""
        return min(max(self._unbounded(frame), 0.0), self.frames - 1.0)

    def edited_frame(self, frame: float) -> "int | None":
        """The nearest of the motion; None: it lies before or after the motion."""
        nearest = int(round(self._unbounded(frame)))
        return nearest if 0 <= nearest < self.frames else None

    def _unbounded(self, frame: float) -> float:
        return (frame - self.start) * self.rate / self.scene_rate

    def timeline_frame(self, frame: float) -> float:
        """A frame of Blender's timeline."""
        return self.start + frame * self.scene_rate / self.rate
