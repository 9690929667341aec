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


def room_cycles(files: dict[str, str]) -> list[str]:
    """Folders of engine/ that include each other, directly or round about."""
    rooms: dict[str, set[str]] = {}
    for path, text in files.items():
        others = {room_of(i) for i in INCLUDE.findall(text) if i.startswith("engine/")} - {room_of(path)}
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


def check(root: pathlib.Path) -> list[str]:
    files = {}
    for top in ("engine", "server", "clients"):
        for path in sorted((root / top).rglob("*")):
            if path.suffix in (".h", ".cpp") and "node_modules" not in path.parts:
                files[path.relative_to(root).as_posix()] = path.read_text(encoding="utf-8")
    faults = [fault for path, text in files.items() for fault in faults_of_file(path, text)]
    engine = {path: text for path, text in files.items() if path.startswith("engine/")}
    return faults + room_cycles(engine) + cycles({p: t for p, t in engine.items() if p.endswith(".h")})


if __name__ == "__main__":
    faults = check(pathlib.Path(sys.argv[1]))
    print("\n".join(faults) or "include graph: as drawn")
    sys.exit(1 if faults else 0)
