"""Results of sessions of structures of beams."""

from __future__ import annotations

from dataclasses import dataclass

from ..messages import service
from ..results import Result
from . import solutions
from .solutions import BeamNeutralDirection, BeamSnap


@dataclass(frozen=True)
class BeamResult(Result):
    """One published shape of a structure of beams. For a result that is not final, nothing more is known than the shape.
    `status`: "CONVERGED", "STALLED", "SADDLE" (balanced, but unstable), "UNBALANCED" (a mechanism), "ITERATION_LIMIT",
    "CANCELLED"; energy: elastic [J]."""

    method: str = ""            # of the answer: "newton" follows the branch, "relaxation_then_newton" does not
    load_steps: int = 0
    relaxation_steps: int = 0
    load_factor: float = 0.0    # share of the path that was passed
    node: int | None = None     # that moves most freely or is worst balanced
    utilisation: float = 0.0    # the largest
    largest_bend: float = 0.0   # between an end and its chord [radian]; above 0.5 the elements are too long
    steps: int = 0              # frames of a final result: shapes along the path, the shape itself last
    snaps: tuple[BeamSnap, ...] = ()
    negative_eigenvalues: int | None = None  # of the stiffness: 0 at a minimum; None where nothing balances
    neutral_directions: tuple[BeamNeutralDirection, ...] = ()
    unjudged_elements: tuple[int, ...] = ()  # too long to show how they buckle: their stability is not judged

    @staticmethod
    def from_message(info: "service.ResultInfo") -> "BeamResult":
        more = info.beams
        method = {number: name for name, number in solutions.METHODS.items()}.get(more.method, "")
        return BeamResult(**vars(Result.from_message(info)), method="" if method == "choose" else method,
                          load_steps=more.load_steps, relaxation_steps=more.relaxation_steps,
                          load_factor=more.load_factor, node=more.node if more.HasField("node") else None,
                          utilisation=more.largest_utilisation, largest_bend=more.largest_bend, steps=more.steps,
                          snaps=solutions.snaps_of(more.snaps),
                          negative_eigenvalues=solutions.negative_eigenvalues_of(more),
                          neutral_directions=solutions.neutral_directions_of(more),
                          unjudged_elements=tuple(more.unjudged_elements))
