"""Values that sessions of every kind return: results and frames."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from . import arrays, precision
from .errors import LimberError, code_name
from .messages import service

ENCODINGS = {
    "coordinates": service.ENCODING_COORDINATES,
    "positions": service.ENCODING_POSITIONS,
    "quantised": service.ENCODING_POSITIONS_QUANTISED,
    "surface": service.ENCODING_SURFACE,
}


@dataclass(frozen=True)
class MotionError:
    """Error of the model for one motion: its shown shapes against full reconstructions of the same modes."""

    shape_error: float           # rms distance of nodes over rms displacement, over all compared frames
    worst_frame_error: float     # of the worst single frame
    worst_frame: int
    max_distance: float          # of a node between both [length unit]
    max_distance_share: float    # of the body's length
    max_constraint_error: float  # of the full reconstruction [length unit]; compare with Result.max_error
    inverted_tets: int           # of the shown frame that has most of them
    inverted_frame: int
    frames: int                  # that were compared
    tolerance: float             # for shape_error: the scene's model.tolerance
    within_tolerance: bool
    check_ms: float              # that it took, on the server
    max_velocity_error: float = 0.0  # of the full reconstruction [length unit / s]
    # Largest distance of a shown node from the mean of its places one frame before and one after [length unit], its share of the
    # body's length, and the frame. Above 0.02 the message says that the motion is abrupt.
    zigzag: float = 0.0
    zigzag_share: float = 0.0
    zigzag_frame: int = 0

    @staticmethod
    def from_message(error: "service.MotionError") -> "MotionError":
        return MotionError(error.shape_error, error.worst_frame_error, error.worst_frame, error.max_distance,
                           error.max_distance_share, error.max_constraint_error, error.inverted_tets,
                           error.inverted_frame, error.frames, error.tolerance, error.within_tolerance, error.check_ms,
                           error.max_velocity_error, error.zigzag, error.zigzag_share, error.zigzag_frame)


@dataclass(frozen=True)
class DiscretisationError:
    """Error of a structure's elements for one shape: its equilibrium against the limit of ever finer ones."""

    # None: not estimated. Largest distance of a node or joint from its place in the limit, over the structure's size
    position_error: "float | None"
    max_distance: "float | None"  # the same [m]
    worst_node: int           # which one that is
    energy_error: "float | None"  # of the elastic energy, relative
    elements: int             # of the shown shape
    # Elements of the finest one it was compared with; 0: there is no estimate of the whole, message says why. If there are cables
    # that sag, moment_error and utilisation_error are those of the beams.
    compared_elements: int
    tolerance: float          # for these errors: the scene's; 0: none was requested
    within_tolerance: bool
    check_ms: float           # that it took, on the server
    message: str = ""         # why there is no estimate, or why it is uncertain
    # For structures of beams, None if not estimated; within_tolerance: they are within the tolerance, or within 1 % if it is less
    moment_error: float | None = None       # largest error of a bending moment, over the structure's largest
    max_moment_error: float = 0.0           # the same [N m]
    worst_moment_element: int | None = None
    utilisation_error: float | None = None  # largest error of an element's utilisation, over the structure's largest
    worst_utilisation_element: int | None = None
    # For linkages: error of the largest stress of a segment, over the largest of the linkage; in Pa; and the segment. None: not
    # estimated.
    stress_error: "float | None" = None
    max_stress_error: float = 0.0
    worst_stress_segment: int = 0

    @property
    def known(self) -> bool:
        """There is an estimate."""
        return self.compared_elements > 0

    @staticmethod
    def from_message(error: "service.DiscretisationError") -> "DiscretisationError":
        has_moments, has_utilisation = error.HasField("moment_error"), error.HasField("utilisation_error")
        has_positions = error.HasField("position_error")
        return DiscretisationError(error.position_error if has_positions else None,
                                   error.max_distance if has_positions else None, error.worst_node,
                                   error.energy_error if has_positions else None, error.elements, error.compared_elements, error.tolerance, error.within_tolerance,
                                   error.check_ms, error.message,
                                   error.moment_error if has_moments else None, error.max_moment_error,
                                   error.worst_moment_element if has_moments else None,
                                   error.utilisation_error if has_utilisation else None,
                                   error.worst_utilisation_element if has_utilisation else None,
                                   stress_error=error.stress_error if error.HasField("stress_error") else None,
                                   max_stress_error=error.max_stress_error,
                                   worst_stress_segment=error.worst_stress_segment)


@dataclass(frozen=True)
class StartComparison:
    """Several starts were solved for one problem, which may have more than one optimum; the best of them is shown."""

    compared: int            # starts that ended, the shown motion among them
    optima: int              # different ones among them
    lowest_energy: float     # total energies, as Result.energy
    highest_energy: float
    largest_distance: float  # of a node between the shown motion and another one [length unit]
    budget: int              # starts that are allowed
    unconverged: int = 0     # of the compared ones, without convergence: no optima


@dataclass(frozen=True)
class OutOfReach:
    """A constraint whose target the motion stops short of."""

    constraint: int  # its id
    distance: float  # that is left [length unit]


