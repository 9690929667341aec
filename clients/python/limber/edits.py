"""Edits as values, for session.edit([...]): the common part of all kinds."""

from __future__ import annotations

from typing import Any, Iterable, Mapping, Sequence, Union

from google.protobuf import json_format

from . import checks, json_values
from .errors import invalid
from .messages import common, scene, service

Vector = Sequence[float]
EditLike = Union["service.Edit", "PartialEdit", Mapping[str, Any]]


class PartialEdit:
    """An edit that names some values of a whole; the session that takes it keeps the others."""

    def complete(self, earlier: "Sequence[service.Edit]", known: "scene.Scene", field: str) -> "service.Edit":
        """The whole edit in the wire format. earlier: edits before it in the request; known: the scene as edited before the
        request; field: name in errors."""
        raise NotImplementedError


def vector(values: Vector, field: str) -> "common.Vector3":
    """Three numbers as a message."""
    numbers = list(checks.several(values, field))
    if len(numbers) != 3:
        raise invalid(field, f"{field} takes three numbers, not {values!r}")
    x, y, z = (checks.real(number, f"{field}.{axis}") for number, axis in zip(numbers, "xyz"))
    return common.Vector3(x=x, y=y, z=z)


def undo(anyone: bool = False) -> "service.Edit":
    """Undoes the newest edit of this client's name that was not undone (by a new edit, if others have edited since). With
    `anyone` it undoes the newest edit of any client."""
    return service.Edit(undo=service.Undo(anyone=anyone))


def redo(anyone: bool = False) -> "service.Edit":
    """Redoes the undone edit; anyone: also that of other clients."""
    return service.Edit(redo=service.Redo(anyone=anyone))


def to_messages(edits: Iterable[EditLike], known: "scene.Scene | None" = None) -> "list[service.Edit]":
    """Edits of one request. known: the scene of which partial edits among them keep the rest."""
    messages: "list[service.Edit]" = []
    for i, edit in enumerate(edits):
        if isinstance(edit, PartialEdit):
            edit = edit.complete(messages, known or scene.Scene(), f"edits[{i}]")
        messages.append(to_message(edit, f"edits[{i}]"))
    return messages


def to_message(edit: EditLike, field: str = "edit") -> "service.Edit":
    """An edit as a message; a mapping is the JSON form of limber.v1.Edit."""
    if isinstance(edit, service.Edit):
        return edit
    if isinstance(edit, Mapping):
        try:
            return json_values.parse(edit, service.Edit())
        except (json_format.ParseError, TypeError, AttributeError) as error:
            # Protobuf does not name every field of the path: the message states the known part.
            raise invalid(field, f"no edit: {checks.json_fault(error)[1]}") from error
    raise invalid(field, f"an edit is made by limber.add(), .move(), ... or is a mapping, not {type(edit).__name__}")
