"""A limberd somewhere: sessions, samples, jobs."""

from __future__ import annotations

import os
import time
import warnings
from collections import OrderedDict
from contextlib import contextmanager
from typing import Any, Iterable, Iterator, Sequence
from urllib.parse import urlsplit

import numpy as np

from . import arrays, beams, checks, designs, edits, kinds, plain_files, recoveries, scenes, simulations
from .connection import VERSION, Connection, CurveKeys
from .errors import LimberError, ServerStopped, ServerUnreachable, from_message, invalid
from .messages import scene as scene_messages
from .messages import service
from .progress import ProgressOption, Reporter
from .reach import advice
from .results import Geometry, issue_text
from .linkages import LinkageSession, linkage_scene, put_section
from .open_session import MaterialWarning, OpenSession, job_error

DEFAULT_ENDPOINT = "tcp://127.0.0.1:7801"


class FilledSurface(tuple):
    """`nodes, tets = filled`; `filled.report` has the tets, distances [length unit], their share of the body's length,
    and the volumes."""

    report: "service.TetrahedralizationReport"

    def __new__(cls, nodes: np.ndarray, tets: np.ndarray, report: "service.TetrahedralizationReport"):
        filled = super().__new__(cls, (nodes, tets))
        filled.report = report
        return filled

    @property
    def nodes(self) -> np.ndarray:
        return self[0]

    @property
    def tets(self) -> np.ndarray:
        return self[1]


