"""Common part of sessions of bodies, linkages and beams: state, waiting, frames, streams, control."""

from __future__ import annotations

import os
import time
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Iterable, Sequence

import numpy as np

from . import arrays, browsing, checks, edits, exports, frame_parts, pictures, player, rendering, saving
from .browsing import SessionPage
from .errors import LimberError, ServerStopped, ServerUnreachable
from .exports import Export
from .messages import common, presence, service
from .motion import MotionStream
from .moving import MovingPoints, MovingSurface
from .pictures import Coloured
from .player import Played
from .presence import RevisionMade, SessionClient
from .progress import ProgressOption, Reporter
from .results import ENCODINGS, Result, decode, issue_text
from .saving import Saved
from .stream import FrameStream

if TYPE_CHECKING:
    from .obj_files import ObjSurface
    from .server import Server

_UNTIL = {"first": service.WaitRequest.UNTIL_FIRST, "final": service.WaitRequest.UNTIL_FINAL,
          "checked": service.WaitRequest.UNTIL_CHECKED}


class AccuracyWarning(UserWarning):
    """A body's model misses the tolerance that its scene asks for: every motion is off by about as much."""


class SnapWarning(UserWarning):
    """On its way to the equilibrium a linkage or structure jumped to another shape: along another way it may rest elsewhere."""


class MaterialWarning(UserWarning):
    """A scene's material has no effect: the mesh file brings its own."""


@dataclass(frozen=True)
class Receipt:
    """The server's answer to accepted edits."""

    revision: int
    constraint_ids: tuple[int, ...]  # per edit the constraint it touched, 0 if none
    issues: tuple[str, ...] = ()     # warnings: accepted edits without effect
    keyframe_ids: tuple[int, ...] = ()  # per edit the keyframe it touched, 0 if none
    target_ids: tuple[int, ...] = ()    # of a linkage: per edit the target it touched, 0 if none


