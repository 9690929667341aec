#!/usr/bin/env python3
"""The include-graph check must be able to fail: a small tree with faults of each kind, of which each must be named by a line of
its own with its file, and nothing else may be named."""

import pathlib
import sys
import tempfile

import include_graph


def include(*names: str) -> str:
    return "".join(f'#include "{name}"\n' for name in names)


PRIVATE = (("cholmod.h", "engine/base/numerics/"), ("Spectra/SymEigsSolver.h", "engine/bodies/"),
           ("pugixml.hpp", "engine/scene/"), ("boost/polygon/voronoi.hpp", "engine/rods/design/"),
           ("zlib.h", "engine/scene/"), ("nlohmann/json.hpp", "engine/scene/"), ("xxhash.h", "engine/base/"))
# file -> text, and what its line must say
FAULTS = {
    # The wings of the engine, one that each may not include; the values that some may take of a wing, and no more.
    "engine/base/a.h": (include("engine/bodies/ok.h"), "base must not include"),
    "engine/bodies/a.h": (include("engine/reduced/ok.h"), "bodies must not include"),
    "engine/reduced/a.h": (include("engine/spacetime/ok.h"), "reduced must not include"),
    "engine/spacetime/a.h": (include("engine/reduced/ok.h"), "spacetime must not include"),
    "engine/rods/a.h": (include("engine/beams/ok.h"), "rods must not include"),
    "engine/beams/a.h": (include("engine/rods/ok.h"), "beams must not include"),
    "engine/scene/a.h": (include("engine/rods/linkage/linkage.h"), "scene must not include"),
    "engine/session/a.h": (include("server/wire/ok.h"), "session must not include"),
    "engine/base/tests.cpp": (include("tests/support/ok.h"), "base must not include"),
    "engine/base/bench.cpp": (include("bench/ok.h"), "base must not include"),
    "engine/base/examples.cpp": (include("examples/ok.h"), "base must not include"),
    "server/cli/bench.cpp": (include("bench/ok.h"), "server must not include"),
    "server/cli/clients.cpp": (include("clients/cpp/ok.h"), "server must not include"),
    "clients/cli/engine.cpp": (include("engine/base/error.h"), "clients must not include"),
    "clients/cpp/server.cpp": (include("server/wire/ok.h"), "clients must not include"),
    # Kinds of sessions.
    "engine/session/beams/a.h": (include("engine/session/bodies/ok.h"), "beams of sessions must not include"),
    "engine/session/core/a.h": (include("engine/session/linkages/ok.h"), "core of sessions must not include"),
    # Rooms of the server.
    "server/log/a.h": (include("server/wire/ok.h"), "server/log must not include"),
    "server/wire/a.cpp": (include("server/kinds/kind.h"), "server/wire must not include"),
    "server/transport/a.cpp": (include("server/runtime/ok.h"), "server/transport must not include"),
    "server/runtime/a.cpp": (include("server/service/ok.h"), "server/runtime must not include"),
    "server/kinds/a.cpp": (include("server/kinds/beams/ok.h"), "server/kinds must not include"),
    "server/kinds/beams/a.h": (include("server/kinds/bodies/ok.h"), "server/kinds/beams must not include"),
    "server/kinds/bodies/a.h": (include("server/kinds/registry.h"), "server/kinds/bodies must not include"),
    "server/kinds/registry.cpp": (include("server/service/ok.h"), "server/kinds/registry must not include"),
    "server/service/a.cpp": (include("server/kinds/beams/ok.h"), "server/service must not include"),
    # The engine in the server.
    "server/kinds/bodies/session.cpp": (include("engine/session/beams/ok.h"), "bodies of the server must not include"),
    "server/kinds/bodies/wing.cpp": (include("engine/rods/ok.h"), "bodies of the server must not include"),
    "server/kinds/linkages/wing.cpp": (include("engine/beams/ok.h"), "linkages of the server must not include"),
    "server/kinds/beams/wing.cpp": (include("engine/spacetime/ok.h"), "beams of the server must not include"),
    "server/kinds/shared.h": (include("engine/session/beams/ok.h"), "what kinds share must not include engine"),
    "server/service/session.cpp": (include("engine/session/bodies/ok.h"), "what kinds share must not include engine"),
    "server/wire/session.cpp": (include("engine/session/linkages/ok.h"), "what kinds share must not include engine"),
    "server/runtime/session.cpp": (include("engine/session/beams/ok.h"), "what kinds share must not include engine"),
    "server/transport/session.cpp": (include("engine/session/beams/ok.h"), "what kinds share must not include engine"),
    # Clients.
    "clients/cpp/beams/a.cpp": (include("clients/cpp/linkages/ok.h"), "beams must not include"),
    "clients/cli/linkages/a.cpp": (include("clients/cpp/bodies/ok.h"), "linkages must not include"),
    "clients/cli/bodies/a.cpp": (include("clients/cli/beams/kind.h"), "bodies must not include"),
    "clients/cli/print.cpp": (include("clients/cpp/bodies/ok.h"), "what kinds share must not include"),
    "clients/cpp/open_session.h": (include("clients/cpp/bodies/ok.h"), "what kinds share must not include"),
    "clients/cpp/a.cpp": (include("clients/cli/print.h"), "the library must not include"),
    # Who asks for a kind.
    "server/service/cast.cpp": ("std::dynamic_pointer_cast<BeamRecord>(record)\n",
                                "asks for a kind: dynamic_pointer_cast<BeamRecord"),
    "server/service/pointer.cpp": ("std::static_pointer_cast<BeamRecord>(record)\n",
                                   "asks for a kind: static_pointer_cast<BeamRecord"),
    "server/service/reference.cpp": ("static_cast<const LinkageKind&>(kind)\n",
                                     "asks for a kind: static_cast<const LinkageKind"),
    "clients/cli/session.cpp": ("static_cast<client::BodySession&>(session)\n",
                                "asks for a kind: static_cast<client::BodySession"),
    "server/service/has.cpp": ("if (scene.has_beams()) {}\n", "asks for a kind: has_beams()"),
    "server/kinds/bodies/has.cpp": ("if (scene.has_beams()) {}\n", "asks for a kind: has_beams()"),
    "server/kinds/linkages/has.cpp": ("if (scene.has_beams()) {}\n", "asks for a kind: has_beams()"),
    "clients/cli/result_commands.cpp": ("if (result.has_linkage()) {}\n", "asks for a kind: has_linkage()"),
    "server/service/equal.cpp": ('if (status.kind() == "beams") {}\n', 'asks for a kind: kind() == "beams"'),
    "server/service/unequal.cpp": ('if (std::string(record->kind()) != "bodies") {}\n',
                                   'asks for a kind: kind()) != "bodies"'),
    "clients/cpp/view.cpp": ('if (status.kind() == std::string_view("linkages")) {}\n',
                             'asks for a kind: kind() == std::string_view("linkages"'),
    "clients/cli/equal.cpp": ('if ("linkages" == kind->name()) {}\n', 'asks for a kind: "linkages" == kind->name()'),
    "server/kinds/beams/equal.cpp": ('if (record.kind() == "bodies") {}\n', 'asks for a kind: kind() == "bodies"'),
    # Cycles between headers, and between rooms where no header is in two of them.
    "engine/base/cycle_2.h": (include("engine/base/cycle_1.h"), "include cycle"),
    "bench/cycle_2.h": (include("bench/cycle_1.h"), "include cycle"),
    **{f"{top}/one/{name}.cpp": (include(f"{top}/two/{other}.h"), f"room cycle through {top}/one")
       for top, name, other in (("engine/scene", "b", "c"), ("server/cli", "b", "c"), ("clients/cli", "b", "c"),
                                ("tests", "b", "c"), ("bench", "b", "c"), ("examples", "b", "c"))},
    **{f"{top}/two/d.cpp": (include(f"{top}/one/e.h"), f"room cycle through {top}/two")
       for top in ("engine/scene", "server/cli", "clients/cli", "tests", "bench", "examples")},
    # Scenes are plain values.
    "engine/scene/heavy.h": (include("engine/scene/brings.h"), "plain values must not bring engine/bodies/full_dynamics.h"),
    "engine/scene/brings.h": (include("engine/bodies/full_dynamics.h"), "plain values must not bring"),
    "engine/scene/simulates.h": (include("engine/bodies/simulation.h"), "plain values must not bring"),
    "engine/scene/factors.h": (include("engine/base/numerics/sparse_cholesky.h"), "plain values must not bring"),
    # What the engine may not know at all; what single files of it may, and no header.
    **{f"engine/base/forbidden_{i}.cpp": (f"#include <{name}>\n", f"engine/ must not include <{name}>")
       for i, name in enumerate(("zmq.hpp", "boost/asio.hpp", "google/protobuf/message.h", "proto/limber.h", "sqlite3.h",
                                 "CLI/CLI.hpp", "iostream", "cstdio", "spdlog/spdlog.h", "limber/v1/scene.pb.h"))},
    "server/runtime/sqlite.cpp": ("#include <sqlite3.h>\n", "<sqlite3.h> is private to server/store/"),
    "server/store/store.cpp": (include("server/runtime/ok.h"), "server/store must not include"),
    **{f"engine/session/private_{i}.cpp": (f"#include <{name}>\n", f"<{name}> is private to {home}")
       for i, (name, home) in enumerate(PRIVATE)},
    **{f"{home}private_{i}.h": (f"#include <{name}>\n", f"<{name}> must stay out of headers")
       for i, (name, home) in enumerate(PRIVATE)},
}
# What those faults need that are made of two files.
HELPERS = {"engine/base/cycle_1.h": include("engine/base/cycle_2.h"), "bench/cycle_1.h": include("bench/cycle_2.h")}
ALLOWED = {
    "engine/spacetime/ok.h": include("engine/reduced/kinematics.h", "engine/base/error.h"),
    "engine/session/ok.h": include("engine/scene/scene.h"),
    "engine/session/beams/ok.h": include("engine/session/core/ok.h", "engine/beams/ok.h"),
    "engine/rods/design/ok.cpp": "#include <boost/polygon/voronoi.hpp>\n",
    "server/kinds/kind.h": include("server/wire/ok.h", "engine/session/core/ok.h"),
    "server/kinds/registry.cpp": include("server/kinds/beams/kind.h"),
    "server/kinds/beams/kind.h": include("server/kinds/kind.h"),
    "server/kinds/beams/kind.cpp": include("engine/session/beams/ok.h", "engine/beams/ok.h") +
                                   'return scene.has_beams();\nif (kind() == "beams") {}\n',
    "server/kinds/bodies/kind.cpp": include("engine/reduced/ok.h") + "std::static_pointer_cast<BodyRecord>(record)\n",
    "server/runtime/jobs.cpp": 'if (status.kind() == "simulate") {}\n',
    "server/cli/simulate.cpp": include("engine/session/bodies/ok.h"),
    "clients/cli/kinds.cpp": include("clients/cli/beams/kind.h", "clients/cli/linkages/kind.h"),
    "clients/cli/beams/kind.cpp": include("clients/cpp/beams/session.h", "clients/cli/kind.h") +
                                  "return result.has_beams();\n",
    "clients/cpp/scene_files.cpp": include("clients/cpp/beams/files.h"),
    "clients/cpp/beams/files.cpp": include("clients/cpp/scene_files.h", "engine/base/checked_number.h"),
    "bench/main.cpp": include("engine/session/bodies/ok.h", "server/service/ok.h"),
}


def write(root: pathlib.Path, path: str, text: str) -> None:
    (root / path).parent.mkdir(parents=True, exist_ok=True)
    (root / path).write_text(text)


with tempfile.TemporaryDirectory() as folder:
    root = pathlib.Path(folder)
    for path, text in ALLOWED.items():
        write(root, path, text)
    if include_graph.check(root):
        sys.exit("refused, but allowed:\n" + "\n".join(include_graph.check(root)))
    for path, text in HELPERS.items():
        write(root, path, text)
    for path, (text, _) in FAULTS.items():
        write(root, path, text)
    found = include_graph.check(root)
    for path, (_, expected) in FAULTS.items():
        if not any(line.startswith(f"{path}: ") and expected in line for line in found):
            sys.exit(f"not caught: {path}: {expected}\n" + "\n".join(found))
    for line in found:
        if line.split(": ")[0] not in FAULTS and "room cycle" not in line:  # all that lies on a cycle is named
            sys.exit(f"named without a fault: {line}")
print("every fault is caught")
