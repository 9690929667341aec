"""Equilibrium of a linkage: forces, moments and stresses along its segments, reactions at its joints."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import checks, exports
from ..errors import LimberError, invalid
from .shapes import Rod

if TYPE_CHECKING:
    from .session import LinkageSession

FIELDS = ("axial_strain", "axial_force", "curvature_1", "curvature_2", "twist_rate", "bending_moment_1",
          "bending_moment_2", "torque", "largest_normal_stress", "smallest_normal_stress", "torsion_shear_stress",
          "von_mises_stress")


@dataclass(frozen=True)
class LinkageSolution:
    """Rows are joints, segments or stations. A segment's stations are its first end, the vertices between its edges and its last
    end: those of segment s are first[s] .. first[s + 1] - 1. Forces in N, moments in N m, stresses in Pa, angles in degrees,
    other lengths in the length unit. See limber.v1's files of linkages for the meaning of the fields of stations."""

    revision: int
    converged: bool              # false: the request has no solution, and this is the last equilibrium of the path
    energy: float                # elastic [J]
    mean_angle: float            # [degree]
    length_unit_in_metres: float
    positions: np.ndarray        # joints x 3
    normals: np.ndarray          # joints x 3, unit: the axes of the joints
    angles: np.ndarray           # (joints,) opening angles
    # Forces are those that the solver balances: the sum of reactions, loads, springs and weights is zero to its tolerance.
    reaction_forces: np.ndarray  # joints x 3: forces of pins on the joints whose motion they hold; 0 elsewhere
    reaction_moments: np.ndarray  # joints x 3, about the joint
    loads: np.ndarray            # joints x 3: forces of conditions
    spring_forces: np.ndarray    # targets x 3: force of each spring on the linkage; where converged is false, springs of its path
    spring_points: np.ndarray    # the same x 3: where it acts
    weights: np.ndarray          # segments x 3
    unbalanced_forces: np.ndarray  # joints x 3: forces within the solver's tolerance at joints without supports
    joints_of_segment: np.ndarray  # segments x 2; -1: a free end
    rods: tuple[Rod, ...]        # every segment is in one
    rest_lengths: np.ndarray     # (segments,) between their ends
    lengths: np.ndarray          # (segments,)
    section_scales: np.ndarray   # (segments,)
    end_forces: np.ndarray       # segments x 2 x 3: forces of the segment on its neighbours at its first and last end
    end_moments: np.ndarray      # segments x 2 x 3
    first: np.ndarray            # (segments + 1,) stations
    points: np.ndarray           # stations x 3
    directors: np.ndarray        # stations x 3: d1, unit
    axial_strains: np.ndarray    # (stations,), as all below
    axial_forces: np.ndarray
    curvatures: np.ndarray       # stations x 2: towards d1 and d2 [1 / length unit]
    twist_rates: np.ndarray      # [radian / length unit]
    bending_moments: np.ndarray  # stations x 2: against these
    torques: np.ndarray
    normal_stresses: np.ndarray  # stations x 2: the largest and the smallest of the section
    shear_stresses: np.ndarray   # by torsion; NaN where sharp inner corners leave it without bound
    von_mises_stresses: np.ndarray  # a bound of them; NaN where the shear has none
    stresses: np.ndarray         # (segments,): the largest von Mises stress, or normal stress where that is not known
    utilisations: np.ndarray     # (segments,): of the yield stress; 0 where none is given

    def stations(self, segment: int) -> slice:
        """Those of a segment, in arrays of stations."""
        return slice(int(self.first[segment]), int(self.first[segment + 1]))


def of(session: "LinkageSession", yield_stress: float | None = None) -> LinkageSolution:
    """Of the newest final shape."""
    if yield_stress is not None and not checks.real(yield_stress, "yield_stress") > 0:
        raise invalid("yield_stress", f"yield_stress must be > 0 Pa, is {yield_stress}")
    for _ in range(8):
        (content,) = exports.fetch(session, "json").values()
        shape = json.loads(content)
        if int(shape["revision"]) == session.status().revision:
            return from_json(shape, yield_stress)
        session.wait(session.status().revision)
    raise LimberError("FAILED_PRECONDITION", "other clients edit this linkage faster than it settles")


