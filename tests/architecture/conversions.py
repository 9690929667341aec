#!/usr/bin/env python3
"""Finds numbers of an input that are made integers without a check. Exit code 1 and one line per fault.

A cast keeps the lower bits of a number that the type cannot hold: a vertex 2^32 becomes vertex 0, or passes as an int and is
used as a size_t. engine/base/checked_number.h has the functions that refuse it: to_whole() and parse_number().
"""

import pathlib
import re
import sys

CHECKED = "engine/base/checked_number.h"
# In all sources: conversions that cut off, stop in the middle of a text, or say nothing of a number beyond the type.
EVERYWHERE = {
    r"\bstd::sto(?:i|l|ul|ll|ull|f|d|ld)\s*\(": "parse_number()",
    r"\b(?:std::)?(?:strto(?:l|ul|ll|ull|imax|umax)|ato[ilf]|atoll|[sf]?scanf)\s*\(": "parse_number()",
    r"\bfrom_chars\s*\(": "parse_number()",
    r"\.(?:get|get_to|value|as)<\s*(?:const\s+)?(?:std::)?(?:u?int\w*|size_t|ptrdiff_t|short|long|unsigned|char)[\w\s]*>": "get_ptr<>() and to_whole()",
    r"\.as_(?:u?int|u?llong)\s*\(": "parse_number()",
    r"\blexical_cast\s*<": "parse_number()",
}
# A number within a longer text, as far as it goes.
EXCEPT = {r"\bfrom_chars\s*\(": {CHECKED, "engine/scene/formats/text_cursor.cpp"}}
# What reads bytes: here a cast to a narrow type is for numbers that are no input, of the forms below.
READERS = ("engine/scene/formats/", "engine/reduced/model_file.", "server/kinds/", "server/wire/", "server/runtime/", "server/service/",
           "server/transport/", "server/web/", "server/cli/", "clients/cpp/", "clients/cli/")
NARROW = re.compile(r"static_cast<\s*((?:std::)?(?:int|short|unsigned short|int8_t|int16_t|int32_t|uint8_t|uint16_t))\s*>\s*\(")
# Of clients alone: servers write numbers of their own into messages so, all of them counts and indices of what they hold. A
# std::size_t holds what any field of a message does.
UNSIGNED = re.compile(r"static_cast<\s*(unsigned(?: int)?|(?:std::)?uint32_t)\s*>\s*\(")
NO_INPUT = re.compile(
    r"(?!(?:message|request|given|stored|source|changes)\b)[\w.>()\[\]*{}:-]*\b(?:size|rows|cols|count|edge_count|basis_size)\(\)(?: / 3)?"  # of containers and values of our own
    r"|[a-z]|block"  # a counter
    r"|fraction \* 10|std::lround\(kWidth \* fraction\)"  # of a bar, clamped
    r"|message\.size\(\)"  # of bytes from a socket
    r"|std::clamp\b.*|\w+\.clamp\b.*"
    r"|sizeof\b.*|k[A-Z]\w*|\w+::k[A-Z]\w*|row\.proto|wire|expected|report\.basis"  # enumerators
    r"|alphabet\[.*|text\[i\]|character|.*Number\{65535\}.*", re.DOTALL)  # bytes, levels


def argument(text: str, begin: int) -> str:
    """What stands between the bracket before `begin` and the one that closes it."""
    depth = 1
    for end in range(begin, len(text)):
        depth += {"(": 1, ")": -1}.get(text[end], 0)
        if depth == 0:
            return " ".join(text[begin:end].split())
    return text[begin:]


def without_comments(text: str) -> str:
    return re.sub(r"//[^\n]*", lambda found: " " * len(found[0]), text)


def faults_of_file(path: str, text: str) -> list[str]:
    text = without_comments(text)
    faults = []

    def add(found: re.Match, instead: str) -> None:
        line = text.count("\n", 0, found.start()) + 1
        faults.append(f"{path}:{line}: {' '.join(found[0].split())}...: use {instead} of {CHECKED}")

    for pattern, instead in EVERYWHERE.items():
        if path in EXCEPT.get(pattern, ()):
            continue
        for found in re.finditer(pattern, text):
            add(found, instead)
    if path.startswith(READERS):
        casts = [*NARROW.finditer(text), *(UNSIGNED.finditer(text) if path.startswith("clients/") else ())]
        for found in casts:
            if not NO_INPUT.fullmatch(argument(text, found.end())):
                add(found, f"to_whole<{found[1]}>()")
    return faults


def check(root: pathlib.Path) -> list[str]:
    faults = []
    for top in ("engine", "server", "clients", "proto"):
        for path in sorted((root / top).rglob("*")):
            if path.suffix in (".h", ".cpp") and "node_modules" not in path.parts:
                faults += faults_of_file(path.relative_to(root).as_posix(), path.read_text(encoding="utf-8"))
    return faults


if __name__ == "__main__":
    faults = check(pathlib.Path(sys.argv[1]))
    print("\n".join(faults) or "conversions: all are checked")
    sys.exit(1 if faults else 0)