class Server:
    """A connection to a limberd. A context manager; leaving it keeps the sessions alive. Thread-safe."""

    def __init__(self, connection: Connection, greeting_timeout: float | None = None):
        """greeting_timeout: how long the server may take for its first answer [s]; default that of the connection."""
        self.connection = connection
        # By basis hash: (session that used it last, geometry). Small: a basis takes 12 nodes h bytes.
        self.geometry_cache: "OrderedDict[str, tuple[str, Geometry]]" = _Bounded(8)
        info = connection.call("get_server_info", service.GetServerInfoRequest(), timeout=greeting_timeout)
        if VERSION not in info.protocol_versions:
            spoken = ", ".join(map(str, info.protocol_versions))
            raise LimberError("UNSUPPORTED", f"limberd {info.server_version} speaks protocol {spoken}, this client "
                                             f"{VERSION}", "version")
        self.stream_endpoint = reachable(info.stream_endpoint, connection.endpoint)

    def __enter__(self) -> "Server":
        return self

    def __exit__(self, *exc) -> None:
        self.close()

    def close(self) -> None:
        """Closes the connection. Sessions go on."""
        self.connection.close()

    def info(self) -> "service.GetServerInfoResponse":
        """Version, limits, counters."""
        return self.connection.call("get_server_info", service.GetServerInfoRequest())

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
             tets: int | None = None, within: float | None = None) -> Any:
        """Opens a scene (file name, mapping, message) or a sample as a session: a Session of an elastic body, a
        LinkageSession of a rod linkage, or a BeamSession of a structure of beams (also: a job of the public relaxation
        code, its folder or SimulationJob.json; see limber.beam_scene for structures). A mesh of tets (.msh, .vtk, ...),
        a closed surface (.obj, .ply, .stl) or lines of a linkage (.obj) open with defaults; session.issues says which.

        session: a name for it (default: the server chooses); optimise: "motion", "dynamics" or "all" in place of what
        the scene says (see Session.optimise; modes are mixed of as many as the model gets now); wait: until the model is built and the scene solved.
        progress: a callback (stage, fraction), True / False, or None for a bar on terminals. Ctrl-C while waiting
        closes the session. tets, within: of a surface, as tetrahedralize() takes them. Warns of a model that misses its tolerance
        (limber.AccuracyWarning) and of a material that the mesh file overrides (limber.MaterialWarning).
        """
        if (scene is None) == (sample is None):
            raise invalid("scene", "give either a scene or sample=")
        checks.flag(wait, "wait")
        checks.seconds(timeout, "timeout")
        plain = isinstance(scene, (str, os.PathLike)) and plain_files.kind(checks.path(scene, "scene")) != ""
        filling = {name: value for name, value in (("tets", tets), ("within", within)) if value is not None}
        for name in filling:
            if not plain or plain_files.kind(checks.path(scene, "scene")) != "triangles":
                raise invalid(name, f"{name}= is for a closed surface (.obj, .ply, .stl) that is to be filled")
        if sample is not None:
            message = self.sample(sample)
        elif plain:
            message = plain_files.scene_of(self, checks.path(scene, "scene"), progress, timeout, **filling)
        else:
            message = scenes.to_message(scene)
        if optimise is not None:
            if message.HasField("linkage") or message.HasField("beams"):
                raise invalid("optimise", "linkages and beams have no material to optimise")
            asked, message = message, scene_messages.Scene()
            message.CopyFrom(asked)
            message.material_optimisation.variables = edits.optimise(optimise).set_material.variables
        request = service.OpenSessionRequest(scene=message, session=checks.text(session, "session"))
        response = self.connection.call("open_session", request, timeout=max(60.0, self.connection.timeout))
        _warn_of_material(response.issues)
        opened = kinds.session_class(response.kind)(
            self, response.session, response.job, [issue_text(issue) for issue in response.issues],
                      response.uid, self.connection.instance)
        if plain:
            known = self.connection.call("get_session", service.GetSessionRequest(session=opened.reference, with_scene=True))
            opened.issues += (f"note: {scene} is opened as {plain_files.assumed(known.scene)}",)
        if wait:
            try:
                status = opened._wait_ready(progress, timeout)
            except KeyboardInterrupt:
                opened.close()
                raise
            opened.warn_of_accuracy(status, stacklevel=2)
        return opened

    def session(self, id: str) -> Any:
        """Attaches to a session of any client: a Session, LinkageSession or BeamSession, or what register_kind() says. id: its name, or `name@uid`
        (OpenSession.reference), which never is another session of that name."""
        status = OpenSession(self, checks.text(id, "session")).status()
        attached = kinds.session_class(status.kind)(self, status.session or id, uid=status.uid, instance=self.connection.instance)
        attached.revision = status.revision
        attached.warn_of_accuracy(status, stacklevel=2)
        return attached

    def sessions(self) -> "list[service.SessionStatus]":
        """Every session of the server."""
        return list(self.connection.call("list_sessions", service.ListSessionsRequest()).sessions)

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

    def cancel_job(self, job: int) -> None:
        self.connection.call("cancel", service.CancelRequest(job=checks.whole(job, "job", most=2 ** 64 - 1)))

    def tetrahedralize(self, surface: "str | os.PathLike[str]", tets: int = 5000, progress: ProgressOption = None,
                       timeout: float = 600.0, within: float = 0.02) -> "FilledSurface":
        """Nodes (n x 3) and tets (m x 4) that fill a closed triangle surface (.obj, .ply, .stl), and as `.report` how
        near they are to it.

        within: largest distance between the surface and that of the tets, either way, as a share of the body's length
        (diagonal of its bounding box), in (0, 1]. Where `tets` do not keep it, a LimberError says how many would;
        1 allows any distance.
        """
        checks.seconds(timeout, "timeout")
        request = service.TetrahedralizeRequest(surface=scenes.mesh_file(checks.path(surface, "surface")),
                                                target_tets=checks.whole(tets, "tets"),
                                                within=checks.real(within, "within"))
        job = self.connection.call("tetrahedralize", request, timeout=60.0).job
        try:
            done = self.wait_job(job, progress, timeout)
        except KeyboardInterrupt:
            self.cancel_job(job)
            raise
        return FilledSurface(arrays.to_numpy(done.mesh.nodes, "nodes"), arrays.to_numpy(done.mesh.tets, "tets"),
                             done.tetrahedralization)

    def simulate(self, scene: scenes.SceneLike, simulation: "scene_messages.Simulation | None" = None,
                 progress: ProgressOption = None, timeout: float = 3600.0) -> simulations.Simulation:
        """The motion of the body without reduction (St. Venant-Kirchhoff material) under loads: positions (frames x
        nodes x 3) and a report.

        simulation: what limber.simulation() makes; default that of the scene. The motion has the scene's frames; its
        base motion is not looked at. Ctrl-C while waiting, and the end of `timeout` [s], cancel the job.
        """
        checks.seconds(timeout, "timeout")
        request = simulations.request(scene, simulation)
        response = self.connection.call("simulate", request, timeout=max(60.0, self.connection.timeout))
        _warn_of_material(response.issues)
        try:
            done = self.wait_job(response.job, progress, timeout)
        except (KeyboardInterrupt, LimberError):
            self.cancel_job(response.job)  # nobody could ask for its motion; a job that has ended is left as it is
            raise
        part_bytes = min(simulations.PART_BYTES, self.info().limits.message_bytes)
        return simulations.fetch(done, tuple(issue_text(issue) for issue in response.issues), part_bytes,
                                 lambda wanted: self.connection.call("get_frames", wanted, timeout=120.0))

    def recover(self, scene: scenes.SceneLike, *, variables: str = "all", modes: int | None = None,
                candidate_modes: int | None = None, recovered_frames: int = 0, driven_frames: int = 0,
                total_frames: int = 0, weight: float = 1.0, column_weight: float = 1e-8, start: str = "principal",
                progress: ProgressOption = None, timeout: float = 3600.0) -> recoveries.Recovery:
        """The material of the scene's base motion (frequencies, damping, mixed modes) from its first recovered_frames
        (default: the first half), and how the motion goes on with it where no force acts, up to total_frames (default:
        those of the base motion).

        variables: "motion" (forces alone), "dynamics" (and frequencies and damping) or "all" (and the modes, as
        mixtures of candidate_modes); modes, candidate_modes: in place of the scene's; driven_frames: in so many of the
        first, forces are known to act; weight: gamma, how closely poses are followed; column_weight: mu; start:
        "principal" (principal components of the motion) or "spectrum". Constraints are not looked at. Ctrl-C while
        waiting, and the end of `timeout` [s], cancel the job.
        """
        checks.seconds(timeout, "timeout")
        request = recoveries.request(scene, variables=variables, modes=modes, candidate_modes=candidate_modes,
                                     recovered_frames=recovered_frames, driven_frames=driven_frames,
                                     total_frames=total_frames, weight=weight, column_weight=column_weight, start=start)
        response = self.connection.call("recover", request, timeout=max(60.0, self.connection.timeout))
        _warn_of_material(response.issues)
        try:
            done = self.wait_job(response.job, progress, timeout)
        except (KeyboardInterrupt, LimberError):
            self.cancel_job(response.job)
            raise
        part_bytes = min(simulations.PART_BYTES, self.info().limits.message_bytes)
        positions = simulations.fetch_positions(response.job, done.recovery.frames, part_bytes,
                                                lambda wanted: self.connection.call("get_frames", wanted, timeout=120.0))
        return recoveries.made_of(done, positions, tuple(issue_text(issue) for issue in response.issues))

    def solve_beams(self, structure: beams.BeamsLike, *, method: str = "choose", tolerance: float | None = None,
                    files: Iterable[str] = (), stem: str = "", shapes: int = 0, follow: bool = False,
                    progress: ProgressOption = None, timeout: float = 3600.0) -> beams.BeamSolution:
        """The equilibrium of a structure of beams: shape, reactions, forces, stresses, energies, and how it ended. What
        is not in balance is an answer too: see its status.

        structure: a mapping or file (JSON form of limber.v1.BeamStructure, or a scene of one), a message, or a job of the
        public relaxation code (its folder, or SimulationJob.json). method: "choose", "newton", "relaxation",
        "relaxation_then_newton"; tolerance: largest force over forces present (1e-8, of relaxation 1e-6); files: of
        "vtu", "csv" and "json", which solution.write(folder) writes as STEM...; shapes: how many on the way are kept;
        follow: Newton's method stays on the branch of equilibria where temporary loads push, too (without them "choose"
        does); answer.snaps tells where it ends.
        Ctrl-C while waiting, and the end of `timeout` [s], cancel the job.
        """
        checks.seconds(timeout, "timeout")
        request = beams.request(structure, method=method, tolerance=tolerance, files=files, stem=stem, shapes=shapes,
                                follow=follow)
        response = self.connection.call("solve_beams", request, timeout=max(60.0, self.connection.timeout))
        try:
            return beams.made_of(self.wait_job(response.job, progress, timeout))
        except (KeyboardInterrupt, LimberError):
            self.cancel_job(response.job)
            raise

    def starting_grid(self, surface: Any, *, columns: int | None = None, rows: int | None = None,
                      flat_angle: float | None = None, margin: float | None = None,
                      translation: Sequence[float] | None = None, rotation: Sequence[float] | None = None,
                      scale: float | None = None, section: Any = None,
                      drive: float | None = None) -> designs.StartingGrid:
        """Two families of straight rods for a patch of surface without holes: they lie flat without stress, and their
        directions change from rod to rod so that the grid leaves its plane when it opens, to about the surface. For a
        design where there is only a surface: limber.linkage_scene(grid.vertices, grid.edges, section=..), then
        session.deploy(grid.mean_angle).

        surface, translation, rotation, scale: as LinkageSession.design(). columns, rows: joints of rods
        along the patch's longer sides and of those across (8); flat_angle: at which rods cross when it lies flat
        [degree] (25); margin: share of the patch that is left free at its rim (0.02). section: of the rods, as
        linkage_scene() takes it; grids whose rods would overlap are refused, and rods that are too stiff to leave the
        plane, or not stiff enough sideways. drive: how many times the surface's curvature the rods are drawn for, since
        they resist; None: as the section needs it, else 3.
        """
        request = designs.grid_request(surface, columns, rows, flat_angle, margin, translation, rotation, scale, drive)
        if section is not None:
            put_section(section, request.section)
        return designs.StartingGrid.from_message(self.connection.call("make_starting_grid", request, timeout=120.0))

    def open_grid(self, grid: "designs.StartingGrid", *, section: Any, session: str = "", edges_per_segment: int = 6,
                  progress: ProgressOption = None, timeout: float = 600.0, **options: Any) -> LinkageSession:
        """Opens a starting grid as a session: flat, deployed to the angle that it has on its surface, and pushed to the
        surface's side until it is there (RodLinkage.erection); held in its middle. section: that the grid was made with;
        edges_per_segment, options: of limber.linkage_scene().
        """
        if grid.push.size == 0:
            raise invalid("grid", "make the grid with section=, so that it is known what pushes it to its side")
        if options.get("stiff_axis", "d1") != "d1":
            raise invalid("stiff_axis", "grids leave their plane with rods that are stiffer sideways, which is d1")
        scene = linkage_scene(grid.vertices, grid.edges, section=section, edges_per_segment=edges_per_segment, **options)
        linkage = scene.linkage
        linkage.conditions.mean_angle_degrees = linkage.erection.mean_angle_degrees = grid.mean_angle
        middle = len(grid.vertices) // grid.columns // 2 * grid.columns + grid.columns // 2
        linkage.conditions.pins.add(joint=middle, held=scene_messages.HELD_MOTION)
        modulus = linkage.material.youngs_modulus if linkage.material.HasField("youngs_modulus") else 10e9
        unit = scene.length_unit_in_metres if scene.HasField("length_unit_in_metres") else 1.0
        for joint in np.flatnonzero(grid.push):
            linkage.erection.push.add(joint=int(joint)).force.z = modulus * unit ** 2 * grid.push[joint]
        opened = self.open(scene, session=session, progress=progress, timeout=timeout)
        with self._closing(opened):
            if opened.wait(timeout=timeout).solve_failed:
                raise LimberError("FAILED_PRECONDITION", "the grid does not open to the angle that it has on the "
                                  "surface: try fewer rods, another flat_angle or another section", "surface")
        return opened

    @staticmethod
    @contextmanager
    def _closing(opened: LinkageSession) -> "Iterator[None]":
        """No session is left behind of what is refused later."""
        try:
            yield
        except BaseException:
            opened.close()
            raise

    def design_surface(self, surface: Any, *, columns: int | None = None, rows: int | None = None, section: Any,
                       flat_angle: float | None = None, margin: float | None = None, scale: float | None = None,
                       session: str = "", edges_per_segment: int = 6, progress: ProgressOption = None,
                       timeout: float = 600.0, design: Any = None, **options: Any) -> "designs.Design":
        """A linkage for a patch of surface, from the surface alone: starting_grid(), open_grid(), and a design that begins
        with the surface put where the grid fits. Its `session` is the linkage. Warns where something will stand in the
        design's way (StartingGrid.remark), and where the linkage is unlikely large (its issues).

        surface, columns, rows, flat_angle, margin: as starting_grid(). section, edges_per_segment and options of
        limber.linkage_scene(): as there. Options of LinkageSession.design(), as max_iterations, go to the design; so do
        those of the dict `design`. The flat shape is held at flat_angle, and smallest_angle is half of that where it
        is not given.
        """
        linkage, wanted = designs.sorted_options(options, design, linkage_scene, LinkageSession.design)
        flat_angle = 25.0 if flat_angle is None else checks.real(flat_angle, "flat_angle")
        grid = self.starting_grid(surface, columns=columns, rows=rows, flat_angle=flat_angle, margin=margin,
                                  scale=scale, section=section)
        if grid.remark:
            warnings.warn(grid.remark, stacklevel=2)
        opened = self.open_grid(grid, section=section, session=session, edges_per_segment=edges_per_segment,
                                progress=progress, timeout=timeout, **linkage)
        for issue in opened.issues:
            warnings.warn(issue, stacklevel=2)
        with self._closing(opened):
            return opened.design(surface, scale=scale, fitted_points=grid.deployed, flat_angle=flat_angle,
                                 **{"smallest_angle": 0.5 * flat_angle, **wanted})

    def shutdown(self) -> None:
        """Asks limberd to end; UNSUPPORTED unless it was started by `limber start` or with --allow-shutdown."""
        self.connection.call("shutdown", service.ShutdownRequest())