@dataclass(frozen=True)
class Result:
    """One published solution of a session. Energies are unitless (body lengths, frames)."""

    revision: int        # every edit up to this one is in it
    sequence: int        # counts the session's results from 1
    final: bool          # no better one of its revision will come; it need not have converged
    status: str          # "CONVERGED", "IMPROVED", "ITERATION_LIMIT", "STALLED", "CANCELLED"
    iterations: int
    force_energy: float
    constraint_energy: float
    energy: float        # sum of all
    gradient: float      # scale-free norm
    max_error: float     # largest distance by which a position is missed, over the axes that it has [length unit]
    rms_error: float     # root mean square of these distances over the constraints on positions [length unit]
    rank_deficient: bool  # exact constraints contradict or repeat each other: a least-squares answer
    message: str
    since_edit_ms: float  # on the server, from the newest edit contained to publication
    max_exact_error: float = 0.0  # largest of these distances, of the exact constraints alone [length unit]
    solve_failed: bool = False    # message says why; the motion is an earlier one, energies and errors are 0: unknown
    material_iterations: int = 0    # steps of the material's optimisation for this revision
    column_energy: float = 0.0      # keeps mixed modes near unit size; part of energy
    unit_force_energy: float = 0.0  # control forces, comparable between materials
    max_keyframe_error: float = 0.0  # largest distance of a node in a keyframe [length unit]; of final results
    weight_scale: float = 1.0       # soft constraints weigh so many times more, to meet constraint_tolerance
    # Share of the shown nodes' power above half the Nyquist frequency; for final results, None for few frames.
    high_frequency_share: "float | None" = None
    max_velocity_error: float = 0.0  # largest difference by which a velocity is missed [length unit / s]
    max_exact_velocity_error: float = 0.0  # the same of exact constraints alone [length unit / s]
    exact: bool = False  # of a body: energies, errors and frames are those of the full map, not of the reduced model
    motion_error: MotionError | None = None  # of a final result that has been checked: wait(until="checked")
    discretisation_error: DiscretisationError | None = None  # the same of linkages and structures of beams
    starts: "StartComparison | None" = None  # of a body: that were compared for this optimum, in the background
    out_of_reach: "tuple[OutOfReach, ...]" = ()  # of a body: the worst first

    @property
    def converged(self) -> bool:
        """Final, and the solve converged. limber.v1.ResultInfo.converged means final."""
        return self.final and self.status == "CONVERGED"

    @staticmethod
    def from_message(info: "service.ResultInfo") -> "Result":
        status = service.SolveStatus.Name(info.status).removeprefix("SOLVE_STATUS_") \
            if info.status in service.SolveStatus.values() else str(info.status)
        return Result(info.revision, info.sequence, info.converged, status, info.iterations, info.force_energy,
                      info.constraint_energy, info.total_energy, info.gradient, info.max_constraint_error,
                      info.rms_constraint_error, info.rank_deficient, info.message, info.since_edit_ms,
                      info.max_exact_error, info.solve_failed, info.material_iterations, info.column_energy,
                      info.unit_force_energy, info.max_keyframe_error, info.weight_scale,
                      info.high_frequency_share if info.HasField("high_frequency_share") else None,
                      max_velocity_error=info.max_velocity_error,
                      max_exact_velocity_error=info.max_exact_velocity_error, exact=info.exact,
                      motion_error=MotionError.from_message(info.motion_error) if info.HasField("motion_error") else None,
                      discretisation_error=(DiscretisationError.from_message(info.discretisation_error)
                                            if info.HasField("discretisation_error") else None),
                      starts=_starts(info.starts) if info.HasField("starts") else None,
                      out_of_reach=tuple(OutOfReach(one.constraint, one.distance) for one in info.out_of_reach))


def _starts(message: "service.StartComparison") -> StartComparison:
    return StartComparison(message.compared, message.optima, message.lowest_energy, message.highest_energy,
                           message.largest_distance, message.budget, message.unconverged)


def decode(frames: "service.Frames", geometry: Any) -> np.ndarray:
    """frames x nodes x 3 float32, or float64 far from the origin [length unit]; geometry, an object with positions(coordinates) and basis_hash, is needed
    for coordinates only."""
    data = arrays.to_numpy(frames.data, "frames")
    if frames.encoding == service.ENCODING_COORDINATES:
        if geometry is None or geometry.basis_hash != frames.basis_hash:
            raise LimberError("FAILED_PRECONDITION", "these coordinates belong to another basis", "basis_hash")
        return geometry.positions(data)
    if data.ndim != 3 or data.shape[2] != 3:
        raise LimberError("MALFORMED", f"positions have the shape {data.shape}")
    if frames.encoding in (service.ENCODING_POSITIONS, service.ENCODING_SURFACE):
        return np.array(data)
    if frames.encoding == service.ENCODING_POSITIONS_QUANTISED:
        origin = np.array([frames.origin.x, frames.origin.y, frames.origin.z])
        extent = np.array([frames.extent.x, frames.extent.y, frames.extent.z])
        corners = np.stack([origin, origin + extent])
        positions = origin + data * (extent / 65535.0)
        return positions if precision.is_far(corners) else positions.astype(np.float32)
    raise LimberError("UNSUPPORTED", f"frames in the unknown encoding {frames.encoding}")


def issue_text(issue) -> str:
    """`warning: mesh.tets[7]: ...`, an error with its code in brackets."""
    kind = "error" if issue.severity == issue.SEVERITY_ERROR else "warning"
    code = f" [{code_name(issue.code)}]" if issue.code else ""
    return f"{kind}: {issue.field}: {issue.message}{code}" if issue.field else f"{kind}: {issue.message}{code}"
