"""Edits as values: what session.edit([...]) takes."""

from __future__ import annotations

from typing import Any, Iterable, Mapping, Sequence, Union

from google.protobuf import json_format

from .errors import invalid
from .messages import common, scene, service

Axes = Union[str, None]  # "x", "yz", ...; None: all three
Vector = Sequence[float]
EditLike = Union["service.Edit", Mapping[str, Any]]

_AXES = {"x": scene.AXIS_X, "y": scene.AXIS_Y, "z": scene.AXIS_Z}
ENDS = {
    "free": scene.END_CONDITION_FREE,
    "position": scene.END_CONDITION_PINNED_POSITION,
    "position_velocity": scene.END_CONDITION_PINNED_POSITION_VELOCITY,
}


def vector(values: Vector, field: str) -> "common.Vector3":
    """Three numbers as a message."""
    try:
        x, y, z = (float(value) for value in values)
    except (TypeError, ValueError) as error:
        raise invalid(field, f"{field} takes three numbers, not {values!r}") from error
    return common.Vector3(x=x, y=y, z=z)


def constraint(*, frame: int, node: int | None = None, nodes: Iterable[int] | None = None,
               position: Vector | None = None, displacement: Vector | None = None, axes: Axes = None,
               weight: float | None = None, exact: bool = False, id: int = 0) -> "scene.Constraint":
    """"In this frame, the mean position of these nodes is there."

    position: a point of the mesh's space; displacement: from the rest position (exactly one of them, length unit);
    weight: gamma > 0 of a soft constraint (default 100); exact: hold exactly instead.
    """
    if (node is None) == (nodes is None):
        raise invalid("nodes", "give either node or nodes")
    if (position is None) == (displacement is None):
        raise invalid("target", "give either position or displacement")
    if exact and weight is not None:
        raise invalid("weight", "an exact constraint has no weight")
    message = scene.Constraint(id=id)
    try:
        message.frame = frame
    except (TypeError, ValueError) as error:
        raise invalid("frame", f"frame must be a whole number >= 0, is {frame!r}") from error
    try:
        message.nodes.extend([int(node)] if nodes is None else [int(value) for value in nodes])
    except (TypeError, ValueError) as error:
        raise invalid("nodes", f"node ids are whole numbers >= 0: {error}") from error
    if axes is not None:
        message.axes.extend(_axes(axes))
    if position is not None:
        message.position.CopyFrom(vector(position, "position"))
    else:
        message.displacement.CopyFrom(vector(displacement, "displacement"))
    if exact:
        message.exact = True
    elif weight is not None:
        message.weight = weight
    return message


def _axes(axes: str) -> list[int]:
    if not axes or len(set(axes)) != len(axes) or any(axis not in _AXES for axis in axes):
        raise invalid("axes", f'axes are one to three of "xyz", e.g. "xz", not {axes!r}')
    return [_AXES[axis] for axis in axes]


def add(**what: Any) -> "service.Edit":
    """Adds a constraint; see limber.edits.constraint for the arguments."""
    return service.Edit(add=service.AddConstraint(constraint=constraint(**what)))


def move(constraint: Any, target: Vector) -> "service.Edit":
    """Gives a constraint (a Constraint or its id) another target, of the kind it has."""
    return service.Edit(move=service.MoveConstraint(id=_id(constraint), target=vector(target, "target")))


def replace(constraint_id: Any, **what: Any) -> "service.Edit":
    """Puts another constraint in the place of one, under the same id."""
    return service.Edit(replace=service.ReplaceConstraint(constraint=constraint(id=_id(constraint_id), **what)))


def remove(constraint: Any) -> "service.Edit":
    """Removes a constraint (a Constraint or its id)."""
    return service.Edit(remove=service.RemoveConstraint(id=_id(constraint)))


def ends(first: str, last: str) -> "service.Edit":
    """What holds the motion at its ends: "free", "position" or "position_velocity"."""
    for name, value in (("first", first), ("last", last)):
        if value not in ENDS:
            raise invalid(name, f"an end is one of {', '.join(ENDS)}, not {value!r}")
    return service.Edit(set_ends=service.SetEnds(first_end=ENDS[first], last_end=ENDS[last]))


def dynamics(*, frames_per_second: float | None = None, period_frames: float | None = None,
             damping_ratio: float | None = None) -> "service.Edit":
    """How fast the body moves; what is not given gets the default of limber.v1.Dynamics."""
    values = {"frames_per_second": frames_per_second, "period_frames": period_frames, "damping_ratio": damping_ratio}
    return service.Edit(set_dynamics=scene.Dynamics(**{k: v for k, v in values.items() if v is not None}))


def undo() -> "service.Edit":
    """Takes the newest revision back that has not been taken back."""
    return service.Edit(undo=service.Undo())


def redo() -> "service.Edit":
    """Brings back what undo took."""
    return service.Edit(redo=service.Redo())


def to_message(edit: EditLike, field: str = "edit") -> "service.Edit":
    """An edit as a message; a mapping is the JSON form of limber.v1.Edit."""
    if isinstance(edit, service.Edit):
        return edit
    if isinstance(edit, Mapping):
        try:
            return json_format.ParseDict(edit, service.Edit())
        except json_format.ParseError as error:
            raise invalid(field, f"no edit: {error}") from error
    raise invalid(field, f"an edit is made by limber.add(), .move(), ... or is a mapping, not {type(edit).__name__}")


def _id(constraint: Any) -> int:
    return int(getattr(constraint, "id", constraint))