def _warn_of_material(issues: "Iterable[service.Issue]") -> None:
    """Of a material that a mesh file overrides, at the line that called the public method that calls this."""
    for issue in issues:
        if issue.field == "scene.material":
            warnings.warn(issue.message, MaterialWarning, stacklevel=3)


class _Bounded(OrderedDict):
    """A mapping that forgets what was stored first."""

    def __init__(self, size: int):
        super().__init__()
        self._size = size

    def __setitem__(self, key: Any, value: Any) -> None:
        super().__setitem__(key, value)
        self.move_to_end(key)
        while len(self) > self._size:
            self.popitem(last=False)


def reachable(stream: str, requests: str) -> str:
    """The stream's endpoint as this client reaches it: a wildcard host is the host of the request endpoint."""
    bound, used = urlsplit(stream), urlsplit(requests)
    if bound.scheme == "tcp" and bound.hostname in ("0.0.0.0", "*", "::") and used.scheme == "tcp":
        return f"tcp://{used.netloc.rpartition(':')[0]}:{bound.netloc.rpartition(':')[2]}"
    return stream


def connect(endpoint: str | None = None, *, timeout: float = 10.0, connect_timeout: float = 2.0,
            server_key: "str | os.PathLike[str] | None" = None, key: "str | os.PathLike[str] | None" = None) -> Server:
    """Connects to a running limberd: endpoint, else $LIMBER_ENDPOINT, else tcp://127.0.0.1:7801.

    timeout [s] for answers, connect_timeout [s] to find out whether a server is there. Beyond loopback, CURVE keys as
    `limberd keygen` writes them: server_key is the server's public key or its file, key the file of this client's
    secret key, with its .pub beside it. Raises ServerUnreachable if nothing answers (or the keys are not accepted),
    LimberError UNSUPPORTED if the server speaks another protocol.
    """
    if (server_key is None) != (key is None):
        raise invalid("key", "server_key and key go together")
    for name, value in (("server_key", server_key), ("key", key)):
        if value is not None:
            checks.path(value, name)
    keys = CurveKeys.read(server_key, key) if server_key is not None and key is not None else None
    checks.duration(connect_timeout, "connect_timeout")
    connection = Connection(endpoint or os.environ.get("LIMBER_ENDPOINT") or DEFAULT_ENDPOINT, keys, timeout)
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