def from_json(shape: "dict[str, Any]", yield_stress: float | None = None) -> LinkageSolution:
    """shape: as the export `json` has it."""
    unit = float(shape["length_unit_in_metres"])
    joints, segments, springs = shape["joints"], shape["segments"], shape["springs"]
    first = np.concatenate([[0], np.cumsum([len(segment["stations"]["position"]) for segment in segments])])
    points, directors = (_rows(segments, name, 3) for name in ("position", "director_1"))
    field = {name: _rows(segments, name) for name in FIELDS}
    bending = np.stack([field["bending_moment_1"], field["bending_moment_2"]], axis=1)
    normal_stresses = np.stack([field["largest_normal_stress"], field["smallest_normal_stress"]], axis=1)
    pairs = np.array([[-1 if joint is None else joint for joint in segment["joints"]] for segment in segments],
                     dtype=np.int32).reshape(-1, 2)
    rests, lengths, scales = (np.array([segment[name] for segment in segments], dtype=float)
                              for name in ("rest_length", "length", "section_scale"))

    von_mises = field["von_mises_stress"]
    normal = np.abs(normal_stresses).max(axis=1)
    bound = np.where(np.isfinite(von_mises), von_mises, normal)
    stresses = np.array([bound[first[s]:first[s + 1]].max() for s in range(len(segments))])
    return LinkageSolution(
        revision=int(shape["revision"]), converged=not shape["solve_failed"],
        energy=sum(shape["energy"][name] for name in ("stretching", "bending", "twisting")),
        mean_angle=float(shape["mean_opening_angle"]), length_unit_in_metres=unit, positions=_vectors(joints, "position"),
        normals=_vectors(joints, "normal"), angles=np.array([joint["opening_angle"] for joint in joints], dtype=float),
        reaction_forces=_vectors(joints, "reaction_force"), reaction_moments=_vectors(joints, "reaction_moment"),
        loads=_vectors(joints, "load"), spring_forces=_vectors(springs, "force"), spring_points=_vectors(springs, "point"),
        weights=_vectors(segments, "weight"), unbalanced_forces=_vectors(joints, "unbalanced_force"),
        joints_of_segment=pairs, rods=tuple(Rod(tuple(rod["segments"]), tuple(rod["reversed"]), rod["closed"])
                                            for rod in shape["rods"]),
        rest_lengths=rests, lengths=lengths, section_scales=scales,
        end_forces=_vectors(segments, "end_forces", 2), end_moments=_vectors(segments, "end_moments", 2), first=first,
        points=points, directors=directors, axial_strains=field["axial_strain"],
        axial_forces=field["axial_force"], curvatures=np.stack([field["curvature_1"], field["curvature_2"]], axis=1),
        twist_rates=field["twist_rate"], bending_moments=bending, torques=field["torque"],
        normal_stresses=normal_stresses, shear_stresses=field["torsion_shear_stress"], von_mises_stresses=von_mises,
        stresses=stresses, utilisations=stresses / yield_stress if yield_stress else np.zeros(len(stresses)))


def _vectors(rows: "list[dict[str, Any]]", name: str, *shape: int) -> np.ndarray:
    """A vector of each row, or as many as shape says."""
    return np.array([row[name] for row in rows], dtype=float).reshape((len(rows), *shape, 3))


def _rows(segments: "list[dict[str, Any]]", name: str, width: int = 0) -> np.ndarray:
    """Values of all stations; null is NaN."""
    values = [np.array(segment["stations"][name], dtype=float) if segment["stations"].get(name) is not None
              else np.full(len(segment["stations"]["position"]), np.nan) for segment in segments]
    return np.concatenate(values) if values else np.zeros((0, width) if width else 0)