class OpenSession:
    """A session on a server; several may name the same session."""

    UP = "z"  # the axis of its scenes that is up in pictures and .glb files, unless said otherwise

    def __init__(self, server: "Server", id: str, job: int = 0, issues: Iterable[str] = (), uid: int = 0,
                 instance: str = ""):
        self.server = server
        self.id = id
        self.uid = uid                    # never reused, as `id` may be; 0: not known
        self.instance = instance          # the run of limberd that it is of
        self.job = job                    # that builds the model
        self.issues = tuple(issues)       # repairs and warnings of the mesh
        self.revision = 0                 # newest this client made or saw
        self._client = 0                  # number of this client in the session's list; 0: not known
        self._is_accuracy_reported = False  # of the model, by a warning where it misses its tolerance
        self._snaps_told: "tuple[Any, ...]" = ()  # of the newest result that was warned of: its revision, its snaps

    @property
    def connection(self):
        return self.server.connection

    @property
    def reference(self) -> str:
        """By which requests reach this very session and never another one of its name: `id@uid`."""
        return f"{self.id}@{self.uid}" if self.uid else self.id

    # ---- state ----

    def status(self) -> "service.SessionStatus":
        """State, sizes, model and newest result."""
        return self.connection.call("get_session", service.GetSessionRequest(session=self.reference)).status

    def clients(self) -> list[SessionClient]:
        """Clients in the session, the longest first: those that opened, joined or edited it and are still connected. A client
        that died is there for at most 20 s. Every change comes with the topic session/ID/status."""
        return [SessionClient.from_message(one, self._client) for one in self.status().clients]

    def revisions(self) -> list[RevisionMade]:
        """Authors and edits of the newest revisions, the newest first; those of one client and kind in a row as one, at most
        16."""
        return [RevisionMade.from_message(one) for one in self.status().revisions]

    def join(self) -> None:
        """Others see this client in the session from now on, as they do once it has opened or edited it, or Server.session() was
        called for it."""
        self._client = self.connection.call("join_session", presence.JoinSessionRequest(session=self.reference)).client

    def leave(self) -> None:
        """Others no longer see this client in the session, until it edits or joins it again. The session stays."""
        self.connection.call("leave_session", presence.LeaveSessionRequest(session=self.reference))

    def explain(self) -> "service.ExplainResponse":
        """Choices for the session and their reasons (`choices`), errors of its newest result and how they were found (`errors`),
        and advice to change them (`advice`)."""
        return self.connection.call("explain", service.ExplainRequest(session=self.reference))

    def result_of(self, info: "service.ResultInfo") -> Any:
        """A result as sessions of this kind tell it."""
        return Result.from_message(info)

    def geometry_for(self, frames: "service.Frames") -> Any:
        """Geometry that decode() needs for these frames: for coordinates an object with positions(coordinates) and basis_hash."""
        if frames.encoding == service.ENCODING_COORDINATES:
            raise LimberError("UNSUPPORTED", 'this client does not know what coordinates are of this kind of session: '
                                             'ask for encoding="positions", or load the module of the kind', "encoding")
        return None

    def warn_of_accuracy(self, status: "service.SessionStatus", stacklevel: int) -> None:
        """Warns once of a model that misses its tolerance. stacklevel: as in warnings.warn, counted from the caller."""
        if self._is_accuracy_reported or not status.HasField("model"):
            return
        self._is_accuracy_reported = True
        if not status.model.met_tolerance:
            warnings.warn(f"the model of session {self.id} misses its tolerance: {status.model.message}",
                          AccuracyWarning, stacklevel=stacklevel + 1)

    def warn_of_snaps(self, result: Any, snaps: "Sequence[str]", stacklevel: int) -> None:
        """Warns once of a result with snaps on its path. stacklevel: as in warnings.warn, counted from the caller."""
        told = (result.revision, *snaps)
        if snaps and told != self._snaps_told:
            self._snaps_told = told
            warn_of_snaps(f"session {self.id}, revision {result.revision}", snaps, stacklevel + 1)

    # ---- edits ----

    def edit(self, changes: Iterable[Any], expected_revision: int | None = None) -> Receipt:
        """All or nothing, in order, as one revision: messages, or mappings (the JSON form of limber.v1.Edit).

        expected_revision: refuse (FAILED_PRECONDITION) unless this is the newest one.
        """
        if expected_revision is not None:
            checks.whole(expected_revision, "expected_revision", most=2 ** 64 - 1)
        return self._send(edits.to_messages(checks.several(changes, "edits")), expected_revision)

    def _send(self, messages: "list[service.Edit]", expected_revision: int | None) -> Receipt:
        request = service.EditRequest(session=self.reference, edits=messages, expected_revision=expected_revision)
        response = self.connection.call("edit", request)
        self.revision = max(self.revision, response.revision)
        return Receipt(response.revision, tuple(response.constraint_ids),
                       tuple(issue_text(issue) for issue in response.issues), tuple(response.keyframe_ids),
                       tuple(response.target_ids))

    def undo(self, anyone: bool = False) -> Receipt:
        """Undoes the newest edit made under this client's name, also if others have edited since; refused if they have changed
        the same. `anyone`: the newest edit of any client."""
        return self.edit([edits.undo(anyone)])

    def redo(self, anyone: bool = False) -> Receipt:
        """Redoes the undone edit."""
        return self.edit([edits.redo(anyone)])

    # ---- results ----

    def wait(self, revision: int | None = None, until: str = "final", timeout: float = 60.0) -> Result:
        """Waits for a result that contains a revision (default: the newest this client made or saw).

        until: "first" for the first such result, "final" for its final one (result.status says whether it converged). With
        "checked" it is the final one with later findings: for a body result.motion_error, for a linkage or beams
        result.discretisation_error. Raises LimberError TIMEOUT (a TimeoutError), which names the session, the revision and the
        session's state. Raises ServerUnreachable within 8 s after the server falls silent.
        """
        checks.one_of(until, _UNTIL, "until")
        checks.duration(timeout, "timeout")
        wanted = self.revision if revision is None else checks.whole(revision, "revision", most=2 ** 64 - 1)
        request = service.WaitRequest(session=self.reference, revision=wanted, until=_UNTIL[until], timeout_s=timeout)
        try:
            response = self.connection.call("wait", request, timeout=timeout + self.connection.timeout)
        except LimberError as error:
            if error.code != "TIMEOUT" or isinstance(error, ServerUnreachable):
                raise
            wish = {"first": "result", "final": "final result", "checked": "checked result"}[until]
            raise self.late(f"no {wish} of revision {wanted} within {timeout:g} s", error.field) from None
        return self.result_of(response.result)

    def late(self, what: str, field: str = "") -> LimberError:
        """The error of a wait that ran out of time: the session, and its state. Asks the list, which wakes no parked session."""
        try:
            listed = self.connection.call("list_sessions", service.ListSessionsRequest(),
                                          timeout=min(2.0, self.connection.timeout)).sessions
        except LimberError as error:
            return LimberError("TIMEOUT", f"session {self.id}: {what}; what it does is unknown: {error.message}", field)
        status = next((s for s in listed if s.session == self.id), None)
        doing = _doing(status) if status else "the server has no such session"
        return LimberError("TIMEOUT", f"session {self.id}: {what}; {doing}", field)

    def raw_frames(self, first: int = 0, count: int = 0, encoding: str = "coordinates",
                   final: bool = False) -> "service.Frames":
        """Frames as the server sends them. Those of a large motion come in parts, all of one result, and are put together.
        Quantised ones, whose parts would have boxes of their own, are one answer, whose bytes come in parts."""
        if encoding == "quantised":
            return self._call_for_frames(self._frames_request(first, count, encoding, final)).frames
        return frame_parts.joined(self._frame_parts(first, count, encoding, final))

    def _frames_request(self, first: int, count: int, encoding: str, final: bool) -> "service.GetFramesRequest":
        return service.GetFramesRequest(
            session=self.reference, first_frame=checks.whole(first, "first_frame"),
            frame_count=checks.whole(count, "frame_count"), final_only=checks.flag(final, "final"),
            encoding=ENCODINGS[checks.one_of(encoding, ENCODINGS, "encoding")])

    def _call_for_frames(self, request: "service.GetFramesRequest") -> "service.GetFramesResponse":
        return self.connection.call("get_frames", request, timeout=max(60.0, self.connection.timeout))

    def _frame_parts(self, first: int, count: int, encoding: str, final: bool) -> "list[service.Frames]":
        return frame_parts.fetch(self._call_for_frames, self._frames_request(first, count, encoding, final))

    def frames(self, first: int = 0, count: int = 0, encoding: str | None = None, final: bool = False) -> np.ndarray:
        """Positions, frames x nodes x 3 [length unit], float32 or, far from the origin, float64, of the newest result.

        count 0: to the last frame; final: of the newest final result. `encoding`: None requests coordinates, the smallest, and
        makes positions of them; with "positions" and "quantised" (16 bit) the server sends positions. "coordinates" returns the
        coordinates themselves, frames x coordinates float32, of which geometry().positions() makes positions.
        """
        if encoding == "coordinates":
            return np.array(arrays.to_numpy(self.raw_frames(first, count, encoding, final).data, "frames"))
        parts = self._frame_parts(first, count, "coordinates" if encoding is None else encoding, final)
        positions = [decode(part, self.geometry_for(part)) for part in parts]
        return positions[0] if len(positions) == 1 else np.concatenate(positions)

    def stream(self, encoding: str = "coordinates", timeout: float | None = None, snapshot: bool = True) -> FrameStream:
        """Iterator over results as they are published, the newest first result at once (unless snapshot=False)."""
        return FrameStream(self, encoding, timeout, snapshot)

    def follow(self, timeout: float | None = None) -> MotionStream:
        """Keeps the motion of the session up to date by its changes, and iterates over them. For long motions, of which most
        frames stay unchanged after an edit. Frames named by look_at() and frames near the edit come first."""
        return MotionStream(self, timeout)

    # ---- files ----

    FORMATS: dict[str, int] = {}                # formats of export(), by name
    DEFAULT_FORMATS: tuple[str, ...] = ()

    def export(self, folder: "str | os.PathLike[str]", formats: Sequence[str] | None = None, stem: str = "",
               progress: ProgressOption = None, timeout: float = 120.0) -> Export:
        """Writes files into a folder.

        formats: of a body "pvd" (a .vtu per frame, one .pvd), "blender" (an .obj of the surface, a .pc2 of its vertices),
        together the default, "pc2" (of all nodes, for base motions). For a linkage "vtp" (a .vtp per step with forces and
        stresses, one .pvd), "obj" (centrelines and swept surface), "json" (joints, segments and their forces), by default vtp and
        json. For a structure of beams "vtu" (lines with reactions, forces, stresses), "csv" (a table of nodes, one of elements),
        by default both, "json". For all "scene", the scene as edited. `stem`: of their names; empty: "motion", of a structure of
        beams "beams".
        """
        if formats is None:
            formats = self.DEFAULT_FORMATS
        if isinstance(formats, str):
            formats = (formats,)
        formats = [checks.one_of(name, self.FORMATS, "formats") for name in checks.several(formats, "formats")]
        checks.text(stem, "stem")
        target = checks.path(folder, "folder")
        checks.duration(timeout, "timeout")
        with Reporter(progress) as report:
            return exports.export(self, formats, target, stem, timeout, report)

    def moving_surface(self, drawn: "tuple[np.ndarray, np.ndarray] | None" = None) -> MovingSurface:
        """Surface of the newest result for drawing, in all frames; drawn: vertices and triangles that follow a body instead."""
        raise LimberError("UNSUPPORTED", "sessions of this kind have no surface that this client knows", "session")

    def carried_obj(self) -> "ObjSurface | None":
        """The surface that a body carries, as its .obj says; None: there is none."""
        return None

    COLOURS: tuple[str, ...] = ("none",)  # colours of picture()

    def coloured(self, colour: str, frame: int, yield_stress: float | None) -> Coloured:
        """Surface of the newest result in a frame for drawing, with numbers to be shown as colours."""
        surface = self.moving_surface()
        return Coloured(surface.faces, surface.positions[frame], np.zeros(0), "")

    def picture(self, path: "str | os.PathLike[str]", *, colour: str = "none", frame: int = -1,
                view: Sequence[float] = (-60.0, 25.0), up: str | None = None, size: Sequence[float] = (8.0, 6.0), title: str = "",
                limits: "Sequence[float] | None" = None, yield_stress: float | None = None) -> Path:
        """Draws the newest result into a .png, .svg or .pdf; needs python3-matplotlib, and no display.

        colour: "none", "displacement" (of bodies and beams), "strain" (of bodies, the largest), "stress" (von Mises; of bodies
        with the material of each tet), "utilisation" (of beams and linkages; of these yield_stress [Pa] is needed). `frame`: -1
        is the last one. `view`: azimuth and elevation of the eye, which is far away [degree]. `up`: "z" or "y" of the scene, by
        default `UP`, y of bodies and z of linkages and beams, as on the page. `size`: inches; limits: of the colours' scale, if
        pictures are to be compared.
        """
        return pictures.draw(self, path, colour=colour, frame=frame, view=view, up=self._up(up), size=size, title=title, limits=limits,
                             yield_stress=yield_stress)

    def _up(self, given: "str | None") -> str:
        return self.UP if given is None else given

    def moving_points(self) -> MovingPoints:
        """Nodes or joints of the newest result, in all frames."""
        raise LimberError("UNSUPPORTED", "sessions of this kind have no points that this client knows", "session")

    def save(self, path: "str | os.PathLike[str]", *, tolerance: float = saving.TOLERANCE, up: str | None = None,
             frames_per_second: float | None = None, nodes: "Iterable[int] | None" = None,
             surface: "str | os.PathLike[str] | None" = None) -> Saved:
        """Writes the motion of the newest result as one file that other programs play, made by this client.

        By the ending of path:

        - ".glb": glTF with morph targets and a weight of each in each frame, as many targets as needed for errors up to
          `tolerance` times the size of the drawing (Saved.error is the error), never more than frames; with normals of the moved
          surface, of which edges beyond 45 degrees stay sharp, and the names of scene and session; in metres, with `up` of the
          scene ("y" or "z"; by default `UP`, y of bodies and z of linkages and beams, as on the page) turned to glTF's y
        - ".mdd", ".pc2": caches of all vertices, with an .obj: STEM_surface.obj, or STEM_detail.obj of an artist's surface. Files
          there that save() did not write are never replaced: it refuses (FAILED_PRECONDITION)
        - ".pvd": a .vtu of the surface for each frame
        - ".csv": a row for each node (of a linkage, joint) and frame, or for `nodes` alone

        Frames of linkages and beams are the equilibria along the path, 24 a second unless frames_per_second says otherwise;
        those of bodies are at the rate of the scene.

        surface: of a body, the surface that follows its tets. By default it is the surface that its scene carries, with the
        artist's vertices in their order, texture coordinates and materials (of the .mtl files in the same folder). Otherwise it
        is the boundary of its tets, which is "nodes". Alternatively another .obj that was drawn around the tets; its materials
        count if they are in files in the same folder.
        """
        return saving.save(self, path, tolerance=tolerance, up=self._up(up), frames_per_second=frames_per_second, nodes=nodes,
                           surface=surface)

    def played(self, tolerance: float, drawn: "tuple[np.ndarray, np.ndarray] | None" = None) -> Played:
        """The newest result as the player of save_html() takes it; drawn: as of moving_surface()."""
        raise LimberError("UNSUPPORTED", "sessions of this kind have no picture that the player knows", "session")

    def save_html(self, path: "str | os.PathLike[str]", *, tolerance: float = saving.TOLERANCE, up: str | None = None,
                  frames_per_second: float | None = None, surface: "str | os.PathLike[str] | None" = None) -> Saved:
        """Writes the motion of the newest result as one .html that plays it in any browser with WebGL 2. It needs no server and
        no network: play, scrub, turn, come nearer.

        tolerance: of bodies, the allowed error of a vertex, as a share of the size; Saved.error is the actual one (of linkages
        and beams: a number of a frame, by its rounding to 16 bits). `up`: "y" or "z" of the scene; by default y of bodies and z
        of the others. `frames_per_second`, `surface`: as in save(); if a scene carries a surface, that one is shown.
        """
        return player.save(self, path, tolerance=tolerance, up=up, frames_per_second=frames_per_second, surface=surface)

    def render(self, path: "str | os.PathLike[str]", *, frame: int = -1, size: Sequence[int] = (1280, 720),
               view: "Sequence[float] | None" = None, up: str | None = None, frames_per_second: float | None = None,
               tolerance: float = saving.TOLERANCE, surface: "str | os.PathLike[str] | None" = None,
               progress: ProgressOption = None) -> Path:
        """Draws the newest result as the page does, without a display: a .png or .jpg of a frame, a .mp4, .webm or .gif of all.

        Needs Chromium, and for films ffmpeg. `size`: width and height [pixel]. `view`: azimuth and elevation of the eye [degree],
        by default as the page looks. `frame`: of a picture, -1 is the last one; other options as in save_html(). A .gif has at
        most 25 frames a second, others left out.
        """
        return rendering.render(self, path, frame=frame, size=size, view=view, up=up, frames_per_second=frames_per_second,
                                tolerance=tolerance, surface=surface, progress=progress)

    def show(self, *, height: int = 600, browser: bool | None = None) -> SessionPage:
        """The page on which this session is seen and edited: opened in a browser, or embedded by a notebook whose cell ends with
        this call.

        height: of the frame in a notebook [pixel]; browser: whether to open a browser (by default, unless in a
        notebook). The server must serve pages: limber.launch(web=True), `limber web`, `limberd --web`; and, for it to be embedded, name
        the notebook's origin (`limberd --web-frame-ancestor`, launch(embed_in=...)). SessionPage.url has the address with the token.
        """
        return browsing.show(self, height, browser)

    # ---- control ----

    def cancel(self) -> None:
        """Stops a running build or solve; the session keeps its newest result."""
        self.connection.call("cancel", service.CancelRequest(session=self.reference))

    def wait_ready(self, progress: ProgressOption = None, timeout: float = 600.0) -> "service.SessionStatus":
        """Waits until the model is built and the scene as opened is solved. Raises the error of the build's failure, and warns
        (AccuracyWarning) of a model that misses its tolerance.
        """
        status = self._wait_ready(progress, timeout)
        self.warn_of_accuracy(status, stacklevel=2)
        return status

    def _wait_ready(self, progress: ProgressOption, timeout: float) -> "service.SessionStatus":
        deadline = time.monotonic() + checks.seconds(timeout, "timeout")
        if self.job:
            try:
                self.server.wait_job(self.job, progress, timeout)
            except LimberError as error:
                if error.code == "TIMEOUT" and not isinstance(error, ServerUnreachable):
                    raise self.late(f"it is not built within {timeout:g} s") from None
                if not _ended_with_its_run(error):
                    raise
                self._wait_for_next_run(error, deadline)
        status = self.status()
        if status.state == service.SESSION_STATE_FAILED:
            raise LimberError("FAILED_PRECONDITION", f"session {self.id} failed: {status.message}")
        self.revision = max(self.revision, status.revision)
        return status

    def _wait_for_next_run(self, end: LimberError, deadline: float) -> None:
        """Its job ended with the run of limberd; the next one brings the session back, where it is stored, and builds it.

        end: how the job ended.
        """
        while True:
            left = deadline - time.monotonic()
            try:
                self.wait(revision=0, timeout=max(0.1, left))
                break
            except ServerUnreachable:
                if end.code != "SHUTTING_DOWN":
                    raise
                if left <= 0:
                    raise ServerStopped(f"limberd was stopped while session {self.id} was built, and no other run of it answers; "
                                        "the session is stored, and built when one is asked for it") from None
        self.job = 0

    def close(self) -> None:
        """Ends the session on the server, for every client."""
        self.connection.call("close_session", service.CloseSessionRequest(session=self.reference), timeout=60.0)

    def __repr__(self) -> str:
        return f"Session({self.id!r} at {self.connection.endpoint})"


