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
    "clients": {"proto", "base/checked_number.h"},  # a header that needs nothing to be linked
}
FORBIDDEN_IN_ENGINE = re.compile(r"zmq|boost/(?!polygon/)|google/protobuf|^proto/|sqlite|CLI/|iostream|cstdio|spdlog|\.pb\.h")
# Heavy dependencies and the only engine files that may see them.
PRIVATE = {"cholmod.h": "engine/base/numerics/", "Spectra/": "engine/bodies/", "pugixml.hpp": "engine/scene/",
           "boost/polygon/": "engine/rods/design/", "zlib.h": "engine/scene/", "nlohmann/": "engine/scene/",
           "xxhash.h": "engine/base/"}
# Kinds of sessions know the core and nothing of each other; the core knows no kind.
KINDS = ("bodies", "linkages", "beams")
SESSION_ROOM = re.compile(r"engine/session/(\w+)/")
# Rooms of the server, in which a kind knows what all kinds use and nothing of another; of the kinds, the service knows
# kind.h and the registry, and the registry alone their rooms. The command line has tools of single kinds.
SERVER = {
    "server/log": set(),
    "server/wire": set(),
    "server/store": {"server/log"},
    "server/transport": {"server/wire", "server/log"},
    "server/web": {"server/wire", "server/log", "server/transport"},
    "server/runtime": {"server/wire", "server/log", "server/store", "server/transport"},
    "server/kinds": {"server/wire", "server/log", "server/runtime"},
    "server/service": {"server/wire", "server/log", "server/store", "server/transport", "server/web", "server/runtime",
                       "server/kinds", "server/kinds/registry"},
}
KIND_ROOM = {"server/wire", "server/log", "server/runtime", "server/kinds"}
SERVER_KIND = re.compile(rf"server/kinds/({'|'.join(KINDS)})/")
# Of the engine a kind's room of the server knows the sessions of its kind, what these alone are about, and what all share;
# what kinds share knows no kind's sessions.
WINGS = {"bodies": {"bodies", "reduced", "spacetime"}, "linkages": {"rods"}, "beams": {"beams"}}
REGISTRY_ROOM = {"server/kinds", *(f"server/kinds/{kind}" for kind in KINDS)}
# A kind's folder of the C++ clients: nothing of another kind; what all kinds share knows none but where kinds are chosen,
# sources that are a room of their own, as the server's registry is.
CLIENT_KIND = re.compile(rf"clients/(?:cpp|cli)/({'|'.join(KINDS)})/")
CLIENTS_OF_ALL_KINDS = {"clients/cli/kinds.cpp", "clients/cli/main.cpp", "clients/cli/open_command.cpp",
                        "clients/cpp/scene_files.cpp"}
# Which kind a session or scene is of: asked by nobody but the kind itself.
BRANCH_ON_KIND = re.compile(
    r"(?:dynamic|static|reinterpret)_(?:pointer_)?cast<[^>]*(?:Record|(?:Body|Linkage|Beam)(?:Kind|Session|Opening))\b"
    r"|\bhas_(?:linkage|beams)\(\)"
    rf"|\b(?:kind|name)\(\)\)?\s*[!=]=\s*(?:std::string(?:_view)?[({{])?\"(?:{'|'.join(KINDS)})\""
    rf"|\"(?:{'|'.join(KINDS)})\"\s*[!=]=\s*[\w.:>(-]*\b(?:kind|name)\(\)")
ROOM_OF_KIND = re.compile(rf"(?:server/kinds|clients/cpp|clients/cli)/({'|'.join(KINDS)})/")
NAMES_OF_KIND = {"bodies": ("body", "bodies"), "linkages": ("linkage",), "beams": ("beam",)}
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
            if path.startswith("engine/") and included.startswith(name) and path.endswith(".h") and \
                    not included.endswith("_fwd.hpp"):  # which declares names alone
                faults.append(f"{path}: <{included}> must stay out of headers")
        if included == "sqlite3.h" and not path.startswith(("engine/", "server/store/")):
            faults.append(f"{path}: <{included}> is private to server/store/")
        if not re.match(r"(engine|server|clients|bench|tests|examples|limber)/", included):
            continue
        own_room, other_room = SESSION_ROOM.match(path), SESSION_ROOM.match(included)
        if own_room and other_room and other_room[1] in KINDS and other_room[1] != own_room[1]:
            faults.append(f"{path}: {own_room[1]} of sessions must not include {included}")
        if path.startswith("server/") and included.startswith("server/"):
            faults += faults_of_rooms(path, included)
        if path.startswith("server/") and included.startswith("engine/"):
            faults += faults_of_engine_in_server(path, included)
        if path.startswith("clients/"):
            faults += faults_of_clients(path, included)
        other = part_of(included)
        allowed = ENGINE.get(own, OUTSIDE.get(own))
        if allowed is None or other == own:
            continue
        if other in allowed or included.removeprefix("engine/") in allowed:
            continue
        faults.append(f"{path}: {own} must not include {included}")
    return faults


