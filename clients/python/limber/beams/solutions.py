"""Equilibria of structures of beams: requests and answers."""

from __future__ import annotations

import os
import warnings
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Iterable

import numpy as np

from .. import arrays, checks
from ..exports import write_exported
from ..messages import beams as messages
from ..messages import common, scene, service
from ..results import DiscretisationError, issue_text
from .structures import BeamsLike, structure_of

METHODS = {"choose": messages.BEAM_METHOD_UNSPECIFIED, "newton": messages.BEAM_METHOD_NEWTON,
           "relaxation": messages.BEAM_METHOD_RELAXATION,
           "relaxation_then_newton": messages.BEAM_METHOD_RELAXATION_THEN_NEWTON}
FORMATS = {"vtu": messages.BEAM_FILE_FORMAT_VTU, "csv": messages.BEAM_FILE_FORMAT_CSV,
           "json": messages.BEAM_FILE_FORMAT_JSON}

FORCES = ("axial_force", "torque", "shear_2", "shear_3", "moment_2", "moment_3")
QUANTITIES = FORCES + ("stress", "utilisation")


class StrengthWarning(UserWarning):
    """Beams are stressed beyond their yield stress: limber computes on as if nothing yielded."""


def warn_of_strength(utilisation: float, where: str, stacklevel: int) -> None:
    """utilisation: the largest; stacklevel: as in warnings.warn, counted from the caller."""
    if utilisation > 1:
        warnings.warn(f"{where} is overloaded: the largest stress is {utilisation:.3g} times the yield stress, and limber computes on "
                      "as if nothing yielded", StrengthWarning, stacklevel=stacklevel + 1)


@dataclass(frozen=True)
class BeamSnap:
    """Place on the path at which the structure jumped to another shape."""

    progress: float  # share of the path, 0 .. 1
    turn: float      # of a node or element, the largest [radian]
    node: int        # where

    def __str__(self) -> str:
        return f"at {100 * self.progress:.4g} % of the path, where node {self.node} turned by {np.degrees(self.turn):.3g} degrees"


@dataclass(frozen=True)
class BeamNeutralDirection:
    """A direction in which the equilibrium may be moved without force although the material resists: it is one of a family of
    equal energy. Scaled so that the largest turn of a node, or of an element's chord, is 1 rad."""

    node: int                # that moves most
    translation: np.ndarray  # (3,): of the node [m]
    rotation: np.ndarray     # (3,): of the node [rad]


def neutral_directions_of(answer: "messages.BeamSolution | service.BeamInfo") -> tuple[BeamNeutralDirection, ...]:

    def vector(message: "common.Vector3") -> np.ndarray:
        return np.array([message.x, message.y, message.z])

    return tuple(BeamNeutralDirection(one.node, vector(one.translation), vector(one.rotation)) for one in answer.neutral_directions)


def negative_eigenvalues_of(answer: "messages.BeamSolution | service.BeamInfo") -> int | None:
    return answer.negative_eigenvalues if answer.HasField("negative_eigenvalues") else None


def snaps_of(snaps: "Iterable[messages.BeamSnap]") -> tuple[BeamSnap, ...]:
    return tuple(BeamSnap(snap.progress, snap.turn, snap.node) for snap in snaps)


@dataclass(frozen=True)
class BeamSolution:
    """Equilibrium of a structure of beams, and its forces and stresses. SI units; rows are nodes or elements."""

    status: str  # "CONVERGED", "STALLED", "UNSTABLE", "MECHANISM", "ITERATION_LIMIT"
    method: str  # that gave the answer: "newton", "relaxation", "relaxation_then_newton"
    message: str
    node: int | None  # that moves most freely or is worst balanced
    residual: float  # largest force over forces present, and moment over moments
    load_factor: float  # share of loads and motions that is on
    newton_iterations: int
    load_steps: int
    relaxation_steps: int
    positions: np.ndarray  # (nodes, 3)
    rotations: np.ndarray  # (nodes, 4): quaternions w, x, y, z from rest
    reaction_forces: np.ndarray  # (nodes, 3) [N], 0 where nothing is held
    reaction_moments: np.ndarray  # (nodes, 3) [N m]
    elements: np.ndarray  # (elements, 2): nodes
    axial_forces: np.ndarray  # (elements,) [N]; like torques and shears where the size is largest along the element
    torques: np.ndarray  # (elements,) [N m]
    shear_forces: np.ndarray  # (elements, 2): along axes 2 and 3 [N]
    bending_moments: np.ndarray  # (elements, 2, 2): start and finish, about axes 2 and 3 [N m]
    stresses: np.ndarray  # (elements,): the largest von Mises stress along each element [Pa]
    utilisations: np.ndarray  # (elements,): of the yield stress; 0 where that is not known
    element_stresses: np.ndarray  # (elements, 5): axial, bending, torsional, von Mises, utilisation, at governing_places
    element_energies: np.ndarray  # (elements,) [J]
    energies: dict[str, float]  # "stretching", "torsion", "bending_2", "bending_3" [J]
    largest_bend: float  # between an end and its chord [rad]; above 0.5 the elements are too long
    shapes: np.ndarray  # (shapes, nodes, 3), float32, or float64 far from the origin: positions along the path
    job: int  # 0: of a session
    snaps: tuple[BeamSnap, ...] = ()  # where the structure left the branch of equilibria
    issues: tuple[str, ...] = ()  # warnings: input without effect, and parts left out
    negative_eigenvalues: int | None = None  # of the stiffness: 0 at a minimum; None where nothing balances
    neutral_directions: tuple[BeamNeutralDirection, ...] = ()
    unjudged_elements: tuple[int, ...] = ()  # too long to show how they buckle: their stability is not judged
    # (elements, 6, 4): of each of FORCES along the element: smallest value, its place, largest value, its place; places are
    # shares of the length at rest, from the start
    extremes: np.ndarray = field(repr=False, default_factory=lambda: np.zeros((0, 6, 4)))
    governing_places: np.ndarray = field(repr=False, default_factory=lambda: np.zeros(0))  # (elements,): of element_stresses
    stations: np.ndarray = field(repr=False, default_factory=lambda: np.zeros((0, 0, 8)))  # see along()
    discretisation_error: "DiscretisationError | None" = None  # against shorter elements; None: not estimated
    _files: tuple = field(repr=False, default=())

    @property
    def converged(self) -> bool:
        """Forces and moments balance, and the energy rises in every direction."""
        return self.status == "CONVERGED"

    @property
    def utilisation(self) -> float:
        """The largest of all elements; above 1 the structure is overloaded. 0 where no yield stress is known."""
        return float(self.utilisations.max(initial=0.0))

    @property
    def places(self) -> np.ndarray:
        """(stations,): where the stations of along() are, as shares of the length of an element at rest, from its start."""
        return np.linspace(0.0, 1.0, self.stations.shape[1])

    def along(self, quantity: str) -> np.ndarray:
        """(elements, stations): a quantity at equal distances along each element, loads over it included: "axial_force", "shear_2",
        "shear_3" [N], "torque", "moment_2", "moment_3" [N m], "stress" (von Mises) [Pa], "utilisation"."""
        return self.stations[:, :, QUANTITIES.index(checks.one_of(quantity, QUANTITIES, "quantity"))]

    def peaks(self, quantity: str) -> np.ndarray:
        """(elements,): a force or moment (as of along()) where its size is largest along each element, with its sign."""
        of = self.extremes[:, FORCES.index(checks.one_of(quantity, FORCES, "quantity"))]
        return np.where(-of[:, 0] > of[:, 2], of[:, 0], of[:, 2])

    @property
    def energy(self) -> float:
        """Elastic energy [J]."""
        return sum(self.energies.values())

    def write(self, folder: "str | os.PathLike[str]" = ".") -> tuple[Path, ...]:
        """Writes the files that solve_beams(files=..) requested."""
        return tuple(write_exported(checks.path(folder, "folder"), file) for file in self._files)


