"""Goals: figures that the project claims or wants, against what a report measured.

goals.json is a list of objects:

    key        unique, for people who talk about it
    text       the promise, one line
    run        id of the run that measures it (raw/ID.json)
    where      values that its rows have (rows.matches)
    value      the compared field; "over": its divisor, another field
    scale      its factor, e.g. 100 from parts to percent; 1
    absolute   true: its size counts, not its sign
    reduce     of several rows: "max", "min" or "median"; "exponent": of a power law of value over the field "by";
               without it there must be a single row
    direction  "at most" or "at least"
    target     the number
    unit       of both
    claimed    the file that claims it, "here" where this row is the claim, "goal" if the project wants it and does not
               claim to have it
"""

from __future__ import annotations

import json
import statistics
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any, Optional

import fits
import rows
from rows import Raw

REDUCE = {"max": max, "min": min, "median": statistics.median}
REQUIRED = ("key", "text", "run", "where", "value", "direction", "target", "unit", "claimed")
OPTIONAL = ("over", "scale", "absolute", "reduce", "by")
PATH = Path(__file__).with_name("goals.json")


class Outcome(Enum):
    MET = "met"
    MISSED = "missed"
    NOT_MEASURED = "not measured"


@dataclass
class Judged:
    """A goal and its measurement. measured: None if its run is no part of this report, or failed."""

    goal: "dict[str, Any]"
    measured: Optional[float]
    outcome: Outcome
    why: str = ""  # it was not measured


def check(goal: "dict[str, Any]") -> None:
    """Raises ValueError, naming the goal and the field, for one that is not as described above."""
    name = goal.get("key", "a goal without key")
    for field in REQUIRED:
        if field not in goal:
            raise ValueError(f"{name}: there is no {field}")
    for field in goal:
        if field not in REQUIRED + OPTIONAL:
            raise ValueError(f"{name}: there is no field {field}")
    if goal["direction"] not in ("at most", "at least"):
        raise ValueError(f"{name}: direction is {goal['direction']!r}, must be 'at most' or 'at least'")
    reduce = goal.get("reduce")
    if reduce is not None and reduce != "exponent" and reduce not in REDUCE:
        raise ValueError(f"{name}: reduce is {reduce!r}, must be one of {', '.join([*REDUCE, 'exponent'])}")
    if (reduce == "exponent") != ("by" in goal):
        raise ValueError(f"{name}: 'by' belongs to reduce 'exponent'")
    if not isinstance(goal["target"], (int, float)) or isinstance(goal["target"], bool):
        raise ValueError(f"{name}: target must be a number")


def load(path: Path = PATH) -> "list[dict[str, Any]]":
    """All goals, checked. Raises ValueError."""
    goals = json.loads(path.read_text())
    for goal in goals:
        check(goal)
    keys = [goal["key"] for goal in goals]
    for key in keys:
        if keys.count(key) > 1:
            raise ValueError(f"{key}: there are two goals of this key")
    return goals


def measure(goal: "dict[str, Any]", raw: Raw) -> float:
    """The number that a goal is about. Raises LookupError where the run or its rows do not have it."""
    if goal["run"] not in raw.cases:
        state = "failed" if goal["run"] in raw.failed else "is no part of this report"
        raise LookupError(f"the run {goal['run']} {state}")
    chosen = rows.select(raw.cases[goal["run"]], goal["where"])
    if not chosen:
        raise LookupError(f"the run {goal['run']} has no such row")
    for key, wanted in goal["where"].items():
        for value in wanted if isinstance(wanted, list) else []:
            if not any(row.get(key) == value for row in chosen):
                raise LookupError(f"the run {goal['run']} has no such row of {key} {value}")
    values = []
    for row in chosen:
        value = row.get(goal["value"])
        if value is None:
            raise LookupError(f"a row of {goal['run']} has no {goal['value']}")
        if "over" in goal:
            divisor = row.get(goal["over"])
            if not divisor:
                raise LookupError(f"a row of {goal['run']} has no {goal['over']}")
            value /= divisor
        value = float(value) * goal.get("scale", 1)
        values.append(abs(value) if goal.get("absolute") else value)
    reduce = goal.get("reduce")
    if reduce == "exponent":
        try:
            return fits.fit([row[goal["by"]] for row in chosen], values).exponent
        except ValueError as error:
            raise LookupError(str(error)) from error
    if reduce is None and len(values) > 1:
        raise LookupError(f"{len(values)} rows of {goal['run']} fit, and the goal does not say how to reduce them")
    return float(REDUCE[reduce](values)) if reduce else values[0]


def judge(goal: "dict[str, Any]", raw: Raw) -> Judged:
    try:
        measured = measure(goal, raw)
    except LookupError as error:
        return Judged(goal, None, Outcome.NOT_MEASURED, str(error.args[0]))
    # Not a number is missed, whatever the direction.
    met = measured <= goal["target"] if goal["direction"] == "at most" else measured >= goal["target"]
    return Judged(goal, measured, Outcome.MET if met else Outcome.MISSED)