def server_rooms(path: str) -> "set[str] | None":
    """Those that a file of the server may include besides its own; None: all."""
    room = room_of(path)
    if room == "server/kinds/registry":
        return REGISTRY_ROOM
    if room.startswith("server/kinds/"):
        return KIND_ROOM
    return SERVER.get(room)


def faults_of_rooms(path: str, included: str) -> list[str]:
    allowed, other = server_rooms(path), room_of(included)
    if allowed is None or other == room_of(path) or other in allowed:
        return []
    return [f"{path}: {room_of(path)} must not include {included}"]


def faults_of_engine_in_server(path: str, included: str) -> list[str]:
    own, session, wing = SERVER_KIND.match(path), SESSION_ROOM.match(included), part_of(included)
    if own:
        others = set().union(*(WINGS[kind] for kind in KINDS if kind != own[1])) - WINGS[own[1]]
        if wing in others or (session and session[1] in KINDS and session[1] != own[1]):
            return [f"{path}: {own[1]} of the server must not include {included}"]
    elif session and session[1] in KINDS and not path.startswith("server/cli/"):
        return [f"{path}: what kinds share must not include {included}"]
    return []


def faults_of_clients(path: str, included: str) -> list[str]:
    own, other = CLIENT_KIND.match(path), CLIENT_KIND.match(included)
    if path.startswith("clients/cpp/") and included.startswith("clients/cli/"):
        return [f"{path}: the library must not include {included}"]
    if not other or path in CLIENTS_OF_ALL_KINDS or (own and own[1] == other[1]):
        return []
    return [f"{path}: {own[1] if own else 'what kinds share'} must not include {included}"]


def branches_on_kinds(path: str, text: str) -> list[str]:
    if not path.startswith(("server/", "clients/")):
        return []
    own = ROOM_OF_KIND.match(path)
    names = NAMES_OF_KIND[own[1]] if own else ()
    return [f"{path}: asks for a kind: {found[0]}" for found in BRANCH_ON_KIND.finditer(text)
            if not any(name in found[0].lower() for name in names)]


def cycles(files: dict[str, str]) -> list[str]:
    """Cycles between headers, each named by the one whose include closes it."""
    graph = {path: [i for i in INCLUDE.findall(text) if i in files] for path, text in files.items()}
    state: dict[str, int] = {}
    found = []

    def visit(node: str, trail: list[str]) -> None:
        state[node] = 1
        for target in graph[node]:
            if state.get(target) == 1:
                found.append(f"{node}: include cycle: " + " -> ".join(trail[trail.index(target):] + [target]))
            elif target not in state:
                visit(target, trail + [target])
        state[node] = 2

    for path in sorted(graph):
        if path not in state:
            visit(path, [path])
    return found


def room_of(path: str) -> str:
    """Its folder; the server's registry of kinds is a room of its own, and so is where clients choose kinds."""
    folder, name = path.rsplit("/", 1)
    if (folder == "server/kinds" and name.startswith("registry.")) or path in CLIENTS_OF_ALL_KINDS:
        return f"{folder}/registry"
    return folder


def room_cycles(files: dict[str, str], top: str) -> list[str]:
    """Folders below `top` that include each other, directly or round about: the includes that lead out and back."""
    files = {path: text for path, text in files.items() if path.startswith(top)}
    ways = [(path, included) for path, text in files.items() for included in INCLUDE.findall(text)
            if included.startswith(top) and room_of(included) != room_of(path)]
    rooms: dict[str, set[str]] = {}
    for path, included in ways:
        rooms.setdefault(room_of(path), set()).add(room_of(included))

    def reached_from(start: str) -> set[str]:
        reached, waiting = {start}, [start]
        while waiting:
            fresh = rooms.get(waiting.pop(), set()) - reached
            reached |= fresh
            waiting += fresh
        return reached

    reached = {room: reached_from(room) for room in {room_of(included) for _, included in ways}}
    return [f"{path}: room cycle through {room_of(path)}, by {included}"
            for path, included in sorted(ways) if room_of(path) in reached[room_of(included)]]


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
    for top in ("engine", "server", "clients", "tests", "bench", "examples"):
        for path in sorted((root / top).rglob("*")):
            if path.suffix in (".h", ".cpp") and "node_modules" not in path.parts:
                files[path.relative_to(root).as_posix()] = path.read_text(encoding="utf-8")
    faults = [fault for path, text in files.items() for fault in faults_of_file(path, text)]
    faults += [fault for path, text in files.items() for fault in branches_on_kinds(path, text)]
    for top in ("engine/", "server/", "clients/", "tests/", "bench/", "examples/"):
        faults += room_cycles(files, top)
    engine = {path: text for path, text in files.items() if path.startswith("engine/")}
    headers = {path: text for path, text in files.items() if path.endswith(".h")}
    return faults + heavy_scene_headers(engine) + cycles(headers)


if __name__ == "__main__":
    faults = check(pathlib.Path(sys.argv[1]))
    print("\n".join(faults) or "include graph: as drawn")
    sys.exit(1 if faults else 0)