def request(structure: BeamsLike, *, method: str, tolerance: float | None, files: Iterable[str], stem: str,
            shapes: int, follow: bool, stations: int, estimate: bool) -> "messages.SolveBeamsRequest":
    """The request."""
    made = messages.SolveBeamsRequest(method=METHODS[checks.one_of(method, METHODS, "method")],
                                      stem=checks.text(stem, "stem"), shapes=checks.whole(shapes, "shapes"),
                                      follow=checks.flag(follow, "follow"), stations=checks.whole(stations, "stations"),
                                      estimate=checks.flag(estimate, "estimate"))
    made.files.extend(FORMATS[checks.one_of(name, FORMATS, "files")] for name in checks.several(files, "files"))
    if tolerance is not None:
        made.tolerance = checks.real(tolerance, "tolerance")
    read = structure_of(structure)
    (made.job if isinstance(read, scene.MeshFile) else made.structure).CopyFrom(read)
    return made


def made_of(job: "service.GetJobResponse") -> BeamSolution:
    """Solution of a job that is done."""
    made = from_message(job.beams, job.status.job, tuple(job.files), tuple(issue_text(issue) for issue in job.issues))
    if not job.HasField("discretisation_error"):
        return made
    return replace(made, discretisation_error=DiscretisationError.from_message(job.discretisation_error))


def from_message(answer: "messages.BeamSolution", job: int = 0, files: tuple = (), issues: tuple = ()) -> BeamSolution:

    def rows(name: str) -> np.ndarray:
        return arrays.to_numpy(getattr(answer, name), name)

    def rows_or(name: str, shape: tuple) -> np.ndarray:
        return rows(name) if answer.HasField(name) else np.full(shape, np.nan)

    forces, stresses = rows("element_forces"), rows("element_stresses")
    method = {number: name for name, number in METHODS.items()}[answer.method]
    energies = {name: getattr(answer.energies, name) for name in ("stretching", "torsion", "bending_2", "bending_3")}
    return BeamSolution(
        status=messages.BeamStatus.Name(answer.status).removeprefix("BEAM_STATUS_"), method=method,
        message=answer.message, node=answer.node if answer.HasField("node") else None, residual=answer.residual,
        load_factor=answer.load_factor, newton_iterations=answer.newton_iterations, load_steps=answer.load_steps,
        relaxation_steps=answer.relaxation_steps, positions=rows("positions"), rotations=rows("rotations"),
        reaction_forces=rows("reaction_forces"), reaction_moments=rows("reaction_moments"), elements=rows("elements"),
        axial_forces=forces[:, 0], torques=forces[:, 1], shear_forces=forces[:, 2:4],
        bending_moments=forces[:, 4:].reshape(-1, 2, 2), stresses=stresses[:, 3], utilisations=stresses[:, 4],
        element_stresses=stresses, element_energies=rows("element_energies"), energies=energies,
        largest_bend=answer.largest_bend, shapes=rows("shapes"), job=job,
        snaps=snaps_of(answer.snaps), issues=issues or tuple(issue_text(issue) for issue in answer.issues),
        negative_eigenvalues=negative_eigenvalues_of(answer), neutral_directions=neutral_directions_of(answer),
        unjudged_elements=tuple(answer.unjudged_elements), extremes=rows_or("element_extremes", (len(forces), len(FORCES), 4)),
        governing_places=rows_or("governing_places", (len(forces),)),
        stations=rows_or("stations", (len(forces), 0, len(QUANTITIES))),
        _files=files)
