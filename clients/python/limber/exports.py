"""Files that a server makes of a session, fetched and written here."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Callable, Iterator, Sequence

from .errors import LimberError, of_file
from .messages import service
from .results import Result

if TYPE_CHECKING:
    from .open_session import OpenSession


@dataclass(frozen=True)
class Export:
    """Files an export wrote; iterates over them."""

    files: tuple[Path, ...]
    result: Result | None  # the exported result; of the last format that has one: a scene has none

    def __iter__(self):
        return iter(self.files)

    def __len__(self) -> int:
        return len(self.files)


def export(session: "OpenSession", formats: Sequence[str], folder: Path, stem: str, timeout: float,
           report: Callable[[str, float], None]) -> Export:
    """Fetches all parts and writes them; formats are names of session.FORMATS."""
    written: dict[Path, None] = {}
    result: Result | None = None
    for name in formats:
        for response in _parts(session, name, stem, timeout, report):
            if response.HasField("result"):
                result = session.result_of(response.result)
            for file in response.files:
                written[write_exported(folder, file)] = None
    return Export(tuple(written), result)


def fetch(session: "OpenSession", name: str, timeout: float = 120.0) -> dict[str, bytes]:
    """The files of one format by their names, not written."""
    files: dict[str, bytes] = {}
    for response in _parts(session, name, "", timeout, lambda what, share: None):
        for file in response.files:
            files[file.name] = files.get(file.name, b"") * file.append + file.content
    return files


def fetch_first_part(session: "OpenSession", name: str, timeout: float = 120.0) -> dict[str, bytes]:
    """As fetch(), of the first part alone: whatever of a motion does not change from frame to frame is in it."""
    response = next(_parts(session, name, "", timeout, lambda what, share: None))
    return {file.name: file.content for file in response.files}


def _parts(session: "OpenSession", name: str, stem: str, timeout: float,
           report: Callable[[str, float], None]) -> "Iterator[service.ExportResponse]":
    """Answers for one format, all of the same result."""
    part = count = sequence = 0
    while part == 0 or part < count:
        request = service.ExportRequest(session=session.reference, format=session.FORMATS[name], stem=stem, part=part,
                                        result_sequence=sequence)
        response = session.connection.call("export", request, timeout=timeout)
        sequence = response.result.sequence
        count = response.part_count
        yield response
        part += 1
        report(f"exporting {name}", part / max(count, 1))


def write_exported(folder: Path, file: "service.ExportedFile") -> Path:
    """Writes one exported file below the folder, for every name that it has."""
    relative = PurePosixPath(file.name)
    if not relative.parts or relative.is_absolute() or ".." in relative.parts:
        raise LimberError("MALFORMED", f"the server names a file outside the folder: {file.name!r}")
    path = folder / relative
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with open(path, "ab" if file.append else "wb") as out:
            out.write(file.content)
    except OSError as error:
        raise of_file(error, f"cannot write {path}", "folder") from error
    return path
