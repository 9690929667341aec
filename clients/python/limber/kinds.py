"""Which class of sessions stands for which kind of scene, by the name that the server has for the kind."""

from __future__ import annotations

from . import checks
from .beam_sessions import BeamSession
from .errors import invalid
from .linkages import LinkageSession
from .open_session import OpenSession
from .session import Session

_CLASSES: "dict[str, type[OpenSession]]" = {"bodies": Session, "linkages": LinkageSession, "beams": BeamSession}


def register_kind(kind: str, session_class: "type[OpenSession]") -> None:
    """From now on Server.open() and Server.session() return objects of this class for sessions of this kind: for kinds
    that limber.v1 does not know (see docs/a-kind-of-your-own.md)."""
    if not checks.text(kind, "kind"):
        raise invalid("kind", "a kind has a name")
    if not isinstance(session_class, type) or not issubclass(session_class, OpenSession):
        raise invalid("session_class", f"a subclass of limber.OpenSession is expected, not {session_class!r}")
    _CLASSES[kind] = session_class


def session_class(kind: str) -> "type[OpenSession]":
    """Of a kind that nobody registered OpenSession, which has what sessions of every kind have."""
    return _CLASSES.get(kind or "bodies", OpenSession)
