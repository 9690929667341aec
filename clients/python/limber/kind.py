"""Interface of a kind of scenes and its sessions to the modules that all kinds share. The kinds themselves are rows of kinds.py;
everything else of a kind is in its own folder."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Iterator, Mapping

from . import checks
from .errors import invalid
from .messages import scene as messages
from .open_session import OpenSession
from .progress import ProgressOption

if TYPE_CHECKING:
    from .server import Server

DEFAULT = "bodies"  # of scenes that no other kind accepts, and of sessions of which the server says no kind


class Kind:
    """Elastic bodies, rod linkages, structures of beams. The defaults are those of a kind that has sessions and no files of its
    own."""

    session_class: "type[OpenSession]" = OpenSession

    # ---- scenes ----

    def accepts(self, scene: "messages.Scene") -> bool:
        """Whether the scene is of this kind, sound or not."""
        return False

    def read_job(self, path: Path) -> "messages.Scene | None":
        """The scene of a file or folder that is read in place of a scene file; None: this is no such file."""
        return None

    def as_scene(self, value: "Mapping[str, Any]") -> "Mapping[str, Any]":
        """The JSON form of a scene of a value that is only its part of this kind; other values as they are."""
        return value

    def upload_files(self, scene: "messages.Scene", folder: Path) -> None:
        """Puts the bytes of the files that the scene names, relative to the folder, in place of their paths."""

    def set_variables(self, scene: "messages.Scene", variables: str) -> None:
        """Optimises these in place of the scene's variables; see Server.open(optimise=)."""
        raise invalid("optimise", "linkages and beams have no material to optimise")

    def paint(self, scene: "messages.Scene", stiffness: Any) -> None:
        """Paints the body of a scene; see Server.open(stiffness=)."""
        raise invalid("stiffness", "linkages and beams have no tets to paint")

    # ---- files that are opened without a scene ----

    def opens(self, path: Path) -> bool:
        """Whether this file is opened with defaults, as a scene of this kind."""
        return False

    def fills(self, path: Path) -> bool:
        """Whether such a file is a surface that is filled first."""
        return False

    def scene_of_file(self, server: "Server", path: Path, progress: ProgressOption, timeout: float,
                      **filling: Any) -> "messages.Scene":
        """The scene of a file that this kind opens. filling: options of Server.tetrahedralize()."""
        raise NotImplementedError

    def describe_defaults(self, scene: "messages.Scene") -> str:
        """Properties of the scene of such a file, as the server has it, that the file does not define."""
        raise NotImplementedError

    def advice(self, path: Path) -> str:
        """How a file that could not be opened as one of another kind is opened as one of this kind; empty: it is not."""
        return ""


_KINDS: "dict[str, Kind]" = {}  # by the name that the server has for them


def add(name: str, kind: Kind) -> None:
    """A row of the registry."""
    _KINDS[name] = kind


def every() -> "Iterator[Kind]":
    """In the order of the registry."""
    return iter(tuple(_KINDS.values()))


def of(scene: "messages.Scene") -> Kind:
    """The kind of a scene."""
    return next((kind for kind in every() if kind.accepts(scene)), _KINDS[DEFAULT])


def opener_of(path: Path) -> "Kind | None":
    """The kind that opens a file without a scene."""
    return next((kind for kind in every() if kind.opens(path)), None) if path.is_file() else None


def advice(path: Path) -> str:
    """Advice of all kinds; empty: there is none."""
    return next((text for text in (kind.advice(path) for kind in every()) if text), "")


def register_kind(kind: str, session_class: "type[OpenSession]") -> None:
    """From now on Server.open() and Server.session() return objects of this class for sessions of this kind: for kinds
    that limber.v1 does not know (see docs/a-kind-of-your-own.md)."""
    if not checks.text(kind, "kind"):
        raise invalid("kind", "a kind has a name")
    if not isinstance(session_class, type) or not issubclass(session_class, OpenSession):
        raise invalid("session_class", f"a subclass of limber.OpenSession is expected, not {session_class!r}")
    _KINDS.setdefault(kind, Kind()).session_class = session_class


def session_class(kind: str) -> "type[OpenSession]":
    """The class of its sessions; for an unregistered kind OpenSession, which has the members of sessions of every kind."""
    known = _KINDS.get(kind or DEFAULT)
    return known.session_class if known else OpenSession
