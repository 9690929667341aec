#!/usr/bin/env python3
"""Checks who includes whom against the table of CONTRIBUTING.md. Exit code 1 and one line per fault."""

import pathlib
import re
import sys

# part -> parts it may include (itself always).
ENGINE = {
    "base": set(),
    "bodies": {"base"},
    "reduced": {"base", "bodies"},
    "spacetime": {"base", "reduced/kinematics.h"},
    "rods": {"base"},
    "beams": {"base"},
    "scene": {"base", "bodies", "rods/linkage/line_mesh.h", "rods/linkage/state_numbers.h", "rods/rod/length_weights.h", "rods/section/section.h"},
    "session": {"base", "bodies", "reduced", "spacetime", "rods", "beams", "scene"},
}
OUTSIDE = {
    "server": {"session", "scene", "bodies", "reduced", "spacetime", "rods", "beams", "base", "proto"},
    "clients": {"proto"},
}
FORBIDDEN_IN_ENGINE = re.compile(r"zmq|boost/(?!polygon/)|google/protobuf|^proto/|sqlite|CLI/|iostream|cstdio|spdlog|\.pb\.h")
# Heavy dependencies and the only engine files that may see them.
PRIVATE = {"cholmod.h": "engine/base/numerics/", "Spectra/": "engine/bodies/", "pugixml.hpp": "engine/scene/",
           "boost/polygon/": "engine/rods/design/", "zlib.h": "engine/scene/", "nlohmann/": "engine/scene/",
           "xxhash.h": "engine/base/"}
# Kinds of sessions know the core and nothing of each other; the core knows no kind.
KINDS = ("bodies", "linkages", "beams")
SESSION_ROOM = re.compile(r"engine/session/(\w+)/")
# Headers of scenes are plain values: what they bring along must not contain these.
NOT_FOR_SCENES = {"engine/bodies/full_dynamics.h", "engine/bodies/simulation.h", "engine/base/numerics/sparse_cholesky.h"}
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.MULTILINE)


def part_of(path: str) -> str:
    pieces = path.split("/")
    if pieces[0] == "engine":
        return pieces[1]
    if pieces[0] == "limber" or path.endswith(".pb.h"):
        return "proto"
    return pieces[0]


def faults_of_file(path: str, text: str) -> list[str]:
    own = part_of(path)
    faults = []
    for included in INCLUDE.findall(text):
        if path.startswith("engine/") and FORBIDDEN_IN_ENGINE.search(included):
            faults.append(f"{path}: engine/ must not include <{included}>")
        for name, home in PRIVATE.items():
            if path.startswith("engine/") and included.startswith(name) and not path.startswith(home):
                faults.append(f"{path}: <{included}> is private to {home}")
            if path.startswith("engine/") and included.startswith(name) and path.endswith(".h"):
                faults.append(f"{path}: <{included}> must stay out of headers")
        if not re.match(r"(engine|server|clients|bench|limber)/", included):
            continue
        own_room, other_room = SESSION_ROOM.match(path), SESSION_ROOM.match(included)
        if own_room and other_room and other_room[1] in KINDS and other_room[1] != own_room[1]:
            faults.append(f"{path}: {own_room[1]} of sessions must not include {included}")
        other = part_of(included)
        allowed = ENGINE.get(own, OUTSIDE.get(own))
        if allowed is None or other == own:
            continue
        if other in allowed or included.removeprefix("engine/") in allowed:
            continue
        faults.append(f"{path}: {own} must not include {included}")
    return faults


def cycles(files: dict[str, str]) -> list[str]:
    """Cycles between files of engine/ (header level) and so between its rooms."""
    graph = {path: [i for i in INCLUDE.findall(text) if i in files] for path, text in files.items()}
    state: dict[str, int] = {}
    found = []

    def visit(node: str, trail: list[str]) -> None:
        state[node] = 1
        for target in graph[node]:
            if state.get(target) == 1:
                found.append("include cycle: " + " -> ".join(trail[trail.index(target):] + [target])
                             if target in trail else f"include cycle at {target}")
            elif target not in state:
                visit(target, trail + [target])
        state[node] = 2

    for path in sorted(graph):
        if path not in state:
            visit(path, [path])
    return found


def room_of(path: str) -> str:
    return path.rsplit("/", 1)[0]


def room_cycles(files: dict[str, str], top: str) -> list[str]:
    """Folders below `top` that include each other, directly or round about."""
    rooms: dict[str, set[str]] = {}
    for path, text in files.items():
        others = {room_of(i) for i in INCLUDE.findall(text) if i.startswith(top)} - {room_of(path)}
        rooms.setdefault(room_of(path), set()).update(others)
    faults = []
    for start in sorted(rooms):
        reached, waiting = set(), [start]
        while waiting:
            fresh = rooms.get(waiting.pop(), set()) - reached
            reached |= fresh
            waiting += fresh
        if start in reached:
            faults.append(f"room cycle through {start}")
    return faults


def brought_along(start: str, files: dict[str, str]) -> set[str]:
    """All that a header includes, directly or round about."""
    reached, waiting = set(), [start]
    while waiting:
        fresh = {i for i in INCLUDE.findall(files.get(waiting.pop(), ""))} - reached
        reached |= fresh
        waiting += fresh
    return reached


def heavy_scene_headers(files: dict[str, str]) -> list[str]:
    return [f"{path}: plain values must not bring {heavy} along"
            for path in sorted(files) if re.fullmatch(r"engine/scene/[^/]+\.h", path)
            for heavy in sorted(brought_along(path, files) & NOT_FOR_SCENES)]


def check(root: pathlib.Path) -> list[str]:
    files = {}
    for top in ("engine", "server", "clients", "tests"):
        for path in sorted((root / top).rglob("*")):
            if path.suffix in (".h", ".cpp") and "node_modules" not in path.parts:
                files[path.relative_to(root).as_posix()] = path.read_text(encoding="utf-8")
    faults = [fault for path, text in files.items() for fault in faults_of_file(path, text)]
    engine = {path: text for path, text in files.items() if path.startswith("engine/")}
    headers = {path: text for path, text in files.items() if path.endswith(".h")}
    return (faults + room_cycles(engine, "engine/") +
            room_cycles({path: text for path, text in files.items() if path.startswith("tests/")}, "tests/") +
            heavy_scene_headers(engine) + cycles(headers))


if __name__ == "__main__":
    faults = check(pathlib.Path(sys.argv[1]))
    print("\n".join(faults) or "include graph: as drawn")
    sys.exit(1 if faults else 0)
