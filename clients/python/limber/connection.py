"""One DEALER socket, owned by one thread; requests of any thread, many in flight.

Lazy Pirate (zguide, chapter 4): a request has a deadline; one that passes it is abandoned. If the server was silent meanwhile,
the socket is closed and opened again, so that nothing queued for a dead server is delivered to the next one. A request is sent
once more, under the same id, if the connection broke and is there again, and after half of its time. The server applies changes
once and answers again, and the first answer counts. A limberd with a store that ends for another run to take its place refuses
requests; these are sent to the new run. Requests about jobs are not, since a job ends with its run.
"""

from __future__ import annotations

import itertools
import os
import secrets
import stat
import threading
import time
import weakref
from concurrent import futures
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import urlsplit

import zmq
import zmq.utils.monitor
from google.protobuf.message import DecodeError

from . import checks, reply_parts
from .errors import LimberError, ServerRestarted, ServerUnreachable, from_message, of_file
from .messages import common, service
from .presence import client_name
from .version import PACKAGE, PROTOCOL

_SEND, _REOPEN, _STOP = b"s", b"r", b"x"

# A stream (which gets the status every two seconds) and a request that waits on the server check after this long a silence
# whether limberd is there, and wait this long for the answer [s]. A busy limberd answers that at once, too.
SILENCE = 5.0
PATIENCE = 3.0

# How long another run is awaited that is to follow one that ended in order [s].
NEXT_RUN = 60.0

# Not sent again: a limberd that was started meanwhile is not meant.
SENT_ONCE = frozenset({"shutdown"})

# Number of requests for a long answer whose parts were lost with a connection.
_TRIES = 3


@dataclass
class _Asked:
    """A request that waits for an answer."""

    future: futures.Future
    again: "bytes | None"   # message sent once more for it
    is_for_next: bool       # another run of limberd that has its sessions answers it as well
    refusal: "service.Reply | None" = None  # of a run that has ended
    refused: float = 0.0    # time.monotonic() of that [s]


@dataclass(frozen=True)
class CurveKeys:
    """CURVE keys, Z85 text of 40 characters each: the server's public key and this client's pair."""

    server: str
    public: str
    secret: str = field(repr=False)

    @staticmethod
    def read(server: "str | os.PathLike[str]", key_file: "str | os.PathLike[str]") -> "CurveKeys":
        """Keys as `limberd keygen` writes them: the server's public key (or its file), this client's secret key file. Its public
        key is in a file of the same name and ".pub". Refused if others may read the secret key."""
        _demand_private(key_file)
        is_key = len(str(server)) == 40 and not os.path.exists(server)
        return CurveKeys(str(server) if is_key else _read_key(server, "server_key"),
                         _read_key(f"{os.fspath(key_file)}.pub", "key"), _read_key(key_file, "key"))


def public_key(given: "str | os.PathLike[str]", name: str) -> str:
    """A client's public key: as text, or from the file that holds it; for a secret key's FILE, from FILE.pub."""
    if not os.path.exists(given):
        if len(str(given)) == 40:
            return str(given)
        raise LimberError("INVALID_ARGUMENT", f"{given!r} is neither a CURVE key (40 characters of Z85) nor a file", name)
    file = os.fspath(given)
    if os.path.exists(f"{file}.pub"):
        return _read_key(f"{file}.pub", name)
    # Only its owner may read it: a secret key looks the same, and would be sent.
    if os.name == "posix" and not str(file).endswith(".pub") and not os.stat(file).st_mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise LimberError("INVALID_ARGUMENT", f"{file} may hold a secret key: give FILE.pub, or the public key itself", name)
    return _read_key(file, name)


def _demand_private(path: "str | os.PathLike[str]") -> None:
    """Refuses files that other users may read: they are not secret."""
    try:
        mode = os.stat(path).st_mode
    except OSError:
        return  # _read_key() says why
    if os.name == "posix" and stat.S_ISREG(mode) and mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise LimberError("INVALID_ARGUMENT", f"others than its owner may read the secret key {path}: chmod 600 {path}", "key")


def _read_key(path: "str | os.PathLike[str]", name: str) -> str:
    try:
        with open(path, encoding="ascii", errors="replace",
                  opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK)) as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise LimberError("IO", f"cannot read {path}: it is no regular file", name)
            key = file.read(4096).strip()
    except LimberError:
        raise
    except OSError as error:
        raise of_file(error, f"cannot read {path}", name) from error
    if len(key) != 40 or len(key.split()) != 1:
        raise LimberError("INVALID_ARGUMENT", f"{path} does not hold a CURVE key (40 characters of Z85)", name)
    return key


