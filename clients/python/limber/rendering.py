"""Pictures and films of the player's page, drawn by a Chromium without a display; films by ffmpeg."""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Iterator, Sequence

import numpy as np

from . import checks, player
from .errors import LimberError, invalid, not_there, of_file
from .headless import Browser
from .progress import ProgressOption, Reporter

if TYPE_CHECKING:
    from .open_session import OpenSession

PICTURES = {".png": "image/png", ".jpg": "image/jpeg", ".jpeg": "image/jpeg"}
FILMS = (".mp4", ".gif", ".webm")
MOST_PIXELS = 4096
FINER = 2             # drawn as much larger and made smaller, for smooth edges without those of the GPU
GIF_RATE = 25.0       # frames a second; most programs play faster ones slowly


def render(session: "OpenSession", path: "str | os.PathLike[str]", *, frame: int, size: Sequence[int],
           view: "Sequence[float] | None", up: "str | None", frames_per_second: "float | None", tolerance: float,
           surface: "str | os.PathLike[str] | None", progress: ProgressOption) -> Path:
    """See OpenSession.render()."""
    target = checks.path(path, "path")
    ending = checks.one_of(target.suffix.lower(), (*PICTURES, *FILMS), "path")
    width, height = _size(size)
    angles = None if view is None else [checks.real(angle, "view") for angle in checks.several(view, "view")]
    if angles is not None and (len(angles) != 2 or not np.isfinite(angles).all()):
        raise invalid("view", f"view is azimuth and elevation [degree], not {view!r}")
    ffmpeg = _ffmpeg() if ending in FILMS else ""
    text, (count, *_) = player.document(session, tolerance=tolerance, up=up, frames_per_second=frames_per_second,
                                        surface=surface, frame=frame if ending in PICTURES else None)
    with tempfile.TemporaryDirectory(prefix="limber-render-") as folder, Reporter(progress) as report, Browser() as browser:
        page = Path(folder) / "motion.html"
        page.write_text(text, encoding="utf-8")
        browser.open(page, FINER * width, FINER * height)
        _prepare(browser, angles)
        if ending in PICTURES:
            _write(target, _picture(browser, frame % count, PICTURES[ending], width, height))
            return target
        rate = browser.evaluate("player.stored.rate")
        shown, rate = _shown(count, rate, GIF_RATE if ending == ".gif" else np.inf)
        kind = "image/png" if ending == ".gif" else "image/jpeg"

        def pictures() -> "Iterator[bytes]":
            for done, number in enumerate(shown):
                yield _picture(browser, number, kind, width, height)
                report("rendering", (done + 1) / len(shown))
        _film(ffmpeg, target, rate, pictures())
    return target


def _size(size: Sequence[int]) -> "tuple[int, int]":
    given = checks.wholes(size, "size")
    if len(given) != 2 or not all(16 <= side <= MOST_PIXELS for side in given):
        raise invalid("size", f"size is width and height in pixels, in 16 .. {MOST_PIXELS}, not {size!r}")
    return given[0], given[1]


def _shown(count: int, rate: float, most: float) -> "tuple[list[int], float]":
    """Every frame, or every so-manieth where there are too many a second; and how many a second that are."""
    step = max(1, int(np.ceil(rate / most - 1e-9)))
    return list(range(0, count, step)), rate / step


def _prepare(browser: Browser, angles: "list[float] | None") -> None:
    if not browser.evaluate("Boolean(window.player)"):
        raise LimberError("INTERNAL", "the player does not start in this Chromium: "
                          + str(browser.evaluate("document.querySelector('.failed')?.textContent ?? 'no word of it'")))
    # After the timeline is removed the canvas has another size, a frame later, and then all of the motion fits.
    browser.evaluate("(player.bare(), new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(1)))))")
    browser.evaluate(f"player.frameAll(...{json.dumps(angles or [])})")


def _picture(browser: Browser, frame: int, kind: str, width: int, height: int) -> bytes:
    url = browser.evaluate(f"player.picture({frame}, {json.dumps(kind)}, {width}, {height})")
    return base64.b64decode(url.partition(",")[2])


def _write(target: Path, content: bytes) -> None:
    try:
        target.write_bytes(content)
    except OSError as error:
        raise of_file(error, f"{target} cannot be written", "path") from error


def _ffmpeg() -> str:
    found = shutil.which("ffmpeg")
    if not found:
        raise not_there("films need the program ffmpeg (Debian: ffmpeg); pictures (.png) do not", "path")
    return found


def _film(ffmpeg: str, target: Path, rate: float, pictures: "Iterator[bytes]") -> None:
    options = {
        ".mp4": ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-c:v", "libx264", "-crf", "18", "-pix_fmt", "yuv420p",
                 "-movflags", "+faststart"],
        ".webm": ["-c:v", "libvpx-vp9", "-crf", "24", "-b:v", "0", "-pix_fmt", "yuv420p"],
        ".gif": ["-vf", "split[a][b];[a]palettegen=stats_mode=diff[p];[b][p]paletteuse=dither=bayer:bayer_scale=4", "-loop", "0"],
    }[target.suffix.lower()]
    _write(target, b"")  # whether it can be
    with tempfile.TemporaryFile() as log:
        process = subprocess.Popen([ffmpeg, "-y", "-loglevel", "error", "-f", "image2pipe", "-framerate", f"{rate:.9g}", "-i", "-",
                                    *options, f"file:{target}"], stdin=subprocess.PIPE, stdout=log, stderr=log)
        assert process.stdin is not None
        try:
            for picture in pictures:
                process.stdin.write(picture)
            process.stdin.close()
        except BrokenPipeError:
            pass  # it says why
        except BaseException:
            process.kill()
            process.wait()
            target.unlink(missing_ok=True)
            raise
        if process.wait() != 0:
            target.unlink(missing_ok=True)
            log.seek(0)
            raise LimberError("IO", f"ffmpeg made no film: {log.read().decode(errors='replace').strip()}", "path")
