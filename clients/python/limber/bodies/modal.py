"""The linear body behind a session: masses, stiffness, modes, made here from its mesh and materials."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import arrays, checks
from ..errors import LimberError, invalid
from ..messages import service
from . import tet_materials
from .tet_materials import TetMaterials

if TYPE_CHECKING:
    from .session import Session


@dataclass(frozen=True)
class ModalMotion:
    """The newest motion of a session in its modal coordinates, and the control forces that it takes. Coordinate 1 of the first
    elastic mode moves the farthest node by a body length; time is in frames. The six rigid motions of a free body come first."""

    coordinates: np.ndarray   # z, frames x r
    stiffness: np.ndarray     # (r,) lambda [1/frame^2]
    damping: np.ndarray       # (r,) d [1/frame]
    frequencies: np.ndarray   # (r,) of the modes in frames [Hz], at most half the frames per second
    # w, (frames - 2) x r, row i of frame i + 1. The equation of motion is z'' + d z' + lambda z = w with the frame as the unit of
    # time, in the scene's discretisation. Its published differences are z[i] + (lambda - d - 2) z[i + 1] + (1 + d) z[i + 2]. Rows
    # for the first and the last frame do not exist, since no equation determines them.
    forces: np.ndarray
    mixing: np.ndarray        # S, candidates x r: column k is the mixture of candidates that mode k is
    candidates: np.ndarray    # nodes x 3 x candidates [length unit]: displacements of coordinate 1 at rest, to first order
    # (candidates,) [Hz] of the scene's material, whatever its dynamics say; 0 of rigid motions.
    candidate_frequencies: np.ndarray
    force_energy: float       # as the result of these frames tells it
    revision: int             # of that result
    smoothing_frames: float = 0.0  # the scene's force_smoothing
    force_scale: float = 1.0       # factor of energies of forces: they do not depend on the frame rate
    # (r,) weight of the squares of each mode's forces: stiff modes have less
    force_shares: np.ndarray | float = 1.0

    @property
    def modes(self) -> np.ndarray:
        """nodes x 3 x r [length unit]: candidates times mixing."""
        return self.candidates @ self.mixing

    @property
    def energy(self) -> float:
        """Cost of the control forces: force_energy, computed here.

        Half the sum of squared forces and of force_smoothing's share of their differences, forces outside being 0. Sampled modes
        that are free at the first frame cost more: the cost to get there from rest.
        """
        changes = np.diff(np.pad(self.forces, ((1, 1), (0, 0))), axis=0)
        squares = (self.forces ** 2).sum(axis=0) + self.smoothing_frames ** 2 * (changes ** 2).sum(axis=0)
        return 0.5 * self.force_scale * float((self.force_shares * squares).sum())


@dataclass(frozen=True)
class Modal:
    """Degrees of freedom are x, y, z of each node in turn, 3n; SI units. Matrices are scipy.sparse.csr_matrix."""

    mass: Any                # M, 3n x 3n, consistent [kg]
    lumped_mass: np.ndarray  # (3n,) the same put to the nodes [kg]
    stiffness: Any           # K, 3n x 3n, of the rest shape [N/m]
    free: np.ndarray         # (3n,) bool: of nodes that are not fixed
    modes: np.ndarray        # W, 3n x r: W^T M W = 1 [1/sqrt(kg)], 0 at fixed nodes; elastic ones, the slowest first
    frequencies: np.ndarray  # (r,) [Hz]: K W = M W (2 pi f)^2
    # (r,) of the session's own modes, before anything is fitted, as their stiffness says [Hz]. Published differences swing a
    # little faster: at asin(pi f / frames per second) / pi * frames per second, which material() reports.
    reported: np.ndarray
    # How many times faster the session's modes are than the material: 1 where its dynamics have period_frames 0.
    speed: float
    motion: ModalMotion  # the newest motion in the session's own modal coordinates, with its control forces and the mixing S


def control_forces(coordinates: np.ndarray, before: np.ndarray, centre: np.ndarray, following: np.ndarray) -> np.ndarray:
    """(frames - 2) x r of frames x r, see ModalMotion.forces. The others: a coefficient a mode, of three frames in a row."""
    return before * coordinates[:-2] + centre * coordinates[1:-1] + following * coordinates[2:]


def motion_of(session: "Session") -> ModalMotion:
    """Of the newest result."""
    request = service.GetMaterialRequest(session=session.reference, with_coordinates=True, with_candidates=True)
    answer = session.connection.call("get_material", request, timeout=max(60.0, session.connection.timeout))
    if not answer.HasField("coordinates") or not answer.HasField("candidates"):
        raise LimberError("FAILED_PRECONDITION", "there is no motion yet", "session")
    coordinates = arrays.to_numpy(answer.coordinates, "coordinates")
    stiffness, damping, frequencies, shares, *terms = (
        np.array([getattr(mode, name) for mode in answer.modes])
        for name in ("stiffness", "damping", "frequency_hz", "force_share", "force_before", "force_centre", "force_next"))
    return ModalMotion(coordinates, stiffness, damping, frequencies, control_forces(coordinates, *terms),
                       arrays.to_numpy(answer.mixing, "mixing"), arrays.to_numpy(answer.candidates, "candidates"),
                       np.array(answer.candidate_frequencies_hz), answer.result.force_energy, answer.result.revision,
                       answer.smoothing_frames, answer.force_scale or 1.0, np.where(shares > 0, shares, 1.0))


def of(session: "Session", modes: int | None) -> Modal:
    """modes: how many; those of the session by default."""
    try:
        import scipy.sparse.linalg
    except ImportError as error:
        raise LimberError("UNSUPPORTED", f"modal() needs the Python package scipy (python3-scipy): {error}") from error
    scene, geometry = session.settings(), session.geometry()
    rate = scene.dynamics.frames_per_second
    reported = np.sqrt([mode.stiffness for mode in session.material().initial]) * rate / (2 * np.pi)
    rigid = 0 if len(scene.fixed_nodes) else 6
    reported = reported[rigid:]
    nodes = geometry.rest.astype(float) * scene.length_unit_in_metres
    mass, stiffness = matrices(nodes, geometry.tets, tet_materials.of_scene(scene, len(geometry.tets)))
    free = np.ones(len(nodes), dtype=bool)
    free[list(scene.fixed_nodes)] = False
    free = np.repeat(free, 3)
    count = len(reported) if modes is None else checks.whole(modes, "modes")
    if not 0 < count < free.sum() - rigid:
        raise invalid("modes", f"modes must be in [1, {free.sum() - rigid - 1}], is {count}")
    k, m = stiffness[free][:, free], mass[free][:, free]
    # Around a little below 0, so that the matrix that is factored is regular where nothing is fixed.
    shift = -1e-6 * float(k.diagonal().sum() / m.diagonal().sum())
    values, vectors = scipy.sparse.linalg.eigsh(k, count + rigid, m, sigma=shift)
    order = np.argsort(values)[rigid:]
    found = np.zeros((len(free), count))
    found[free] = vectors[:, order]
    frequencies = np.sqrt(np.maximum(values[order], 0)) / (2 * np.pi)
    shared = min(len(reported), count)
    speed = float(reported[0] / frequencies[0]) if shared else 1.0
    return Modal(mass, np.asarray(mass.sum(axis=1)).ravel(), stiffness, free, found, frequencies, reported, speed,
                 motion_of(session))


def matrices(nodes: np.ndarray, tets: np.ndarray, materials: TetMaterials) -> "tuple[Any, Any]":
    """Consistent mass [kg] and linear stiffness [N/m] of linear tets; nodes in metres."""
    import scipy.sparse
    edges = np.swapaxes(nodes[tets[:, 1:]] - nodes[tets[:, :1]], 1, 2)
    volumes = np.abs(np.linalg.det(edges)) / 6
    slopes = np.linalg.inv(edges)  # rows: gradients of the last three shape functions
    slopes = np.concatenate([-slopes.sum(axis=1, keepdims=True), slopes], axis=1)  # tets x 4 x 3
    lam, mu = (values[:, None, None, None, None] for values in (materials.lam, materials.mu))
    # Blocks for corners a, b and directions i, j: V (lambda g_ai g_bj + mu (g_aj g_bi + g_a . g_b delta_ij)).
    outer = np.einsum("tai,tbj->tabij", slopes, slopes)
    block = lam * outer + mu * (np.swapaxes(outer, 3, 4) + np.einsum("tak,tbk,ij->tabij", slopes, slopes, np.eye(3)))
    block *= volumes[:, None, None, None, None]
    shares = (np.ones((4, 4)) + np.eye(4)) / 20
    masses = np.einsum("t,ab,ij->tabij", materials.density * volumes, shares, np.eye(3))
    at = 3 * tets[:, :, None] + np.arange(3)  # tets x 4 x 3
    rows = np.broadcast_to(at[:, :, None, :, None], block.shape).ravel()
    columns = np.broadcast_to(at[:, None, :, None, :], block.shape).ravel()
    size = 3 * len(nodes)
    return tuple(scipy.sparse.coo_matrix((values.ravel(), (rows, columns)), (size, size)).tocsr()
                 for values in (masses, block))