def configure(socket: zmq.Socket, keys: CurveKeys | None) -> None:
    """Options of every socket of a client: it never blocks its closing, and notices a dead peer."""
    socket.linger = 0
    socket.rcvhwm = 0  # never a full queue, see reception.py; a thread empties every socket of a client
    socket.setsockopt(zmq.HEARTBEAT_IVL, 2000)
    socket.setsockopt(zmq.HEARTBEAT_TIMEOUT, 10000)
    socket.setsockopt(zmq.RECONNECT_IVL, 50)
    socket.setsockopt(zmq.RECONNECT_IVL_MAX, 2000)
    if keys:
        socket.setsockopt(zmq.CURVE_SERVERKEY, keys.server.encode())
        socket.setsockopt(zmq.CURVE_PUBLICKEY, keys.public.encode())
        socket.setsockopt(zmq.CURVE_SECRETKEY, keys.secret.encode())


def _needs_instance(kind: str, message: Any) -> bool:
    """Could another run of limberd take it for something else? Jobs and sessions given as NAME@UID are of one run."""
    session = getattr(message, "session", "")
    return kind == "shutdown" or (kind != "open_session" and bool(session) and "@" not in session)


def _is_for_next(kind: str, message: Any) -> bool:
    """Whether a run of limberd that takes the place of another one is asked too. Jobs end with their run."""
    job = getattr(message, "job", 0)  # SolveBeamsRequest has files of a job under that name
    return kind not in SENT_ONCE and not (isinstance(job, int) and job)


