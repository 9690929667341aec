"""Requests about structures of beams besides sessions: equilibria."""

from __future__ import annotations

from typing import Iterable

from .. import checks
from ..open_session import warn_of_snaps
from ..progress import ProgressOption
from ..server_core import ServerCore
from . import solutions
from .solutions import BeamSolution
from .structures import BeamsLike


class BeamRequests(ServerCore):
    """Requests to a server that concern structures of beams alone."""

    def solve_beams(self, structure: BeamsLike, *, method: str = "choose", tolerance: float | None = None,
                    files: Iterable[str] = (), stem: str = "", shapes: int = 0, follow: bool = False, stations: int = 11,
                    estimate: bool = True, progress: ProgressOption = None, timeout: float = 3600.0) -> BeamSolution:
        """The equilibrium of a structure of beams: shape, reactions, forces, stresses, energies, and how it ended. An unbalanced
        shape is an answer too: see its status.

        structure: a mapping or file (JSON form of limber.v1.BeamStructure, or a scene of one), a message, or a job of the public
        relaxation code (its folder, or SimulationJob.json). method: "choose", "newton", "relaxation", "relaxation_then_newton";
        tolerance: largest force over forces present (1e-8, of relaxation 1e-6); files: of "vtu", "csv" and "json", which
        solution.write(folder) writes as STEM...; shapes: how many along the path are kept; follow: Newton's method stays on the
        branch of equilibria under temporary loads, too (without them "choose" does); answer.snaps has the places where it ends;
        stations: of answer.along() on each element, 2 to 201, 0: none. estimate: answer.discretisation_error compares it with
        those of shorter elements, and the message says if that is large or unknown; takes several times as long as the answer.
        Warns (limber.StrengthWarning) if a stress is beyond the yield stress, and (limber.SnapWarning) if the structure snapped
        along the path. Ctrl-C while waiting, and the end of `timeout` [s], cancel the job.
        """
        checks.seconds(timeout, "timeout")
        request = solutions.request(structure, method=method, tolerance=tolerance, files=files, stem=stem, shapes=shapes,
                                    follow=follow, stations=stations, estimate=estimate)
        response = self.connection.call("solve_beams", request, timeout=max(60.0, self.connection.timeout))
        solution = solutions.made_of(self._wait_or_cancel(response.job, progress, timeout))
        if solution.snaps:
            warn_of_snaps("solve_beams", [str(snap) for snap in solution.snaps], stacklevel=2)
        solutions.warn_of_strength(solution.utilisation, "the structure", stacklevel=2)
        return solution
