"""Edits of structures of beams as values, for BeamSession.edit([...]). Nodes and elements count from 0."""

from __future__ import annotations

from typing import Sequence

from .. import checks
from ..edits import Vector, vector
from ..errors import invalid
from ..messages import beam_structure as messages
from ..messages import service

_AXES = ("x", "y", "z")


def _letters(axes: str | None, field: str) -> str:
    if axes is None:
        return ""
    if not isinstance(axes, str) or len(set(axes)) != len(axes) or any(axis not in _AXES for axis in axes):
        raise invalid(field, f'{field} are some of "xyz", e.g. "xz", not {axes!r}')
    return axes


def _set_axes(made: "messages.BeamSupport | messages.BeamMotion", axes: "Sequence[Vector] | None") -> None:
    if axes is None:
        return
    given = list(checks.several(axes, "axes"))
    if len(given) != 2:
        raise invalid("axes", f"axes takes two directions, not {axes!r}")
    made.x_axis.CopyFrom(vector(given[0], "axes[0]"))
    made.y_axis.CopyFrom(vector(given[1], "axes[1]"))


def support(node: int, translations: str = "xyz", rotations: str = "xyz",
            axes: "Sequence[Vector] | None" = None) -> "service.Edit":
    """Fixes directions of a node at their drawn positions: translations along and rotations about these axes; none of both
    removes the support. `axes`: two directions in place of x and y (the third is perpendicular to both)."""
    made = messages.BeamSupport(node=checks.whole(node, "node"))
    for axis in _letters(translations, "translations"):
        setattr(made, f"fix_{axis}", True)
    for axis in _letters(rotations, "rotations"):
        setattr(made, f"fix_rotation_{axis}", True)
    _set_axes(made, axes)
    return service.Edit(set_beam_support=service.SetBeamSupport(support=made))


def move(node: int, *, x: float | None = None, y: float | None = None, z: float | None = None,
         position: "Vector | None" = None, rotation: "Vector | None" = None, rotation_x: float | None = None,
         rotation_y: float | None = None, rotation_z: float | None = None,
         axes: "Sequence[Vector] | None" = None) -> "service.Edit":
    """Moves a node and holds it there. `x`, `y`, `z`: displacement from the drawn position, or `position`: a position [m].
    `rotation`: a rotation vector from rest [radian], of any length, or rotation_x, _y, _z about single axes. Directions that are
    not given stay unchanged. `axes`: two directions in place of x and y (the third is perpendicular to both), as the node's
    support has."""
    motion = messages.BeamMotion(node=checks.whole(node, "node"))
    for axis, value in zip(_AXES, (x, y, z)):
        if value is not None:
            setattr(motion, axis, checks.real(value, axis))
    for axis, value in zip(_AXES, (rotation_x, rotation_y, rotation_z)):
        if value is not None:
            setattr(motion, f"rotation_{axis}", checks.real(value, f"rotation_{axis}"))
    _set_axes(motion, axes)
    if rotation is not None:
        motion.rotation.CopyFrom(vector(rotation, "rotation"))
    change = service.MoveBeamNode(motion=motion)
    if position is not None:
        change.position.CopyFrom(vector(position, "position"))
    return service.Edit(move_beam_node=change)


def release(node: int) -> "service.Edit":
    """Takes the node's support and motion away."""
    return service.Edit(release_beam_node=service.ReleaseBeamNode(node=checks.whole(node, "node")))


def hold(node: int, translations: str = "xyz", rotations: bool = True) -> "service.Edit":
    """Holds a node where it is, once it is at rest."""
    change = service.HoldBeamNode(node=checks.whole(node, "node"), rotations=checks.flag(rotations, "rotations"))
    letters = _letters(translations, "translations")
    if not letters and not rotations:
        raise invalid("translations", "there is nothing to hold")
    for axis in letters:
        setattr(change, axis, True)
    return service.Edit(hold_beam_node=change)


def _load(node: int, force: Vector, moment: Vector, follows: bool) -> "messages.BeamLoad":
    return messages.BeamLoad(node=checks.whole(node, "node"), force=vector(force, "force"),
                             moment=vector(moment, "moment"), follows=checks.flag(follows, "follows"))


def load(node: int, force: Vector = (0, 0, 0), moment: Vector = (0, 0, 0), follows: bool = False) -> "service.Edit":
    """Replaces the loads of a node: force [N], moment [N m]; follows: they turn with it. Nothing: no load."""
    return service.Edit(set_beam_load=service.SetBeamLoad(load=_load(node, force, moment, follows)))


def element_load(element: int, force: Vector = (0, 0, 0), follows: bool = False) -> "service.Edit":
    """Replaces the distributed load of an element [N/m]."""
    made = messages.BeamDistributedLoad(element=checks.whole(element, "element"), force=vector(force, "force"),
                                        follows=checks.flag(follows, "follows"))
    return service.Edit(set_beam_element_load=service.SetBeamElementLoad(load=made))


def push(node: int, force: Vector = (0, 0, 0), moment: Vector = (0, 0, 0)) -> "service.Edit":
    """A load that acts during the other edits of the request, and is removed in the end."""
    return service.Edit(push_beam_node=service.PushBeamNode(load=_load(node, force, moment, False)))


def gravity(gravity: Vector) -> "service.Edit":
    """[m/s^2]"""
    return service.Edit(set_gravity=service.SetGravity(gravity=vector(gravity, "gravity")))