class Connection:
    """Requests to one limberd. Thread-safe."""

    def __init__(self, endpoint: str, keys: CurveKeys | None = None, timeout: float = 10.0, name: str | None = None):
        """timeout: how long an answer may take [s] where the request itself does not wait for something; name: as of connect()."""
        checks.text(endpoint, "endpoint")
        checks.duration(timeout, "timeout")
        self.endpoint = endpoint
        self.keys = keys
        self.timeout = timeout
        self.client_name = client_name(name)
        self.context = zmq.Context()
        self.client = secrets.token_hex(16)  # by which limberd knows repeated requests, also on a new connection
        # The run of limberd that plain names of sessions refer to: that of the first answer. It is a later one once a restart was
        # reported by ServerRestarted, or a session was opened there.
        self.instance = ""
        self._ids = itertools.count(1)
        self._pending: "dict[int, _Asked]" = {}
        self._lock = threading.Lock()
        self._closed = False
        self._last_heard = 0.0
        self._heard_instance = ""  # the run of limberd that answered last
        self._without_parts = ""   # the run of an older limberd, which does not know that answers can come in parts
        self._closed_first: "weakref.WeakSet" = weakref.WeakSet()
        inside = f"inproc://limber-{id(self)}"
        self._control = self.context.socket(zmq.PAIR)
        self._control.linger = 0
        self._control.bind(inside)
        try:
            self._open_socket().close()  # a malformed endpoint is refused here, not in the thread
        except zmq.ZMQError as error:
            self._control.close()
            self.context.term()
            raise LimberError("INVALID_ARGUMENT", f"cannot connect to {endpoint!r}: {error}; endpoints look like "
                              "tcp://HOST:PORT or ipc://PATH", "endpoint") from error
        self._thread = threading.Thread(target=self._run, args=(inside,), name="limber-io", daemon=True)
        self._thread.start()

    def call(self, kind: str, message, timeout: float | None = None):
        """Sends one request and returns its response message; raises LimberError.

        kind: the member of limber.v1.Request's body, e.g. "get_frames"; timeout [s], default that of the connection: of each part
        of an answer that is long (reply_parts.py). A request that names a session is refused by another run of limberd than
        `instance`: ServerRestarted is raised.
        """
        timeout = self.timeout if timeout is None else timeout
        if not reply_parts.may_be_long(kind, message):
            return self._answer(kind, self._ask(kind, message, timeout))
        for _ in range(_TRIES):
            if self._without_parts and self._without_parts == self._heard_instance:
                break
            try:
                return self._long_answer(kind, message, timeout)
            except LimberError as error:
                if reply_parts.is_of_older_server(error):
                    self._without_parts = self._heard_instance
                elif not reply_parts.is_gone(error):
                    raise
        return self._answer(kind, self._ask(kind, message, timeout))

    def _long_answer(self, kind: str, message, timeout: float):
        reply = self._ask(kind, message, timeout, most_reply_bytes=reply_parts.PartSize.LEAST)
        if reply.WhichOneof("body") != "get_reply_part":
            return self._answer(kind, reply)

        def next_part(wanted):
            return self._answer("get_reply_part", self._ask("get_reply_part", wanted, timeout))
        data = reply_parts.whole(reply.get_reply_part, next_part)
        try:
            return self._answer(kind, service.Reply.FromString(data))
        except DecodeError as error:
            raise LimberError("MALFORMED", f"the parts of the answer to {kind} are not one message") from error

    def _ask(self, kind: str, message, timeout: float, most_reply_bytes: int = 0) -> "service.Reply":
        sent = time.monotonic()
        identifier, asked = self._submit(kind, message, most_reply_bytes)
        try:
            return self._await(asked, timeout, asks=kind == "wait")
        except (futures.TimeoutError, ServerUnreachable) as error:
            # Requests that wait in the socket for another run would be executed there, although they are refused here.
            self._abandon(identifier, reopen=self._last_heard < sent or asked.refusal is not None)
            if asked.refusal is not None:
                raise from_message(asked.refusal.error) from None
            if isinstance(error, LimberError):  # a TimeoutError, too
                raise
            raise ServerUnreachable(f"no answer from {self.endpoint} to {kind} within {timeout:g} s") from None
        except BaseException:
            self._abandon(identifier, reopen=asked.refusal is not None)
            raise

    def _answer(self, kind: str, reply: "service.Reply"):
        """The response message of a reply to such a request; raises LimberError."""
        body = reply.WhichOneof("body")
        if body == "error":
            raise from_message(reply.error)
        if body != kind:
            raise LimberError("MALFORMED", f"the answer to {kind} is {body or f'of a kind that this client ({PACKAGE}) does not know'}")
        return getattr(reply, body)

    def ask_whether_there(self) -> None:
        """Raises ServerUnreachable."""
        self.call("get_server_info", service.GetServerInfoRequest(), timeout=min(PATIENCE, self.timeout))

    def _await(self, asked: _Asked, timeout: float, asks: bool) -> "service.Reply":
        """asks: whether the server is there, while it is silent."""
        begin = time.monotonic()
        if asked.again is not None:
            try:
                return self._attentive(asked, begin + timeout / 2, asks)
            except LimberError:
                raise
            except futures.TimeoutError:
                if self._last_heard < begin or asked.refusal is not None:
                    self._send(asked.again)
        return self._attentive(asked, begin + timeout, asks)

    def _attentive(self, asked: _Asked, deadline: float, asks: bool) -> "service.Reply":
        future = asked.future
        meant = self.instance
        while asks:
            if asked.refusal is not None:
                deadline = min(deadline, asked.refused + NEXT_RUN)
            left = deadline - time.monotonic()
            if left <= SILENCE:
                break
            try:
                return future.result(SILENCE)
            except LimberError:
                raise
            except futures.TimeoutError:
                if time.monotonic() - self._last_heard >= SILENCE and asked.refusal is None:
                    self.ask_whether_there()
                if meant and self._heard_instance != meant and asked.refusal is None:
                    raise ServerRestarted("limberd was restarted, and what is waited for is gone with it")
        return future.result(max(0.0, deadline - time.monotonic()))

    def before_closing(self, other: Any) -> None:
        """Something with sockets of this connection's context: its close() is called first."""
        with self._lock:
            self._closed_first.add(other)

    def close(self) -> None:
        """Ends the thread, the streams and the sockets; requests in flight raise CANCELLED."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            self._control.send(_STOP)
            streams = list(self._closed_first)
        for stream in streams:
            stream.close()
        self._thread.join()
        self._control.close()
        self.context.destroy(linger=0)

    def _submit(self, kind: str, message, most_reply_bytes: int) -> "tuple[int, _Asked]":
        request = service.Request(version=PROTOCOL, id=next(self._ids), client=self.client, client_name=self.client_name,
                                  most_reply_bytes=most_reply_bytes,
                                  instance=self.instance if _needs_instance(kind, message) else "", **{kind: message})
        data = request.SerializeToString()
        asked = _Asked(futures.Future(), None if kind in SENT_ONCE else data, _is_for_next(kind, message))
        with self._lock:
            if self._closed:
                raise LimberError("CANCELLED", "this connection is closed")
            self._pending[request.id] = asked
            self._control.send_multipart([_SEND, data])
        return request.id, asked

    def _send(self, data: bytes) -> None:
        with self._lock:
            if not self._closed:
                self._control.send_multipart([_SEND, data])

    def _abandon(self, identifier: int, reopen: bool) -> None:
        with self._lock:
            self._pending.pop(identifier, None)
            if reopen and not self._closed:
                self._control.send(_REOPEN)

    def _open_socket(self) -> zmq.Socket:
        socket = self.context.socket(zmq.DEALER)
        try:
            configure(socket, self.keys)
            socket.connect(self.endpoint)
        except BaseException:
            socket.close()
            raise
        return socket

    def _run(self, inside: str) -> None:
        control = self.context.socket(zmq.PAIR)
        control.linger = 0
        control.connect(inside)
        socket = self._open_socket()
        connected = socket.get_monitor_socket(zmq.EVENT_HANDSHAKE_SUCCEEDED)
        was_connected = False
        running = True
        while running:
            # No poller object: the sockets change, and three of them are cheap to poll.
            poller = zmq.Poller()
            poller.register(control, zmq.POLLIN)
            poller.register(socket, zmq.POLLIN)
            poller.register(connected, zmq.POLLIN)
            ready = dict(poller.poll())
            if connected in ready:
                zmq.utils.monitor.recv_monitor_message(connected)
                if was_connected:
                    self._send_unanswered(socket)
                was_connected = True
            if control in ready:
                parts = control.recv_multipart()
                if parts[0] == _SEND:
                    try:
                        socket.send(parts[1], zmq.NOBLOCK)
                    except zmq.Again:
                        pass  # the queue to a silent server is full: the request's deadline says so
                elif parts[0] == _REOPEN:
                    socket.disable_monitor()
                    connected.close()
                    socket.close()
                    socket = self._open_socket()
                    connected = socket.get_monitor_socket(zmq.EVENT_HANDSHAKE_SUCCEEDED)
                    was_connected = True  # requests of others went with the socket
                    continue
                else:
                    running = False
            if socket in ready:
                self._receive(socket)
        socket.disable_monitor()
        connected.close()
        socket.close()
        control.close()
        with self._lock:
            left, self._pending = list(self._pending.values()), {}
        for asked in left:
            asked.future.set_exception(LimberError("CANCELLED", "this connection was closed"))

    def _send_unanswered(self, socket: zmq.Socket) -> None:
        """The connection is another one: requests that the server had not read on the previous one are lost."""
        with self._lock:
            unanswered = [asked.again for asked in self._pending.values() if asked.again is not None]
        for again in unanswered:
            try:
                socket.send(again, zmq.NOBLOCK)
            except zmq.Again:
                return  # half of their time sends them once more

    def _receive(self, socket: zmq.Socket) -> None:
        parts = socket.recv_multipart()
        try:
            reply = service.Reply.FromString(parts[-1])
        except DecodeError:
            return  # no message of ours; its caller meets the deadline
        self._last_heard = time.monotonic()
        self._heard_instance = reply.instance or self._heard_instance
        body = reply.WhichOneof("body")
        is_adopted = body == "open_session" or body == "error" and reply.error.code == common.ERROR_CODE_RESTARTED
        if reply.instance and (is_adopted or not self.instance):
            self.instance = reply.instance
        is_put_off = (body == "error" and reply.error.code == common.ERROR_CODE_SHUTTING_DOWN
                      and reply.error.details.get("send_again") == "true")
        with self._lock:
            asked = self._pending.get(reply.id)
            if asked is not None and asked.is_for_next and is_put_off:
                asked.refusal, asked.refused = reply, self._last_heard
                # It was not done; the next connection sends it again.
                return
            self._pending.pop(reply.id, None)
        if asked is not None:
            asked.future.set_result(reply)


def reachable(stream: str, requests: str) -> str:
    """The stream's endpoint as this client reaches it: a wildcard host is the host of the request endpoint."""
    bound, used = urlsplit(stream), urlsplit(requests)
    if bound.scheme == "tcp" and bound.hostname in ("0.0.0.0", "*", "::") and used.scheme == "tcp":
        return f"tcp://{used.netloc.rpartition(':')[0]}:{bound.netloc.rpartition(':')[2]}"
    return stream