def _ended_with_its_run(error: LimberError) -> bool:
    """For a job that was waited for; another run may have its session."""
    if error.code == "SHUTTING_DOWN":
        return error.details.get("send_again") == "true"
    return error.code == "RESTARTED" or error.code == "NOT_FOUND" and error.field == "job"


def _doing(status: "service.SessionStatus") -> str:
    """Description of a session that is waited for: its revision, state and newest result."""
    state = service.SessionState.Name(status.state).removeprefix("SESSION_STATE_").lower() \
        if status.state in service.SessionState.values() else str(status.state)
    newest = "it has no result yet"
    if status.HasField("result"):
        kind = "final" if status.result.converged else "not final"
        newest = f"its newest result is of revision {status.result.revision}, {kind}"
    doing = f" ({status.message})" if status.message else ""
    return f"it is at revision {status.revision}, {state}{doing}; {newest}"


def warn_of_snaps(where: str, snaps: "Sequence[str]", stacklevel: int) -> None:
    """stacklevel: as in warnings.warn, counted from the caller."""
    most = 3
    more = f"; {len(snaps) - most} more" if len(snaps) > most else ""
    warnings.warn(f"{where}: the structure snapped to another shape {'; '.join(snaps[:most])}{more}", SnapWarning,
                  stacklevel=stacklevel + 1)


def job_error(status: "service.JobStatus") -> "common.Error":
    """Why a job ended without success."""
    if status.HasField("error"):
        return status.error
    code = common.ERROR_CODE_CANCELLED if status.state == service.JOB_STATE_CANCELLED else common.ERROR_CODE_INTERNAL
    return common.Error(code=code, message=f"job {status.job} ({status.kind}) was cancelled or failed")


def warn_of_material(issues: "Iterable[service.Issue]") -> None:
    """Warns of a material that a mesh file overrides, at the line that called the public method that calls this."""
    for issue in issues:
        if issue.field == "scene.material":
            warnings.warn(issue.message, MaterialWarning, stacklevel=3)
