"""Chains of springs, the example of docs/a-kind-of-your-own.md: the module of the Python client.

The messages are generated from tests/server/kinds/springs/springs.proto when limberd_springs is built."""

from __future__ import annotations

import os
import pathlib
import sys
from dataclasses import dataclass
from typing import Any, Iterable, Sequence

import limber
from limber import arrays
from limber.launching import find_binary
from limber.messages import scene as scene_messages
from limber.messages import service

TESTS = pathlib.Path(os.environ.get("LIMBER_SPRINGS", find_binary("limberd").parents[1] / "tests"))
sys.path.insert(0, str(TESTS))
import springs_pb2 as messages  # noqa: E402

Vector = Sequence[float]


def binary() -> pathlib.Path:
    """limberd with this kind."""
    return TESTS / "limberd_springs"


def _vector(at: Vector) -> dict[str, float]:
    return dict(zip("xyz", map(float, at)))


def chain_scene(nodes: "Iterable[Vector]", *, stiffness: float, rest_length: float, pins: "dict[int, Vector]",
                name: str = "") -> "scene_messages.Scene":
    """A scene to open: nodes as drawn [m], equal springs [N/m], [m] between them, and where which nodes are held [m]."""
    chain = messages.Chain(nodes=[_vector(node) for node in nodes])
    for _ in chain.nodes[1:]:
        chain.springs.add(stiffness=stiffness, rest_length=rest_length)
    for node, position in pins.items():
        chain.pins.add(node=node, position=_vector(position))
    scene = scene_messages.Scene(name=name)
    scene.extension.Pack(chain)
    return scene


def _edit(**change: Any) -> "service.Edit":
    edit = service.Edit()
    edit.extension.Pack(messages.ChainEdit(**change))
    return edit


def move_pin(node: int, position: Vector) -> "service.Edit":
    """Holds a node there [m], whether it was pinned before or not."""
    return _edit(move_pin=messages.Pin(node=node, position=_vector(position)))


def set_load(node: int, force: Vector) -> "service.Edit":
    """In place of the node's load [N]; zero: none."""
    return _edit(set_load=messages.Load(node=node, force=_vector(force)))


def release_pin(node: int) -> "service.Edit":
    return _edit(release_pin=messages.ReleasePin(node=node))


@dataclass(frozen=True)
class ChainResult(limber.Result):
    """energy: of the springs [J]."""

    residual: float = 0.0  # largest unbalanced force at a free node [N]; of final results

    @staticmethod
    def from_message(info: "service.ResultInfo") -> "ChainResult":
        report = messages.ChainReport()
        info.extension.Unpack(report)
        return ChainResult(**vars(limber.Result.from_message(info)), residual=report.residual)


class _Coordinates:
    """Coordinates of a chain are its positions."""

    basis_hash = ""

    @staticmethod
    def positions(coordinates):
        return coordinates.reshape(len(coordinates), -1, 3)


class ChainSession(limber.OpenSession):
    """A chain that is kept in equilibrium. Made by Server.open() or Server.session()."""

    FORMATS = {"scene": service.EXPORT_FORMAT_SCENE}
    DEFAULT_FORMATS = ("scene",)

    def result_of(self, info: "service.ResultInfo") -> ChainResult:
        return ChainResult.from_message(info)

    def geometry_for(self, frames: "service.Frames") -> _Coordinates:
        return _Coordinates()

    def chain(self) -> "messages.Chain":
        """As edited by every client."""
        request = service.GetSessionRequest(session=self.reference, with_scene=True)
        chain = messages.Chain()
        self.connection.call("get_session", request).scene.extension.Unpack(chain)
        return chain

    def drawn(self):
        """nodes x 3 [m]"""
        request = service.GetGeometryRequest(session=self.reference)
        return arrays.to_numpy(self.connection.call("get_geometry", request).rest, "rest")


limber.register_kind("springs", ChainSession)
