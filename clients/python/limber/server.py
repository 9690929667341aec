"""A limberd somewhere."""

from __future__ import annotations

import os

from . import checks
from .access import AccessRequests
from .connection import Connection, CurveKeys
from .errors import ServerStopped, ServerUnreachable, invalid
from .kinds import KindRequests
from .reach import advice

DEFAULT_ENDPOINT = "tcp://127.0.0.1:7801"


class Server(KindRequests, AccessRequests):
    """A connection to a limberd. A context manager; leaving it keeps the sessions alive. Thread-safe."""


def connect(endpoint: str | None = None, *, timeout: float = 10.0, connect_timeout: float = 2.0,
            server_key: "str | os.PathLike[str] | None" = None, key: "str | os.PathLike[str] | None" = None,
            name: str | None = None) -> Server:
    """Connects to a running limberd: endpoint, else $LIMBER_ENDPOINT, else tcp://127.0.0.1:7801.

    timeout [s] for answers, connect_timeout [s] to find out whether a server is there. Beyond loopback, CURVE keys as `limberd
    keygen` writes them. `server_key`: the server's public key or its file. `key`: the file of this client's secret key, with its
    .pub in the same folder. Raises ServerUnreachable if nothing answers (or the keys are not accepted), LimberError UNSUPPORTED
    if the server speaks another protocol. `name`: displayed to others in a session, at most 64 bytes; else $LIMBER_NAME, else
    python-USER@HOST.
    """
    if (server_key is None) != (key is None):
        raise invalid("key", "server_key and key go together")
    for field, value in (("server_key", server_key), ("key", key)):
        if value is not None:
            checks.path(value, field)
    keys = CurveKeys.read(server_key, key) if server_key is not None and key is not None else None
    checks.duration(connect_timeout, "connect_timeout")
    connection = Connection(endpoint or os.environ.get("LIMBER_ENDPOINT") or DEFAULT_ENDPOINT, keys, timeout, name)
    try:
        return Server(connection, min(timeout, connect_timeout))
    except ServerStopped:
        connection.close()
        raise
    except ServerUnreachable:
        why = advice(connection)
        connection.close()
        raise ServerUnreachable(f"no limberd answers at {connection.endpoint}: {why}") from None
    except BaseException:
        connection.close()
        raise
