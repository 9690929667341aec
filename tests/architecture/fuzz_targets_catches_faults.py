#!/usr/bin/env python3
"""The check of fuzz targets must be able to fail: each gap in a small tree must be named, and nothing else."""

import sys

import fuzz_targets

# Readers that BY and NOT_READ name are there, so that nothing is said of them.
KNOWN = "".join(f"void {name}(std::string_view text);\n" for name in (*fuzz_targets.BY, *fuzz_targets.NOT_READ))
CALLS = "".join(f"{name}(bytes);\n" for name in {*fuzz_targets.BY.values()})
WHOLE = {
    "engine/scene/formats/a.h": KNOWN + "Mesh read_new(const std::string& name, std::string_view content, Limits limits = {});\n",
    "proto/limber/v1/scene.proto": "message MeshSource {\n  MeshFile file = 2;  // MeshFile other = 3;\n}\nmessage Motion { bytes pc2 = 2; }\n",
    "tests/fuzz/targets/files.cpp": CALLS + "put(file, *mesh.mutable_file());\nmotion.set_pc2(bytes);\nread_new(name, bytes);\n",
    "tests/fuzz/CMakeLists.txt": "set(fuzz_targets files)\n",
    "tests/fuzz/README.md": "| `files` |\n",
    "scripts/fuzz": "all=(files)\n",
    "tests/fuzz/corpus/files/one": "",
}
# what is changed in a file, and what must be said
GAPS = [
    ("tests/fuzz/targets/files.cpp", "read_new(name", "// read_new(name", "read_new() reads bytes"),
    ("engine/scene/formats/a.h", "Mesh read_new", "Mesh read_more(TextCursor& file);\nMesh read_new", "read_more() reads bytes"),
    ("engine/scene/formats/a.h", "void read_stl(", "void stl(", "there is no reader read_stl any more"),
    ("tests/fuzz/targets/files.cpp", "mutable_file", "mutable_path", "no target puts a file into file"),
    ("tests/fuzz/targets/files.cpp", "set_pc2", "pc2", "no target puts a file into pc2"),
    ("proto/limber/v1/scene.proto", "  MeshFile file", "  repeated MeshFile drawings = 9;\n  MeshFile file", "into drawings"),
    ("tests/fuzz/CMakeLists.txt", "files)", "files jobs)", "jobs is a target without a source"),
    ("tests/fuzz/CMakeLists.txt", "files)", ")", "files is a source that no target is made of"),
    ("tests/fuzz/README.md", "files", "jobs", "README.md: does not name the target files"),
    ("scripts/fuzz", "files", "jobs", "scripts/fuzz: does not name the target files"),
]

wrong = [f"named without reason: {fault}" for fault in fuzz_targets.faults_of(WHOLE)]
for path, before, after, said in GAPS:
    assert before in WHOLE[path], (path, before)
    faults = fuzz_targets.faults_of({**WHOLE, path: WHOLE[path].replace(before, after)})
    if len(faults) != 1 or said not in faults[0]:
        wrong.append(f"{path}, {after!r}: {faults} in place of {said!r}")
without = {path: text for path, text in WHOLE.items() if "/corpus/" not in path}
if fuzz_targets.faults_of(without) != ["tests/fuzz/corpus/files: has no inputs"]:
    wrong.append("a target without inputs is not named")
print("\n".join(wrong) or f"{len(GAPS) + 1} gaps were named")
sys.exit(1 if wrong else 0)
