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
        """Of the motion, between 0 and its last one, in fractions where rates differ."""
        return min(max((frame - self.start) * self.rate / self.scene_rate, 0.0), self.frames - 1.0)

    def timeline_frame(self, frame: float) -> float:
        """Of Blender's timeline."""
        return self.start + frame * self.scene_rate / self.rate
