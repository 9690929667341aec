#!/usr/bin/env python3
"""Checks that every reader of bytes is fuzzed: a function of a header that takes a text or bytes and whose name says that it reads
them is called by a target of tests/fuzz, or by something that one calls; and every file of a request is put there by one.
Exit code 1 and one line per fault."""

import pathlib
import re
import sys

READS = re.compile(
    r"\b((?:read|decode|parse|peek|check|restore|import|unpack|load)_\w+|parse|with_difference|material_libraries|"
    r"\w+_(?:of|files|includes|from_json))\s*\(((?:[^;(){}]|\{\})*(?:std::string_view|TextCursor&|const MeshFileSet&|"
    r"const std::string& (?:bytes|text|content|data|json|value))(?:[^;(){}]|\{\})*)\)")
# A function that reads bytes, and the one that hands it those that a target made.
BY = {
    **dict.fromkeys(("read_gmsh", "read_gmsh_1", "read_gmsh_2", "read_gmsh_4", "read_medit", "read_tetgen", "read_vega", "read_abaqus",
                     "read_vtk_legacy", "read_vtu", "read_real_array", "read_integer_array", "decode_base64", "read_materials",
                     "read_gmsh_names", "parse_abaqus_keyword", "read_row"), "read_mesh"),
    **dict.fromkeys(("read_obj", "read_ply", "read_stl", "read_off", "read_glb", "read_format"), "read_surface"),
    "read_vtu_points": "read_vtu_series",
    "read_line": "AllowList",
    "parse": "SessionKey::parse",
}
# What reads nothing that others made, or bytes of which it only tells something.
NOT_READ = {
    "parse_number": "a number, by every reader",
    "stream_of": "a view of bytes, of which check_wire() and peek_request() read",
    "parse_start_shift": "a setting of our own tests",
    "parse_scene": "read_scene(), and the sentence of its fault",
}
FILES = re.compile(r"\bMeshFile (\w+) = \d+;|\bbytes (pc2) = \d+;")


def without_comments(text: str) -> str:
    return re.sub(r"//[^\n]*", "", text)


def readers(files: "dict[str, str]") -> "dict[str, str]":
    """Functions that read bytes, and the header of each."""
    found: "dict[str, str]" = {}
    for path, text in files.items():
        if path.endswith(".h") and path.startswith(("engine/", "server/", "clients/cpp/", "proto/")):
            for match in READS.finditer(without_comments(text)):
                found.setdefault(match[1], path)
    return found


def faults_of(files: "dict[str, str]") -> "list[str]":
    """files: path from the root -> text, of sources, messages and targets."""
    targets = "\n".join(without_comments(text) for path, text in files.items() if path.startswith("tests/fuzz/") and path.endswith(".cpp"))
    faults = []
    known = readers(files)
    for name, path in sorted(known.items()):
        if name in NOT_READ:
            continue
        called = BY.get(name, name)
        if not re.search(rf"\b{called}\b", targets):
            faults.append(f"{path}: {name}() reads bytes, and no target of tests/fuzz calls {'it' if called == name else called}")
    for name in sorted((set(BY) | set(NOT_READ)) - set(known)):
        faults.append(f"tests/architecture/fuzz_targets.py: there is no reader {name} any more")
    put = files.get("tests/fuzz/targets/files.cpp", "")
    for path, text in files.items():
        if path.endswith(".proto") and not path.endswith(("stored.proto",)):
            for match in FILES.finditer(without_comments(text)):
                field = match[1] or match[2]
                if not re.search(rf"\b(?:mutable|add|set)_{field}\b", put):
                    faults.append(f"{path}: no target puts a file into {field}: tests/fuzz/targets/files.cpp")
    listed = re.search(r"set\(fuzz_targets ([\w\s]+)\)", files.get("tests/fuzz/CMakeLists.txt", ""))
    names = set(listed[1].split()) if listed else set()
    sources = {pathlib.PurePosixPath(path).stem for path in files if path.startswith("tests/fuzz/targets/")}
    for name in sorted(names ^ sources):
        faults.append(f"tests/fuzz: {name} is {'a target without a source' if name in names else 'a source that no target is made of'}")
    for name in sorted(sources):
        for path in ("scripts/fuzz", "tests/fuzz/README.md"):
            if not re.search(rf"\b{name}\b", files.get(path, "")):
                faults.append(f"{path}: does not name the target {name}")
        if not any(path.startswith(f"tests/fuzz/corpus/{name}/") for path in files):
            faults.append(f"tests/fuzz/corpus/{name}: has no inputs")
    return faults


def check(root: pathlib.Path) -> "list[str]":
    files = {}
    for pattern in ("engine/**/*.h", "server/**/*.h", "clients/cpp/**/*.h", "proto/**/*.h", "proto/limber/v1/*.proto", "tests/fuzz/*.cpp",
                    "tests/fuzz/targets/*.cpp", "tests/fuzz/CMakeLists.txt", "tests/fuzz/README.md", "scripts/fuzz"):
        for path in root.glob(pattern):
            files[path.relative_to(root).as_posix()] = path.read_text(encoding="utf-8")
    for path in (root / "tests/fuzz/corpus").glob("*/*"):
        files[path.relative_to(root).as_posix()] = ""
    return faults_of(files)


if __name__ == "__main__":
    faults = check(pathlib.Path(sys.argv[1]))
    print("\n".join(faults) or "fuzz targets: every reader has one")
    sys.exit(1 if faults else 0)
