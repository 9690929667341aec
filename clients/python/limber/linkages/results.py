"""Results of sessions of rod linkages, and the equilibria along the path to them."""

from __future__ import annotations

from dataclasses import dataclass

from ..messages import service
from ..results import Result
from .designs import DesignInfo

EVENTS = {service.BRANCH_EVENT_BRANCHING: "branching", service.BRANCH_EVENT_LIMIT_POINT: "limit_point",
          service.BRANCH_EVENT_JUMP: "jump"}


@dataclass(frozen=True)
class LinkageStep:
    """An equilibrium along the path from one to the next; each is a frame."""

    progress: float    # share of the path, 0 .. 1
    mean_angle: float  # [degree]
    energy: float      # elastic [J]
    iterations: int
    # "": nothing happened. "branching": the branch lost its stability, the path continues on a stable one beside it.
    # "limit_point": it ended, "jump": it was lost; the shape jumped to another.
    event: str

    def __str__(self) -> str:
        return f"at {100 * self.progress:.4g} % of the path, near a mean angle of {self.mean_angle:.4g} degrees"


@dataclass(frozen=True)
class LinkageResult(Result):
    """One published shape of a linkage. For a result that is not final, the mean angle alone is known."""

    stretching_energy: float = 0.0  # of the rods [J]
    bending_energy: float = 0.0
    twisting_energy: float = 0.0
    spring_energy: float = 0.0      # of the springs to targets [J]
    load_potential: float = 0.0     # of forces, torques and weight [J]
    mean_angle: float = 0.0         # of all joints [degree]
    steps: int = 0                  # equilibria along the path
    negative_eigenvalues: int = 0   # directions in which the equilibrium is unstable
    mean_angle_moment: float = 0.0  # on every joint, holds the mean angle [N m]
    path: tuple[LinkageStep, ...] = ()  # of a final result, one for each of its frames; empty if none is new
    design: DesignInfo | None = None    # of a step of a design: its frames are the flat shape and the deployed one

    @property
    def events(self) -> tuple[LinkageStep, ...]:
        """Places on the path at which the branch of equilibria changed."""
        return tuple(step for step in self.path if step.event)

    @property
    def snaps(self) -> tuple[LinkageStep, ...]:
        """Those of the events at which the shape jumped to another."""
        return tuple(step for step in self.path if step.event in ("limit_point", "jump"))

    @staticmethod
    def from_message(info: "service.ResultInfo") -> "LinkageResult":
        more = info.linkage
        return LinkageResult(**vars(Result.from_message(info)), stretching_energy=more.stretching_energy,
                             bending_energy=more.bending_energy, twisting_energy=more.twisting_energy,
                             spring_energy=more.spring_energy, load_potential=more.load_potential,
                             mean_angle=more.mean_angle_degrees, steps=more.steps,
                             negative_eigenvalues=more.negative_eigenvalues, mean_angle_moment=more.mean_angle_moment,
                             path=tuple(LinkageStep(step.progress, step.mean_angle_degrees, step.energy,
                                                    step.iterations, EVENTS.get(step.event, "")) for step in more.path),
                             design=DesignInfo.from_message(info.design) if info.HasField("design") else None)
