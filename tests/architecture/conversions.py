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
    r"\bsqlite3_(?:column|value)_int\s*\(": "sqlite3_column_int64() and to_whole()",
}
# A number within a longer text, as far as it goes.
EXCEPT = {r"\bfrom_chars\s*\(": {CHECKED, "engine/scene/formats/text_cursor.cpp"}}
# What reads bytes, or takes what they held up to where it is solved: here a cast to a narrow type is for numbers that are no input, of the forms below.
READERS = ("engine/scene/formats/", "engine/reduced/model_file.", "engine/session/", "server/kinds/", "server/wire/", "server/runtime/", "server/service/",
           "server/store/", "server/transport/", "server/web/", "server/cli/", "clients/cpp/", "clients/cli/")
NARROW = re.compile(r"static_cast<\s*((?:std::)?(?:int|short|unsigned short|int8_t|int16_t|int32_t|uint8_t|uint16_t))\s*>\s*\(")
# Of a whole matrix. What a template is made with is not seen here: only these are no integers.
MATRIX = re.compile(r"(?:\.|->)\s*(?:template\s+)?cast<\s*(?!(?:float|double|long double)\s*>)([\w:\s]+?)\s*>\s*\(")
MATRIX_OF = {("server/wire/frames.cpp", "Number")}  # float or double, of positions that are sent
# Of clients and the store alone: servers write numbers of their own into messages so, all of them counts and indices of what they hold. A
# std::size_t holds what any field of a message does.
UNSIGNED = re.compile(r"static_cast<\s*(unsigned(?: int)?|(?:std::)?uint32_t)\s*>\s*\(")
NO_INPUT = re.compile(
    r"(?!(?:message|request|given|stored|source|changes)\b)[\w.>()\[\]*{}:-]*\b(?:size|rows|cols|count|edge_count|basis_size|tet_count)\(\)(?: / 3)?"  # of containers and values of our own
    r"|[a-z]|block"  # a counter
    r"|fraction \* 10|std::lround\(kWidth \* fraction\)"  # of a bar, clamped
    r"|message\.size\(\)"  # of bytes from a socket
    r"|std::clamp\b.*|\w+\.clamp\b.*"
    r"|sizeof\b.*|k[A-Z]\w*|\w+::k[A-Z]\w*|row\.proto|wire|expected|report\.basis"  # enumerators
    r"|alphabet\[.*|text\[i\]|character|.*Number\{65535\}.*", re.DOTALL)  # bytes, levels
# Casts that have another form and convert no input either: why -> file -> what is cast.
OWN = {
    "a place within a container of our own, whose length is an int": {
        "engine/session/beams/remarks.cpp": ("at_node[i]", "at_node[j]"),
        "engine/session/bodies/exact.cpp": ("columns",),
        "engine/session/bodies/frame_steps.cpp": ("chosen[static_cast<std::size_t>(at)]",),
        "engine/session/bodies/full_body.cpp": ("most > 1 ? i * (frames - 1) / (most - 1) : 0", "at - frames.begin()"),
        "engine/session/bodies/motion_check.cpp": ("(last * i + (most - 1) / 2) / (most - 1)", "farthest", "at - shown.frames.begin()"),
        "engine/session/bodies/start_search.cpp": ("ended.size() - optima.size()",),
        "engine/session/linkages/files.cpp": ("least", "most"),
        "engine/session/linkages/live_design.cpp": ("middle",),
    },
    "the number of modes or frames of a matrix that was computed": {
        "engine/session/bodies/problem_mapping.cpp": ("count",),
        "engine/session/bodies/recovery.cpp": ("ahead", "elastic"),
    },
    "at most the frames of the motion, an int; a reach is in (0, 1e6] s: check_path()": {
        "engine/session/bodies/live_problem.cpp": (
            "std::min(*constraint.reach * frames_per_second_ + 0.5, static_cast<double>(terms_.frame_count))",),
    },
    "growth is in (1, 10]: ModeChoiceOptions::validate(); modes are at most those of a mesh": {
        "engine/session/bodies/mode_chooser.cpp": ("std::ceil(options_.growth * now.modes)", "std::floor(last.modes / options_.growth)"),
    },
    "at most `starts`, an int": {
        "engine/session/bodies/start_search.cpp": ("std::min<std::int64_t>(starts, in_order + 1)",),
    },
    "at most 1e6; the root of an error that is known over a tolerance that is positive": {
        "engine/session/linkages/edge_choice.cpp": ("std::min(wanted, 1e6)",),
    },
    "sizes are 0.1 to 10 times those drawn, ConditionRules::check(): at most 99 / kStep": {
        "engine/session/linkages/size_path.cpp": ("std::ceil(change / kStep)",),
    },
}


def own_of(path: str) -> "set[str]":
    return {cast for files in OWN.values() for cast in files.get(path, ())}


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
        casts = [*NARROW.finditer(text), *(UNSIGNED.finditer(text) if path.startswith(("clients/", "server/store/")) else ())]
        own = own_of(path)
        seen = set()
        for found in casts:
            cast = argument(text, found.end())
            seen.add(cast)
            if cast not in own and not NO_INPUT.fullmatch(cast):
                add(found, f"to_whole<{found[1]}>()")
        faults += [f"tests/architecture/conversions.py: there is no cast of {cast} in {path} any more" for cast in sorted(own - seen)]
        for found in MATRIX.finditer(text):
            if (path, found[1]) not in MATRIX_OF:
                add(found, f"to_whole<{found[1]}>() for each number, as")
    return faults


def check(root: pathlib.Path) -> list[str]:
    named = {path for files in OWN.values() for path in files} | {path for path, _ in MATRIX_OF}
    faults = [f"tests/architecture/conversions.py: there is no {path} any more" for path in sorted(named) if not (root / path).exists()]
    for top in ("engine", "server", "clients", "proto"):
        for path in sorted((root / top).rglob("*")):
            if path.suffix in (".h", ".cpp") and "node_modules" not in path.parts:
                faults += faults_of_file(path.relative_to(root).as_posix(), path.read_text(encoding="utf-8"))
    return faults


if __name__ == "__main__":
    faults = check(pathlib.Path(sys.argv[1]))
    print("\n".join(faults) or "conversions: all are checked")
    sys.exit(1 if faults else 0)
