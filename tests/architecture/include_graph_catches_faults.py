#!/usr/bin/env python3
"""The include-graph check must be able to fail: a small tree with one fault of each kind."""

import pathlib
import sys
import tempfile

import include_graph

FAULTS = {
    "engine/bodies/a.h": ('#include "engine/reduced/b.h"\n', "bodies must not include"),
    "engine/spacetime/c.h": ('#include "engine/reduced/b.h"\n', "spacetime must not include"),
    "engine/scene/d.cpp": ("#include <zmq.hpp>\n", "must not include <zmq.hpp>"),
    "engine/bodies/e.h": ("#include <cholmod.h>\n", "private to"),
    "clients/cli/f.cpp": ('#include "engine/base/error.h"\n', "clients must not include"),
    "engine/base/g.h": ('#include "engine/base/h.h"\n', "include cycle"),
    "engine/base/h.h": ('#include "engine/base/g.h"\n', "include cycle"),
    "engine/scene/one/i.cpp": ('#include "engine/scene/two/j.h"\n', "room cycle through engine/scene/one"),
    "engine/session/beams/m.h": ('#include "engine/session/bodies/n.h"\n', "beams of sessions must not include"),
    "engine/session/core/o.h": ('#include "engine/session/bodies/n.h"\n', "core of sessions must not include"),
    "engine/scene/p.h": ('#include "engine/scene/q.h"\n', "engine/scene/p.h: plain values must not bring"),
    "engine/scene/q.h": ('#include "engine/bodies/full_dynamics.h"\n', "plain values must not bring"),
    "tests/one/r.h": ('#include "tests/two/s.h"\n', "room cycle through tests/one"),
    "tests/two/t.h": ('#include "tests/one/u.h"\n', "room cycle through tests/two"),
    "server/kinds/beams/v.h": ('#include "server/kinds/bodies/w.h"\n', "server/kinds/beams must not include"),
    "server/wire/x.cpp": ('#include "server/kinds/kind.h"\n', "server/wire must not include"),
    "server/service/y.cpp": ('#include "server/kinds/beams/v.h"\nif (scene.has_beams()) {}\n',
                             "server/service must not include"),
    "server/service/z.cpp": ("std::dynamic_pointer_cast<BeamRecord>(record)\n", "asks for a kind: dynamic_pointer_cast"),
    "server/kinds/bodies/aa.cpp": ("if (scene.has_beams()) {}\n", "asks for a kind: has_beams()"),
    "server/runtime/bb.h": ('#include "server/service/service.h"\n', "server/runtime must not include"),
    "clients/cpp/beams/cc.cpp": ('#include "clients/cpp/linkages/dd.h"\n', "beams must not include"),
    "clients/cli/linkages/ee.cpp": ('#include "clients/cpp/bodies/ff.h"\n', "linkages must not include"),
    "clients/cli/print.cpp": ('#include "clients/cpp/bodies/ff.h"\n', "what kinds share must not include"),
    "clients/cpp/open_session.h": ('#include "clients/cpp/bodies/ff.h"\n', "what kinds share must not include"),
    "clients/cpp/gg.cpp": ('#include "clients/cli/print.h"\n', "the library must not include"),
    "clients/cli/result_commands.cpp": ("if (result.has_linkage()) {}\n", "asks for a kind: has_linkage()"),
    "engine/scene/two/k.h": ('#include "engine/scene/one/l.h"\n', "room cycle through engine/scene/two"),
}
ALLOWED = {"engine/spacetime/ok.h": '#include "engine/reduced/kinematics.h"\n#include "engine/base/error.h"\n',
           "engine/session/ok.h": '#include "engine/scene/scene.h"\n',
           "server/kinds/kind.h": '#include "server/wire/ok.h"\n',
           "server/kinds/registry.cpp": '#include "server/kinds/beams/kind.h"\n',
           "server/kinds/beams/kind.h": '#include "server/kinds/kind.h"\n',
           "server/kinds/beams/kind.cpp": "return scene.has_beams();\n",
           "clients/cli/kinds.cpp": '#include "clients/cli/beams/kind.h"\n#include "clients/cli/linkages/kind.h"\n',
           "clients/cli/beams/kind.cpp": '#include "clients/cpp/beams/session.h"\n'
                                         '#include "clients/cli/kind.h"\nreturn result.has_beams();\n',
           "clients/cpp/scene_files.cpp": '#include "clients/cpp/beams/files.h"\n'}

with tempfile.TemporaryDirectory() as folder:
    root = pathlib.Path(folder)
    for top in ("server", "engine", "clients", "tests"):
        (root / top).mkdir()
    for path, text in ALLOWED.items():
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_text(text)
    assert include_graph.check(root) == [], include_graph.check(root)
    for path, (text, _) in FAULTS.items():
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_text(text)
    found = "\n".join(include_graph.check(root))
    for path, (_, expected) in FAULTS.items():
        if expected not in found:
            sys.exit(f"not caught: {path}: {expected}\n{found}")
print("every fault is caught")
