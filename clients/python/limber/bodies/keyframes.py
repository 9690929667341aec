"""Keyframes: whole poses that the motion goes through."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import arrays, checks
from ..errors import invalid
from ..files import mesh_file
from ..messages import scene as scenes, service

if TYPE_CHECKING:
    from ..open_session import Receipt
    from .session import Session


def keyframe(*, frame: int, positions: Any, weight: float | None = None, exact: bool = False,
             id: int = 0) -> "scenes.Keyframe":
    """"In this frame, the body has this pose", as far as its modes can.

    positions: of all nodes, n x 3 [length unit], or the path of a mesh file whose nodes are the scene's, moved. `weight`: gamma >
    0 of the distance in modal coordinates (default 100); exact: hold exactly instead.
    """
    message = scenes.Keyframe(id=_id(id), frame=checks.whole(frame, "frame"))
    if isinstance(positions, (str, os.PathLike)):
        message.file.CopyFrom(mesh_file(positions, field="positions"))
    else:
        pose = checks.numeric(positions, "positions")
        if pose.ndim != 2 or pose.shape[1] != 3:
            raise invalid("positions", f"positions have the shape {pose.shape}, not (n, 3)")
        message.positions.CopyFrom(arrays.to_message(pose, np.float64))
    _enforce(message, weight, exact)
    return message


def add_keyframe(**what: Any) -> "service.Edit":
    """Adds a keyframe; see limber.keyframe for the arguments."""
    return service.Edit(add_keyframe=service.AddKeyframe(keyframe=keyframe(**what)))


def move_keyframe(keyframe: Any, frame: int | None = None, *, weight: float | None = None,
                  exact: bool = False) -> "service.Edit":
    """Gives a keyframe (a Keyframe or its id) another frame or weight; the pose stays."""
    move = service.MoveKeyframe(id=_id(keyframe))
    if frame is not None:
        move.frame = checks.whole(frame, "frame")
    _enforce(move, weight, exact)
    return service.Edit(move_keyframe=move)


def remove_keyframe(keyframe: Any) -> "service.Edit":
    """Removes a keyframe (a Keyframe or its id)."""
    return service.Edit(remove_keyframe=service.RemoveKeyframe(id=_id(keyframe)))


class Keyframe:
    """A keyframe of a session, as this client last knew it; the pose is the server's."""

    def __init__(self, session: "Session", message: "scenes.Keyframe", issues: tuple[str, ...] = ()):
        self.session = session
        self.message = message
        self.issues = issues  # warnings of the edit that added it, e.g. that an end holds its frame

    @property
    def id(self) -> int:
        return self.message.id

    @property
    def frame(self) -> int:
        return self.message.frame

    @property
    def weight(self) -> float:
        """gamma; inf where it is held exactly."""
        return float("inf") if self.message.exact else self.message.weight or 100.0

    def move(self, frame: int | None = None, *, weight: float | None = None, exact: bool = False) -> "Receipt":
        """Another frame or weight; options that are not given stay, and so does the pose."""
        edit = move_keyframe(self, frame, weight=weight, exact=exact)
        receipt = self.session.edit([edit])
        if frame is not None:
            self.message.frame = frame
        _enforce(self.message, weight, exact)
        return receipt

    def remove(self) -> "Receipt":
        return self.session.edit([remove_keyframe(self)])

    def __repr__(self) -> str:
        return f"Keyframe(id={self.id}, frame={self.frame}, weight={self.weight:g})"


def _enforce(message: Any, weight: float | None, exact: bool) -> None:
    if checks.flag(exact, "exact") and weight is not None:
        raise invalid("weight", "what is held exactly has no weight")
    if exact:
        message.exact = True
    elif weight is not None:
        message.weight = checks.real(weight, "weight")


def _id(value: Any) -> int:
    return checks.whole(getattr(value, "id", value), "id", most=2 ** 64 - 1)
