"""Progress of long work: a callback, or a bar on stderr if that is a terminal."""

from __future__ import annotations

import sys
import time
from typing import Callable, Union

ProgressCallback = Callable[[str, float], None]
# A callback (stage, fraction in [0, 1]); True: always a bar; False: silence; None: a bar on terminals only.
ProgressOption = Union[ProgressCallback, bool, None]


class Bar:
    """One line, redrawn at most ten times a second: `building the model [#####.....]  52 %  3.1 s`."""

    WIDTH = 30

    def __init__(self, stream=None):
        self._stream = stream or sys.stderr
        self._start = time.monotonic()
        self._drawn = 0.0
        self._length = 0

    def __call__(self, stage: str, fraction: float) -> None:
        now = time.monotonic()
        if fraction < 1 and now - self._drawn < 0.1:
            return
        self._drawn = now
        fraction = min(max(fraction, 0.0), 1.0)
        filled = round(self.WIDTH * fraction)
        line = f"{stage:<28.28} [{'#' * filled}{'.' * (self.WIDTH - filled)}] {100 * fraction:3.0f} %" \
               f" {now - self._start:6.1f} s"
        self._stream.write("\r" + line + " " * max(0, self._length - len(line)))
        self._stream.flush()
        self._length = len(line)

    def close(self) -> None:
        """Leaves the line so that the next output starts on a fresh one."""
        if self._length:
            self._stream.write("\n")
            self._stream.flush()
            self._length = 0


class Reporter:
    """Context manager around a ProgressOption: call it with (stage, fraction)."""

    def __init__(self, option: ProgressOption):
        self._bar: Bar | None = None
        self._callback: ProgressCallback | None = None
        if callable(option):
            self._callback = option
        elif option or (option is None and sys.stderr.isatty()):
            self._bar = Bar()
            self._callback = self._bar

    def __enter__(self) -> "Reporter":
        return self

    def __call__(self, stage: str, fraction: float) -> None:
        if self._callback:
            self._callback(stage, fraction)

    def __exit__(self, *exc) -> None:
        if self._bar:
            self._bar.close()
