"""Designs of rod linkages: rest lengths that deploy towards a surface or targets, searched live."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Iterator, Sequence

import numpy as np

from .. import checks
from ..errors import LimberError, from_message
from ..messages import design as messages
from ..messages import scene as scene_messages
from ..progress import ProgressOption
from .goals import GUARDS, LENGTHS, SECTIONS, Placement, chosen_placement, set_given, surface_of, targets_of

if TYPE_CHECKING:
    from .session import LinkageSession

STATES = {messages.DESIGN_STATE_STARTING: "starting", messages.DESIGN_STATE_RUNNING: "running",
          messages.DESIGN_STATE_PAUSED: "paused", messages.DESIGN_STATE_ENDED: "ended"}
ENDS = {messages.DESIGN_END_UNSPECIFIED: "", messages.DESIGN_END_CONVERGED: "converged",
        messages.DESIGN_END_SETTLED: "settled", messages.DESIGN_END_INFEASIBLE: "infeasible",
        messages.DESIGN_END_STUCK: "stuck", messages.DESIGN_END_ITERATION_LIMIT: "iteration_limit",
        messages.DESIGN_END_STOPPED: "stopped", messages.DESIGN_END_FAILED: "failed"}


@dataclass(frozen=True)
class DesignTerms:
    """Terms of the objective for a pair of shapes, the flat one and the deployed one."""

    objective: float        # unitless
    flat_energy: float      # [J]
    deployed_energy: float  # [J]
    target_rms: float       # of joints that have targets, to these [length unit]
    surface_rms: float      # of all joints, to the surface [length unit]
    flat_height: float      # of the flat shape's joints over their plane, as a share of the linkage's extent
    smallest_angle: float   # at most the smallest opening angle of the flat shape [degree]
    holds: bool             # all constraints are kept
    covered_area: float     # of the deployed shape's cells, at most the surface's [length unit^2]; 0 without a surface
    cover: float            # the same as a share of the start's

    @staticmethod
    def from_message(terms: "messages.DesignTerms") -> "DesignTerms":
        return DesignTerms(terms.objective, terms.flat_energy, terms.deployed_energy, terms.target_rms,
                           terms.surface_rms, terms.flat_height, terms.smallest_angle_degrees, terms.holds,
                           terms.covered_area, terms.cover)


@dataclass(frozen=True)
class OtherOptimum:
    """An earlier design of the session for the same goal that ended elsewhere."""

    job: int
    terms: DesignTerms        # by the scales of the newer design: objectives can be compared
    size_difference: float    # largest, of a rest length or a section's scale, as a share
    flat_distance: float      # of joints between both flat shapes, root mean square [length unit]
    deployed_distance: float  # the same of the deployed ones

    @staticmethod
    def from_message(other: "messages.OtherOptimum") -> "OtherOptimum":
        return OtherOptimum(other.job, DesignTerms.from_message(other.terms), other.size_difference,
                            other.flat_distance, other.deployed_distance)


@dataclass(frozen=True)
class Erection:
    """How a linkage is opened from flat to the shape it was designed for: pushed out of its plane along the way."""

    mean_angle: float        # that it leads to [degree]
    push: dict[int, tuple[float, float, float]]  # forces at joints [N], removed at the end; {}: it opens by itself
    path: tuple[float, ...]  # mean angles from flat [degree]
    distance: float          # of the shape it leads to from the designed one, root mean square of joints [length unit]
    moments: tuple[float, ...] = ()  # at each angle of path: on every joint, to hold it [N m]; > 0 opens. The last: without push
    # The joint that is held while the linkage is pushed, by its pin or for that time, and the greatest force [N] and moment [N m] there.
    support: "tuple[int, tuple[float, float, float], tuple[float, float, float]] | None" = None

    @staticmethod
    def from_message(erection: "scene_messages.LinkageErection") -> "Erection":
        return Erection(erection.mean_angle_degrees,
                        {load.joint: (load.force.x, load.force.y, load.force.z) for load in erection.push},
                        tuple(erection.path_degrees), erection.distance, tuple(erection.path_moments),
                        _support(erection.support) if erection.HasField("support") else None)


def _support(load: "scene_messages.JointLoad") -> "tuple[int, tuple[float, float, float], tuple[float, float, float]]":
    return load.joint, (load.force.x, load.force.y, load.force.z), (load.moment.x, load.moment.y, load.moment.z)


@dataclass(frozen=True)
class DesignInfo:
    """How a design stands."""

    state: str              # "starting", "running", "paused" or "ended"
    end: str                # "", "converged", "settled", "infeasible", "stuck", "iteration_limit", "stopped", "failed"
    iteration: int
    accepted: bool          # the trial of this iteration was taken
    start: DesignTerms
    now: DesignTerms
    best: DesignTerms       # that can be taken; counted anew when the goal changes
    best_iteration: int
    flat_height: float      # allowed
    weights: tuple[float, float, float]  # flat share, of distances, of the surface
    at_bound: tuple[int, ...]            # segments whose rest length is at a bound
    taken: int | None       # the revision that brought its best lengths
    message: str            # why it ended
    job: int
    lengths: str            # varied: "segments", "edges" or "kept"
    sections: str           # varied: "segments" or "kept"
    guard: str              # against buckling: "when_needed", "from_start" or "never"
    sections_at_bound: tuple[int, ...]
    refused: int            # trials that gained too little
    not_believed: int       # trials whose equilibria were lost, or lay on another branch
    flat_lost: int          # of these: the flat shape's, which had buckled
    guarded: bool           # the guard is up
    refusal: str            # why the last trial was not believed; "": it was
    other_optima: tuple[OtherOptimum, ...]  # of one that has ended by itself: earlier ones that ended elsewhere
    placement: Placement    # of the surface
    flat_angle: float | None  # mean angle that the flat shape is held at [degree]; None: nothing holds it
    least_cover: float      # required share of the start's area of cells
    erection: Erection | None  # how the best shape is opened from flat; None: not ended, or no path is known
    no_erection: str        # why no path is known; "": not ended, or erection is one

    @staticmethod
    def from_message(info: "messages.DesignInfo") -> "DesignInfo":
        terms = DesignTerms.from_message
        return DesignInfo(STATES.get(info.state, ""), ENDS.get(info.end, ""), info.iteration, info.accepted,
                          terms(info.start), terms(info.now), terms(info.best), info.best_iteration, info.flat_height,
                          (info.flat_share, info.distance_weight, info.surface_weight), tuple(info.at_bound),
                          info.taken_revision if info.HasField("taken_revision") else None, info.message, info.job,
                          LENGTHS.get(info.lengths, ""), SECTIONS.get(info.sections, ""), GUARDS.get(info.guard, ""),
                          tuple(info.sections_at_bound), info.refused, info.not_believed, info.flat_lost, info.guarded,
                          info.refusal, tuple(OtherOptimum.from_message(other) for other in info.other_optima),
                          Placement.from_message(info.placement),
                          info.flat_angle_degrees if info.HasField("flat_angle_degrees") else None, info.least_cover,
                          Erection.from_message(info.erection)
                          if info.HasField("erection") and not info.erection.failure else None, info.erection.failure)


class Design:
    """The newest design of a session, begun by any client. Made by LinkageSession.design() and .current_design()."""

    def __init__(self, session: "LinkageSession", job: int = 0):
        self.session = session
        self.job = job

    def _get(self) -> "messages.GetDesignResponse":
        response = self.session.connection.call("get_design", messages.GetDesignRequest(session=self.session.reference))
        if not response.HasField("design"):
            raise LimberError("FAILED_PRECONDITION", f"session {self.session.id} has no design", "session")
        return response

    def info(self) -> DesignInfo:
        return DesignInfo.from_message(self._get().design)

    def best_lengths(self) -> np.ndarray:
        """Rest lengths of segments that take() would bring [length unit]; empty where there are none yet."""
        return np.array(self._get().best_lengths)

    def best_edge_lengths(self) -> np.ndarray:
        """The same of edges, where those are varied."""
        return np.array(self._get().best_edge_lengths)

    def best_section_scales(self) -> np.ndarray:
        """The same of sections, where those are varied: of each segment."""
        return np.array(self._get().best_section_scales)

    def change(self, *, surface: Any = None, targets: Any = None, flat_share: float | None = None,
               distance_weight: float | None = None, surface_weight: float | None = None,
               translation: Sequence[float] | None = None, rotation: Sequence[float] | None = None,
               scale: float | None = None, joint_weights: Any = None, placement: "Placement | None" = None) -> None:
        """Continues towards another goal; options that are not given stay. `targets`: in place of all there are. `translation`,
        `rotation`, `scale`: the new placement of the surface, all three; or `placement`, as info().placement with some of it
        replaced (dataclasses.replace). `joint_weights`: of each joint's distance to the surface; [] makes them all 1 again."""
        made = messages.ChangeDesignRequest(session=self.session.reference)
        set_given(made, {"flat_share": flat_share, "distance_weight": distance_weight,
                          "surface_weight": surface_weight})
        if targets is not None:
            made.targets.targets.extend(targets_of(targets, "targets", self.session.joint_count))
            made.targets.SetInParent()
        if surface is not None:
            made.surface.CopyFrom(surface_of(surface, "surface"))
        place = chosen_placement(placement, translation, rotation, scale)
        if place is not None:
            made.placement.CopyFrom(place)
        if joint_weights is not None:
            made.joint_surface_weights.weights.extend(checks.numeric(joint_weights, "joint_weights").ravel())
            made.joint_surface_weights.SetInParent()
        self.session.connection.call("change_design", made, timeout=max(60.0, self.session.connection.timeout))

    def pause(self) -> None:
        """When the current step is done; edits stay refused."""
        self.session.connection.call("pause_design", messages.PauseDesignRequest(session=self.session.reference))

    def resume(self) -> None:
        self.session.connection.call("resume_design", messages.ResumeDesignRequest(session=self.session.reference))

    def stop(self, timeout: float = 60.0) -> None:
        """The session goes back to the shape it had, and takes edits again; the best so far can still be taken.

        timeout: how long the current step may take to end [s] before LimberError TIMEOUT.
        """
        self.session.connection.call("stop_design", messages.StopDesignRequest(session=self.session.reference))
        self._wait_for_end(timeout)

    def _wait_for_end(self, timeout: float) -> None:
        given_up = time.monotonic() + timeout
        while self.info().state != "ended":
            if time.monotonic() > given_up:
                raise LimberError("TIMEOUT", f"the design has not ended {timeout:g} s after its stop was requested", "timeout")
            time.sleep(0.005)

    def take(self) -> int:
        """The best rest lengths become the session's: an edit, which undo() takes back. Its revision. A running design
        ends: edits are taken again."""
        response = self.session.connection.call("take_design", messages.TakeDesignRequest(session=self.session.reference))
        self.session.revision = max(self.session.revision, response.revision)
        self._wait_for_end(60.0)
        return response.revision

    def steps(self, timeout: float | None = None) -> Iterator[DesignInfo]:
        """How it stands after every step that arrives (newest first where they come too fast), until it ends.

        timeout: longest silence [s] before LimberError TIMEOUT; None: as long as the server lives.
        """
        with self.session.stream(timeout=timeout) as stream:
            if self.info().state == "ended":
                return
            for frames in stream:
                if frames.result.design is not None:
                    yield frames.result.design
                elif frames.result.final and self.info().state == "ended":
                    return

    def wait(self, progress: ProgressOption = None, timeout: float = 3600.0) -> DesignInfo:
        """Waits until it has ended and the session shows its result. Raises the error of its failure."""
        begun = time.monotonic()
        try:
            self.session.server.wait_job(self.info().job, progress, timeout)
        except LimberError as error:
            if error.code == "TIMEOUT":
                raise
        design = self._get().design
        if design.HasField("error"):
            raise from_message(design.error)
        info = DesignInfo.from_message(design)
        if info.taken is not None:
            self.session.revision = max(self.session.revision, info.taken)
            self.session.wait(info.taken, timeout=max(1.0, begun + timeout - time.monotonic()))
        return info

    def __repr__(self) -> str:
        return f"Design(of {self.session!r})"
