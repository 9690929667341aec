"""A session whose constraints follow wishes, in a thread of its own: callers do not wait for the server."""

from __future__ import annotations

import pathlib
import tempfile
import threading
from dataclasses import dataclass, field

import limber
import numpy as np
from limber import arrays

PATIENCE = 600.0  # for fills, models and solves [s]


@dataclass(frozen=True)
class Wish:
    """A handle in a frame: the name of the handle, a frame of the motion, the node, where that node is to be."""

    handle: str
    frame: int
    node: int
    position: "tuple[float, float, float]"
    exact: bool = False
    until: "int | None" = None  # a hold: in every frame from `frame` to this one


@dataclass(frozen=True)
class Manner:
    """How the whole motion is."""

    calm: float = 0.8   # from 0, lively, to 1
    loop: bool = False  # its last frame leads into the first


@dataclass
class Body:
    """A surface and its material; lengths in Blender units."""

    name: str
    vertices: np.ndarray    # n x 3, in the world
    triangles: np.ndarray   # m x 3
    frames: int
    rate: float             # frames a second
    metres: float = 1.0     # one Blender unit
    fixed: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))  # vertices
    tets: int = 3000
    youngs_modulus: float = 1e5
    stiffness: "np.ndarray | None" = None  # of each vertex, that the modulus there is multiplied by
    density: float = 1000.0
    period: float = 0.0     # seconds of the slowest swing; 0: as the material has it
    manner: Manner = Manner()
    modes: int = 20
    tolerance: float = 0.05


@dataclass(frozen=True)
class Picture:
    """A motion of the surface: vertices = rest + basis . coordinates of a frame."""

    rest: np.ndarray         # n x 3
    basis: np.ndarray        # n x 3 x h
    coordinates: np.ndarray  # frames x h
    number: int              # counts pictures
    final: bool
    wishes: int              # the number of wish() that it answers

    def shape(self, frame: float) -> np.ndarray:
        """n x 3, between two frames where the frame is no whole number."""
        low = int(np.floor(frame))
        high = min(low + 1, len(self.coordinates) - 1)
        share = frame - low
        mixed = (1 - share) * self.coordinates[low] + share * self.coordinates[high]
        return self.rest + self.basis @ mixed.astype(self.basis.dtype)

    def shapes(self) -> np.ndarray:
        """frames x n x 3"""
        flat = self.coordinates @ self.basis.reshape(-1, self.basis.shape[2]).T
        return flat.reshape(len(self.coordinates), -1, 3) + self.rest


def ends_of(manner: Manner) -> "dict[str, str]":
    ends = "cyclic" if manner.loop else "position_velocity"
    return {"first_end": ends, "last_end": ends}


def find_server(endpoint: str = "", binary: str = "") -> "limber.Server":
    """The one at an endpoint; without one, one that answers at the default endpoint, else a new one of our own."""
    if endpoint:
        return limber.connect(endpoint)
    try:
        return limber.connect()
    except limber.ServerUnreachable:
        return limber.launch(binary or None)


