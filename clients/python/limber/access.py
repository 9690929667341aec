"""Permissions on a server with CURVE keys: its list of clients' keys."""

from __future__ import annotations

import os
from dataclasses import dataclass

from . import checks
from .connection import Connection, public_key
from .errors import invalid
from .messages import access

ROLES = {"view": access.ROLE_VIEW, "edit": access.ROLE_EDIT, "administer": access.ROLE_ADMINISTER}


def role_name(role: int) -> str:
    """"view", "edit" or "administer"; the number of a role that this client does not know."""
    return next((name for name, number in ROLES.items() if number == role), str(role))


@dataclass(frozen=True)
class AllowedKey:
    """A key that may connect: the role of its client ("view", "edit" or "administer"), and its owner (may be empty)."""

    key: str
    role: str
    name: str

    @staticmethod
    def from_message(message: "access.AllowedKey") -> "AllowedKey":
        return AllowedKey(message.key, role_name(message.role), message.name)


class AccessRequests:
    """The part of Server that needs the role "administer"; others get PERMISSION_DENIED. FAILED_PRECONDITION where the
    server has no list of keys: without CURVE everybody administers."""

    connection: Connection

    def allowed(self) -> list[AllowedKey]:
        """The keys that may connect."""
        response = self.connection.call("list_allowed", access.ListAllowedRequest())
        return [AllowedKey.from_message(key) for key in response.keys]

    def allow(self, key: "str | os.PathLike[str]", role: str, name: str = "") -> AllowedKey:
        """Lets a client in, or gives it another role, from now on. key: its public key, or the file that holds it."""
        if role not in ROLES:
            raise invalid("role", f'role is "view", "edit" or "administer", not {role!r}')
        entry = access.AllowedKey(key=public_key(key, "key"), role=ROLES[role], name=checks.text(name, "name"))
        return AllowedKey.from_message(self.connection.call("allow", access.AllowRequest(key=entry)).key)

    def revoke(self, key: str) -> AllowedKey:
        """Takes a key, given as it is or by its name, off the list: its clients are disconnected when this returns."""
        response = self.connection.call("revoke", access.RevokeRequest(key=checks.text(key, "key")))
        return AllowedKey.from_message(response.key)
