"""A private limberd that lives as long as the script."""

from __future__ import annotations

import atexit
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Sequence

from . import browsing, checks
from .connection import Connection
from .errors import LimberError, invalid, not_there
from .server import Server


def find_binary(name: str = "limberd") -> Path:
    """$LIMBER_BIN (a folder, or the file itself), then PATH, then build/release/bin of the sources around here."""
    given = os.environ.get("LIMBER_BIN")
    if given:
        path = Path(given)
        path = path / name if path.is_dir() else path.with_name(name)
        if path.is_file():
            return path
        raise not_there(f"LIMBER_BIN is {given}, but there is no {path}", "LIMBER_BIN")
    on_path = shutil.which(name)
    if on_path:
        return Path(on_path)
    for folder in Path(__file__).resolve().parents:
        built = folder / "build" / "release" / "bin" / name
        if built.is_file():
            return built
    raise not_there(f"no {name} in $LIMBER_BIN, on PATH or in build/release/bin; run scripts/build", "")


class Guard:
    """A small process that outlives this one: if this one dies without a word (SIGKILL, abort), it ends limberd and
    removes the folder. It knows by the end of a pipe. A death signal of the kernel would follow the thread that
    launched, not the process, and would leave the folder."""

    # "$2", a folder of its own, stands in the command line of limberd, so no other process of that number is hit.
    SCRIPT = """
        read -r word && exit 0
        i=0
        while grep -qsF -- "$2/ready" "/proc/$1/cmdline" && [ $i -lt 50 ]; do
            [ $i = 0 ] && kill -TERM "$1"
            i=$((i + 1))
            sleep 0.1
        done
        grep -qsF -- "$2/ready" "/proc/$1/cmdline" && kill -KILL "$1"
        rm -rf -- "$2"
    """

    def __init__(self, pid: int, folder: Path):
        # A session of its own: Ctrl-C in a terminal is not for it.
        self._process = subprocess.Popen(["/bin/sh", "-c", self.SCRIPT, "limber-guard", str(pid), str(folder)],
                                         stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                         start_new_session=True)

    def dismiss(self) -> None:
        """There is nothing to guard any more. May be called again."""
        if self._process.stdin and not self._process.stdin.closed:
            try:
                self._process.communicate(b"done\n")
            except BrokenPipeError:
                pass  # somebody ended it
        self._process.wait()


class LaunchedServer(Server):
    """A server of our own: leaving the context (or the interpreter) stops it, and so does the interpreter's death."""

    def __init__(self, connection: Connection, process: subprocess.Popen, folder: Path, guard: Guard):
        self.process = process
        self.guard = guard
        self.folder = folder
        super().__init__(connection)
        atexit.register(self.close)

    @property
    def log(self) -> str:
        """The output of limberd so far."""
        return (self.folder / "limberd.log").read_text(errors="replace")

    def close(self) -> None:
        super().close()
        atexit.unregister(self.close)
        stop(self.process)
        self.guard.dismiss()
        shutil.rmtree(self.folder, ignore_errors=True)


def stop(process: subprocess.Popen, patience: float = 10.0) -> int:
    """SIGTERM, then SIGKILL if that is not heard; the exit code."""
    if process.poll() is None:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(patience)
        except subprocess.TimeoutExpired:
            process.kill()
    return process.wait()


def launch(binary: "str | os.PathLike[str] | None" = None, *, transport: str = "ipc", arguments: Sequence[str] = (),
           cache_dir: "str | os.PathLike[str] | None" = None, timeout: float = 30.0, web: bool = False,
           embed_in: "Sequence[str] | None" = None, name: str | None = None) -> LaunchedServer:
    """Starts a limberd of our own and connects to it. It ends with the server object, or with this process.

    binary: default see find_binary(). `transport`: "ipc" (sockets in a folder that is removed with the server) or "tcp" (free
    ports on loopback, for other clients too). `arguments`: more options of limberd. `cache_dir`: for built models (default:
    limberd's own, in which a scene that was opened before is ready at once). Raises LimberError with the output of limberd if it
    does not start. `name`: as in connect().

    web: serves the page too, on a free port of loopback, for OpenSession.show(). `embed_in`: origins of pages that may embed it,
    such as "http://localhost:8888"; in a notebook, by default those of this user's notebook servers on this machine.
    """
    if transport not in ("ipc", "tcp"):
        raise invalid("transport", f'transport is "ipc" or "tcp", not {transport!r}')
    checks.duration(timeout, "timeout")
    arguments = list(map(str, checks.several(arguments, "arguments")))
    if checks.flag(web, "web"):
        arguments += ["--web", "127.0.0.1:0"]
        for origin in browsing.notebook_origins() if embed_in is None and browsing.in_notebook() else \
                checks.several(embed_in or (), "embed_in"):
            arguments += ["--web-frame-ancestor", checks.text(origin, "embed_in")]
    elif embed_in is not None:
        raise invalid("embed_in", "a server has pages to embed with web=True alone")
    binary = checks.path(binary, "binary") if binary else find_binary()
    folder = Path(tempfile.mkdtemp(prefix="limber-"))
    if len(str(folder)) > 80:  # a socket's path has at most 107 bytes
        folder.rmdir()
        folder = Path(tempfile.mkdtemp(prefix="limber-", dir="/tmp"))
    bind, stream = (f"ipc://{folder}/requests", f"ipc://{folder}/stream") if transport == "ipc" \
        else ("tcp://127.0.0.1:0", "tcp://127.0.0.1:0")
    command = [str(binary), "--bind", bind, "--stream", stream, "--ready-file", str(folder / "ready"), *arguments]
    if cache_dir:
        command += ["--cache-dir", str(cache_dir)]
    process = connection = guard = None
    try:
        with open(folder / "limberd.log", "wb") as log:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        guard = Guard(process.pid, folder)
        connection = Connection(_await_ready(process, folder, timeout), name=name)
        return LaunchedServer(connection, process, folder, guard)
    except BaseException as error:
        if connection:
            connection.close()
        if process:
            stop(process)
        if guard:
            guard.dismiss()
        shutil.rmtree(folder, ignore_errors=True)
        if isinstance(error, OSError) and not isinstance(error, LimberError):
            raise not_there(f"cannot run {binary}: {error}", "") from error
        raise


def _await_ready(process: subprocess.Popen, folder: Path, timeout: float) -> str:
    """The endpoint for requests, once limberd says that it is ready."""
    deadline = time.monotonic() + timeout
    while not (folder / "ready").exists():
        if process.poll() is not None or time.monotonic() > deadline:
            printed = (folder / "limberd.log").read_text(errors="replace").strip()
            raise LimberError("FAILED_PRECONDITION",
                              f"{process.args[0]} did not start: {printed or 'it printed nothing'}")
        time.sleep(0.01)
    return json.loads((folder / "ready").read_text())["requests"]