class Live:
    """Opens a session of a body; wish() sets its target constraints, picture() returns the result."""

    def __init__(self, body: Body, endpoint: str = "", binary: str = ""):
        self.body = body
        self.surface_nodes = np.zeros(0, dtype=int)  # known once ready
        self.nodes = np.zeros((0, 3))                # rest positions, known once ready
        self._endpoint, self._binary = endpoint, binary
        self._lock = threading.Condition()
        self._wishes: "tuple[Wish, ...]" = ()
        self._manner = self._sent_manner = body.manner
        self._asked = 0       # wish() calls
        self._picture: "Picture | None" = None
        self._state, self._error, self._stopped = "connecting", "", False
        self._session: "limber.Session | None" = None
        self._surface_basis: "dict[str, np.ndarray]" = {}
        self._thread = threading.Thread(target=self._run, daemon=True, name="limber")
        self._thread.start()

    # ---- called from Blender's thread; none of these waits ----

    @property
    def state(self) -> str:
        """"connecting", "filling", "building", "ready", "solving", "failed" or "closed"."""
        return self._state

    @property
    def error(self) -> str:
        """Message of a failure, or of the newest refused wish."""
        return self._error

    @property
    def picture(self) -> "Picture | None":
        """The newest."""
        return self._picture

    def wish(self, wishes: "list[Wish]", manner: "Manner | None" = None) -> int:
        """All target constraints from now on, and the manner of the motion. Returns a number that pictures refer to."""
        with self._lock:
            self._wishes = tuple(wishes)
            self._manner = self._manner if manner is None else manner
            self._asked += 1
            self._lock.notify()
            return self._asked

    def stop(self, wait: bool = False) -> None:
        """Closes the session, and the server if it is our own."""
        with self._lock:
            self._stopped = True
            self._lock.notify()
        if wait:
            self._thread.join(30)

    def settled(self, number: int) -> bool:
        """Has this wish its final picture, or has the session failed?"""
        picture = self._picture
        return self._state in ("failed", "closed") or bool(picture and picture.final and picture.wishes >= number)

    # ---- the thread ----

    def _run(self) -> None:
        server = None
        try:
            server = find_server(self._endpoint, self._binary)
            self._open(server)
            self._follow()
            self._state = "closed"
        except (limber.LimberError, ImportError, OSError, ValueError) as error:
            self._error, self._state = str(error), "failed"
        finally:
            try:
                if self._session is not None:
                    self._session.close()
            except limber.LimberError:
                pass  # removed already
            if server is not None:
                server.close()

    def _open(self, server: "limber.Server") -> None:
        body = self.body
        self._state = "filling"
        with tempfile.TemporaryDirectory(prefix="limber-") as folder:
            path = pathlib.Path(folder) / "surface.obj"
            lines = ["v {:.9g} {:.9g} {:.9g}".format(*vertex) for vertex in body.vertices.tolist()]
            lines += ["f {} {} {}".format(*corners) for corners in (body.triangles + 1).tolist()]
            path.write_text("\n".join(lines) + "\n")
            filled = server.tetrahedralize(path, tets=body.tets, within=1.0, progress=False, timeout=PATIENCE)
            nodes = np.asarray(filled.nodes, dtype=float)
            fixed = sorted({int(np.linalg.norm(nodes - body.vertices[vertex], axis=1).argmin()) for vertex in body.fixed})
            options = {"period_frames": body.period * body.rate} if body.period > 0 else {}
            scene = limber.scene_from_arrays(
                nodes, filled.tets, name=body.name, frames=body.frames, fixed_nodes=fixed, frames_per_second=body.rate,
                length_unit_in_metres=body.metres, youngs_modulus=body.youngs_modulus, density=body.density,
                modes=body.modes, tolerance=body.tolerance, surface=path, stiffness=body.stiffness,
                **limber.liveliness(body.manner.calm), **ends_of(body.manner), **options)
        self._state = "building"
        self._session = server.open(scene, progress=False, timeout=PATIENCE)
        self.nodes, self.surface_nodes = nodes, np.unique(self._session.geometry().surface)
        self._surface = self._session.carried_surface()
        self._sent: "dict[tuple[str, int], tuple[Wish, int]]" = {}  # wishes that are constraints, and their ids
        self._state = "ready"
        self._show(0, final=True)

    def _follow(self) -> None:
        done = 0
        while True:
            with self._lock:
                self._lock.wait_for(lambda: self._stopped or self._asked > done)
                if self._stopped:
                    return
                wishes, manner, number = self._wishes, self._manner, self._asked
            self._state = "solving"
            try:
                if self._send(wishes, manner):
                    self._session.wait(until="first", timeout=PATIENCE)
                    self._show(number, final=False)
                    self._settle(number)
                else:
                    self._show(number, final=True)
                self._error = ""
            except limber.ServerUnreachable:
                raise
            except limber.LimberError as error:
                self._error = str(error)
                self._show(number, final=True)
            done = number
            self._state = "ready"

    def _settle(self, number: int) -> None:
        """Up to the final result, unless another wish comes first."""
        while True:
            with self._lock:
                if self._stopped or self._asked > number:
                    return
            try:
                result = self._session.wait(until="final", timeout=0.05)
            except limber.LimberError as error:
                if error.code != "TIMEOUT" or isinstance(error, limber.ServerUnreachable):
                    raise
                continue
            if result.solve_failed:
                self._error = result.message
            self._show(number, final=True)
            return

    def _send(self, wishes: "tuple[Wish, ...]", manner: Manner) -> bool:
        """The edits between the constraints and the wishes, as one revision; False: there are none."""
        requested = {(wish.handle, wish.frame): wish for wish in wishes}
        edits, changes = [], []
        for key, (wish, id) in list(self._sent.items()):
            now = requested.get(key)
            if now is None or (now.node, now.exact, now.until) != (wish.node, wish.exact, wish.until):
                edits.append(limber.remove(id))
                changes.append((key, None))
            elif now.position != wish.position:
                edits.append(limber.move(id, now.position))
                changes.append((key, (now, id)))
        gone = {key for key, value in changes if value is None}
        for key, wish in requested.items():
            if key not in self._sent or key in gone:
                edits.append(limber.add(frame=wish.frame, node=wish.node, position=wish.position, exact=wish.exact,
                                        until=wish.until))
                changes.append((key, wish))
        if manner.calm != self._sent_manner.calm:
            edits.append(limber.dynamics(**limber.liveliness(manner.calm)))
        if manner.loop != self._sent_manner.loop:
            edits.append(limber.ends(*ends_of(manner).values()))
        if not edits:
            return False
        receipt = self._session.edit(edits)
        self._sent_manner = manner
        for (key, value), id in zip(changes, receipt.constraint_ids):
            if value is None:
                del self._sent[key]
            else:
                self._sent[key] = value if isinstance(value, tuple) else (value, id)
        return True

    def _show(self, number: int, final: bool) -> None:
        """Publishes the newest motion, the surface's own basis made once for each basis of the body."""
        frames = self._session.raw_frames()
        geometry = self._session.geometry_for(frames)  # bases grow while motions are edited
        coordinates = np.array(arrays.to_numpy(frames.data, "frames"))
        basis = self._surface_basis.get(geometry.basis_hash)
        if basis is None:
            basis = self._surface.basis(geometry.basis)
            self._surface_basis = {geometry.basis_hash: basis}
        number_of = self._picture.number + 1 if self._picture else 1
        self._picture = Picture(self.body.vertices, basis, coordinates, number_of, final, number)
