"""A limberd somewhere: sessions, samples, jobs."""

from __future__ import annotations

import os
import time
from collections import OrderedDict
from typing import Any, TypeVar

from . import checks, kind, scenes, version
from .connection import Connection, reachable
from .errors import LimberError, from_message, invalid
from .messages import scene as scene_messages
from .messages import service
from .open_session import OpenSession, job_error, warn_of_material
from .progress import ProgressOption, Reporter
from .results import issue_text

_Server = TypeVar("_Server", bound="ServerCore")


class ServerCore:
    """A server as sessions of all kinds and the requests of single kinds use it; kinds.py joins these to it."""

    def __init__(self, connection: Connection, greeting_timeout: float | None = None):
        """greeting_timeout: how long the server may take for its first answer [s]; default that of the connection."""
        self.connection = connection
        # By basis hash: (session that used it last, geometry). Small: a basis takes 12 nodes h bytes.
        self.geometry_cache: "OrderedDict[Any, tuple[str, Any]]" = _Bounded(8)
        info = _greet(connection, greeting_timeout)
        self.stream_endpoint = reachable(info.stream_endpoint, connection.endpoint)
        # If streams are followed against credit: the endpoint of requests, through a tunnel or a recorder, too. Empty: this
        # server has only the stream socket.
        self.follow_endpoint = connection.endpoint if info.follow_endpoint else ""

    def __enter__(self: _Server) -> _Server:
        return self

    def __exit__(self, *exc) -> None:
        self.close()

    def close(self) -> None:
        """Closes the connection. Sessions remain open."""
        self.connection.close()

    def info(self, *, status: bool = False) -> "service.GetServerInfoResponse":
        """Version, limits, counters; with status=True also how the server and each of its sessions do (`.status`)."""
        return self.connection.call("get_server_info", service.GetServerInfoRequest(with_status=status))

    # ---- scenes and sessions ----

    def samples(self) -> list[str]:
        """Names of the sample scenes."""
        return list(self.connection.call("get_sample", service.GetSampleRequest()).names)

    def sample(self, name: str) -> "scene_messages.Scene":
        """A sample scene, to change and open."""
        if not checks.text(name, "name"):
            raise invalid("name", "a sample has a name")
        return self.connection.call("get_sample", service.GetSampleRequest(name=name), timeout=60.0).scene

    def validate(self, scene: scenes.SceneLike) -> list[str]:
        """Everything that is wrong with a scene, errors and warnings, each with its field; empty: nothing."""
        request = service.ValidateSceneRequest(scene=scenes.to_message(scene))
        return [issue_text(issue) for issue in self.connection.call("validate_scene", request, timeout=60.0).issues]

    def open(self, scene: "scenes.SceneLike | None" = None, *, sample: str | None = None, session: str = "",
             optimise: str | None = None, wait: bool = True, progress: ProgressOption = None, timeout: float = 600.0,
             tets: int | None = None, within: float | None = None, stiffness: Any = None) -> Any:
        """Opens a scene (file name, mapping, message) or a sample as a session: a Session of an elastic body, a LinkageSession of
        a rod linkage, or a BeamSession of a structure of beams. For beams it may also be a job of the public relaxation code, its
        folder or SimulationJob.json; see limber.beam_scene for structures. A mesh of tets (.msh, .vtk, ...), a closed surface
        (.obj, .ply, .stl, .off, .glb) or lines of a linkage (.obj) open with defaults; session.issues says which.

        session: a name for it (default: the server chooses). `optimise`: "motion", "dynamics" or "all" in place of the scene's
        value (see Session.optimise; modes are mixed of as many as the model gets now). `wait`: until the model is built and the
        scene solved. `progress`: a callback (stage, fraction), True / False, or None for a bar on terminals. Ctrl-C while waiting
        closes the session. tets, within: of a surface, as tetrahedralize() takes them. stiffness: of a body, as
        limber.painted_stiffness() takes or returns it. Warns of a model that misses its tolerance (limber.AccuracyWarning) and of
        a material that the mesh file overrides (limber.MaterialWarning).
        """
        if (scene is None) == (sample is None):
            raise invalid("scene", "give either a scene or sample=")
        checks.flag(wait, "wait")
        checks.seconds(timeout, "timeout")
        file = checks.path(scene, "scene") if isinstance(scene, (str, os.PathLike)) else None
        opener = kind.opener_of(file) if file is not None else None
        filling = {name: value for name, value in (("tets", tets), ("within", within)) if value is not None}
        for name in filling:
            if opener is None or not opener.fills(file):
                raise invalid(name, f"{name}= is for a closed surface (.obj, .ply, .stl, .off, .glb) that is to be filled")
        if sample is not None:
            message = self.sample(sample)
        elif opener is not None:
            message = opener.scene_of_file(self, file, progress, timeout, **filling)
        else:
            message = scenes.to_message(scene)
        if optimise is not None or stiffness is not None:
            asked, message = message, scene_messages.Scene()
            message.CopyFrom(asked)
        if optimise is not None:
            kind.of(message).set_variables(message, optimise)
        if stiffness is not None:
            kind.of(message).paint(message, stiffness)
        request = service.OpenSessionRequest(scene=message, session=checks.text(session, "session"))
        response = self.connection.call("open_session", request, timeout=max(60.0, self.connection.timeout))
        warn_of_material(response.issues)
        opened = kind.session_class(response.kind)(
            self, response.session, response.job, [issue_text(issue) for issue in response.issues], response.uid,
            self.connection.instance)
        opened.join()
        if opener is not None:
            known = self.connection.call("get_session", service.GetSessionRequest(session=opened.reference, with_scene=True))
            opened.issues += (f"note: {scene} is opened as {opener.describe_defaults(known.scene)}",)
        if wait:
            try:
                status = opened._wait_ready(progress, timeout)
            except KeyboardInterrupt:
                opened.close()
                raise
            opened.warn_of_accuracy(status, stacklevel=2)
        return opened

    def session(self, id: str) -> Any:
        """Attaches to a session of any client: a Session, LinkageSession or BeamSession, or the class given to register_kind().
        id: its name, or `name@uid` (OpenSession.reference), which never is another session of that name. From then on others see
        this client in it (OpenSession.clients())."""
        status = OpenSession(self, checks.text(id, "session")).status()
        attached = kind.session_class(status.kind)(self, status.session or id, uid=status.uid, instance=self.connection.instance)
        attached.revision = status.revision
        attached.join()
        attached.warn_of_accuracy(status, stacklevel=2)
        return attached

    def sessions(self) -> "list[service.SessionStatus]":
        """Every session of the server."""
        return list(self.connection.call("list_sessions", service.ListSessionsRequest()).sessions)

    def save_session(self, session: str, path: "str | os.PathLike[str]") -> None:
        """Writes a stored session with its edits and its answer into one file (of a server with --data)."""
        request = service.SaveSessionRequest(session=checks.text(session, "session"))
        content = self.connection.call("save_session", request, timeout=60.0).content
        checks.path(path, "path").write_bytes(content)

    def restore_session(self, path: "str | os.PathLike[str]", session: str = "") -> Any:
        """The session of such a file, under the name that it had unless another one is given."""
        request = service.RestoreSessionRequest(content=checks.path(path, "path").read_bytes(),
                                                session=checks.text(session, "session"))
        return self.session(self.connection.call("restore_session", request, timeout=60.0).session)

    # ---- jobs ----

    def jobs(self) -> "list[service.JobStatus]":
        return list(self.connection.call("list_jobs", service.ListJobsRequest()).jobs)

    def wait_job(self, job: int, progress: ProgressOption = None, timeout: float = 600.0) -> "service.GetJobResponse":
        """Waits for a job's end; raises the error it failed with."""
        checks.whole(job, "job", most=2 ** 64 - 1)
        deadline = time.monotonic() + checks.seconds(timeout, "timeout")
        with Reporter(progress) as report:
            while True:
                request = service.GetJobRequest(job=job, wait_s=0.2)
                response = self.connection.call("get_job", request)
                status = response.status
                if status.state == service.JOB_STATE_DONE:
                    report(status.progress.stage or status.kind, 1.0)
                    return response
                if status.state in (service.JOB_STATE_FAILED, service.JOB_STATE_CANCELLED):
                    raise from_message(job_error(status))
                report(status.progress.stage or status.kind, status.progress.fraction)
                if time.monotonic() > deadline:
                    raise LimberError("TIMEOUT", f"job {job} ({status.kind}) still runs after {timeout:g} s")

    def _wait_or_cancel(self, job: int, progress: ProgressOption, timeout: float) -> "service.GetJobResponse":
        """Cancels a job whose answer is for this caller alone: no other client could request it. A job that has ended is left as
        it is."""
        try:
            return self.wait_job(job, progress, timeout)
        except (KeyboardInterrupt, LimberError):
            self.cancel_job(job)
            raise

    def cancel_job(self, job: int) -> None:
        self.connection.call("cancel", service.CancelRequest(job=checks.whole(job, "job", most=2 ** 64 - 1)))

    def shutdown(self) -> None:
        """Asks limberd to end; UNSUPPORTED unless it was started by `limber start` or with --allow-shutdown."""
        self.connection.call("shutdown", service.ShutdownRequest())


def _greet(connection: Connection, timeout: float | None) -> "service.GetServerInfoResponse":
    """Checks that a server answers and that it speaks our protocol."""
    try:
        request = service.GetServerInfoRequest(client_version=version.PACKAGE)
        info = connection.call("get_server_info", request, timeout=timeout)
    except LimberError as error:
        if not version.knows_no_client_version(error):
            raise
        info = connection.call("get_server_info", service.GetServerInfoRequest(), timeout=timeout)
    if version.PROTOCOL not in info.protocol_versions:
        raise version.other_protocol(info.server_version, info.protocol_versions)
    return info


class _Bounded(OrderedDict):
    """A mapping that drops its oldest entries first."""

    def __init__(self, size: int):
        super().__init__()
        self._size = size

    def __setitem__(self, key: Any, value: Any) -> None:
        super().__setitem__(key, value)
        self.move_to_end(key)
        while len(self) > self._size:
            self.popitem(last=False)
