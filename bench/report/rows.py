"""Output of `limber-bench report`: the report's own file and the rows of each run."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, Iterable

Row = Dict[str, Any]


@dataclass
class Raw:
    """raw/report.json and the rows of the runs that it names.

    report: machine, commit, load, and of each run its id, suite, arguments, seconds and exit code.
    cases: rows by the run's id; only of runs that succeeded.
    """

    report: "dict[str, Any]"
    cases: "dict[str, list[Row]]"

    @property
    def failed(self) -> "list[str]":
        """Ids of runs that failed."""
        return [run["id"] for run in self.report["runs"] if run["id"] not in self.cases]


def load(folder: Path) -> Raw:
    """The raw data in a folder. Raises OSError or ValueError if report.json is missing or has another form."""
    report = json.loads((folder / "report.json").read_text())
    for key in ("machine", "commit", "runs"):
        if key not in report:
            raise ValueError(f"{folder / 'report.json'}: there is no {key}")
    cases = {}
    for run in report["runs"]:
        path = folder / f"{run['id']}.json"
        if run["status"] == 0 and path.is_file():
            cases[run["id"]] = json.loads(path.read_text())["cases"]
    return Raw(report, cases)


def matches(row: Row, where: "dict[str, Any]") -> bool:
    """Whether a row has these values; a list names several that will do, {"at least": x} or {"at most": x} a bound."""
    for key, wanted in where.items():
        value = row.get(key)
        if isinstance(wanted, list):
            if value not in wanted:
                return False
        elif isinstance(wanted, dict):
            if isinstance(value, bool) or not isinstance(value, (int, float)):
                return False
            if value < wanted.get("at least", value) or value > wanted.get("at most", value):
                return False
        elif value != wanted:
            return False
    return True


def select(rows: "Iterable[Row]", where: "dict[str, Any]") -> "list[Row]":
    """The rows that have these values, in their order."""
    return [row for row in rows if matches(row, where)]
