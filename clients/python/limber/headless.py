"""A Chromium without a display, driven through two pipes by its DevTools protocol."""

from __future__ import annotations

import json
import os
import select
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from .errors import LimberError

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
# WebGL by software if there is no GPU; no actions of a browser's first start.
FLAGS = ("--headless=new", "--remote-debugging-pipe", "--enable-unsafe-swiftshader", "--use-gl=angle",
         "--use-angle=swiftshader", "--ignore-gpu-blocklist", "--no-first-run", "--no-default-browser-check",
         "--disable-extensions", "--disable-background-networking", "--disable-dev-shm-usage", "--hide-scrollbars",
         "--mute-audio", "--force-device-scale-factor=1")
# Chromium reads commands from descriptor 3 and answers on 4, whatever they were called here.
STARTER = """
import fcntl, os, sys
ends = [fcntl.fcntl(int(end), fcntl.F_DUPFD, 10) for end in sys.argv[1:3]]
os.dup2(ends[0], 3)
os.dup2(ends[1], 4)
os.execv(sys.argv[3], sys.argv[3:])
"""


def find_chromium() -> str:
    """$LIMBER_CHROMIUM, then PATH."""
    given = os.environ.get("LIMBER_CHROMIUM")
    found = shutil.which(given) if given else next(filter(None, map(shutil.which, NAMES)), None)
    if not found:
        raise LimberError("NOT_FOUND", f"LIMBER_CHROMIUM is {given}, which is no program" if given else
                          "rendering needs Chromium (Debian: chromium) on PATH, or as $LIMBER_CHROMIUM", "LIMBER_CHROMIUM")
    return found


class Browser:
    """One page of a browser of its own, which goes with the context."""

    def __init__(self, timeout: float = 60.0):
        """timeout: of each answer [s]."""
        self._timeout = timeout
        self._number = 0
        self._read = b""
        self._folder = Path(tempfile.mkdtemp(prefix="limber-render-"))
        program = find_chromium()
        sandbox = ["--no-sandbox"] if os.geteuid() == 0 else []  # as root it has none
        commands, self._out = os.pipe()
        self._in, answers = os.pipe()
        try:
            with open(self._folder / "log", "wb") as log:
                self._process = subprocess.Popen(
                    [sys.executable, "-c", STARTER, str(commands), str(answers), program, *FLAGS, *sandbox,
                     f"--user-data-dir={self._folder / 'profile'}", "about:blank"],
                    stdin=subprocess.DEVNULL, stdout=log, stderr=log, pass_fds=(commands, answers))
        finally:
            os.close(commands)
            os.close(answers)
        try:
            pages = [target for target in self.call("Target.getTargets")["targetInfos"] if target["type"] == "page"]
            target = pages[0]["targetId"] if pages else self.call("Target.createTarget", url="about:blank")["targetId"]
            self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        except BaseException:
            self.close()
            raise

    _session = ""

    def __enter__(self) -> "Browser":
        return self

    def __exit__(self, *exc) -> None:
        self.close()

    def close(self) -> None:
        for end in (self._out, self._in):
            try:
                os.close(end)  # by which it ends
            except OSError:
                pass
        try:
            self._process.wait(5)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        shutil.rmtree(self._folder, ignore_errors=True)

    def call(self, method: str, **params: Any) -> "dict[str, Any]":
        """The answer to a command of the protocol. raises LimberError"""
        self._number += 1
        message = {"id": self._number, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        content = memoryview(json.dumps(message).encode() + b"\0")
        try:
            while content:
                content = content[os.write(self._out, content):]
        except OSError as error:
            raise self._failure("it ended") from error
        deadline = time.monotonic() + self._timeout
        while True:
            answer = json.loads(self._next(deadline))
            if answer.get("id") != self._number:
                continue  # an event
            if "error" in answer:
                raise self._failure(f"{method}: {answer['error'].get('message')}")
            return answer["result"]

    def evaluate(self, expression: str) -> Any:
        """The value of a JavaScript expression, or of its promise."""
        answer = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in answer:
            details = answer["exceptionDetails"]
            raise self._failure(details.get("exception", {}).get("description") or details.get("text", ""))
        return answer["result"].get("value")

    def open(self, path: Path, width: int, height: int) -> None:
        """A file as a page of so many pixels, once it is loaded."""
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        url = path.resolve().as_uri()
        self.call("Page.navigate", url=url)
        deadline = time.monotonic() + self._timeout
        while not self.evaluate(f"location.href === {json.dumps(url)} && document.readyState === 'complete'"):
            if time.monotonic() > deadline:
                raise self._failure("the page does not load")
            time.sleep(0.02)

    def _next(self, deadline: float) -> bytes:
        while b"\0" not in self._read:
            ready, _, _ = select.select([self._in], [], [], max(0.0, deadline - time.monotonic()))
            if not ready:
                raise self._failure(f"no answer within {self._timeout:g} s")
            part = os.read(self._in, 1 << 20)
            if not part:
                raise self._failure("it ended")
            self._read += part
        message, _, self._read = self._read.partition(b"\0")
        return message

    def _failure(self, what: str) -> LimberError:
        log = (self._folder / "log").read_text(errors="replace") if (self._folder / "log").exists() else ""
        said = [line for line in log.splitlines() if line.strip()]
        return LimberError("INTERNAL", f"Chromium could not draw this: {what}" + (f" ({said[-1]})" if said else ""))
