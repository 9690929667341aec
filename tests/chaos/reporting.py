"""How the scripts of this folder give out what they found."""

import json
from pathlib import Path


def give_out(result, file, more=None):
    """Prints `result` as one JSON object, and writes it to `file` where one is given, with what `more` adds."""
    print(json.dumps(result))
    if file:
        Path(file).write_text(json.dumps({**result, **(more or {})}) + "\n")


def end_with(result, file, more=None):
    """The same at the end of a script. @returns its exit code: 1 where there are faults"""
    give_out(result, file, more)
    return 1 if result["faults"] else 0
