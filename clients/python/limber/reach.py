"""How far a connection gets if no answer came: advice for the user."""

from __future__ import annotations

import socket
import time

import zmq
import zmq.utils.monitor

from .connection import Connection, configure

# A refused client is disconnected without a message at every attempt: it sees a connection without a handshake.
# HANDSHAKE_FAILED_... is reported for some of the reasons only.
_EVENTS = (zmq.EVENT_CONNECTED | zmq.EVENT_CONNECT_RETRIED | zmq.EVENT_HANDSHAKE_SUCCEEDED
           | zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL | zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL
           | zmq.EVENT_HANDSHAKE_FAILED_AUTH | zmq.EVENT_DISCONNECTED)


def advice(connection: Connection, patience: float = 0.5) -> str:
    """Tries a connection of its own, for at most `patience` seconds."""
    if not _is_place(connection.endpoint):
        return "the name of its host is not known, or its port is not within 1 to 65535"
    event = _last_event(connection, patience)
    if event in (None, zmq.EVENT_CONNECT_RETRIED):
        return "nothing listens there; `limber start` or limber.launch() starts one"
    if event == zmq.EVENT_HANDSHAKE_SUCCEEDED:
        return "something lets this client in, but is busy or hangs"
    if connection.keys is None:
        return ("something listens there, but does not let in a client without keys: a limberd with CURVE keys looks "
                "like this, and so does what is no limberd")
    return ("something listens there, but does not take these keys: a wrong server_key, a client's key that is not in "
            "its --curve-allow file, or a limberd without keys look like this")


def _is_place(endpoint: str) -> bool:
    """libzmq tries for ever to reach a host that has no address and a port beyond 65535."""
    host, _, port = endpoint.removeprefix("tcp://").rpartition(":")
    if not endpoint.startswith("tcp://") or not host:
        return True
    if not (port.isascii() and port.isdigit() and 1 <= int(port) <= 65535):
        return False
    try:
        return bool(socket.getaddrinfo(host.rpartition(";")[2].strip("[]"), None))
    except (OSError, UnicodeError):
        return False


def _last_event(connection: Connection, patience: float) -> int | None:
    """Event of a new connection: the first that says more than that something listens, else that, else none."""
    deadline = time.monotonic() + patience
    seen = None
    with connection.context.socket(zmq.DEALER) as probe:
        configure(probe, connection.keys)
        monitor = probe.get_monitor_socket(_EVENTS)
        try:
            probe.connect(connection.endpoint)
            while monitor.poll(max(0, int(1000 * (deadline - time.monotonic())))):
                seen = zmq.utils.monitor.recv_monitor_message(monitor)["event"]
                if seen != zmq.EVENT_CONNECTED:
                    break
        finally:
            probe.disable_monitor()
            monitor.close()
    return seen
