#!/usr/bin/env python3
"""Checks that every reader of bytes is fuzzed: a function of a header that takes a text or bytes and whose name says that it reads
them, or that takes a path or a stream, whatever its name, is called by a target of tests/fuzz, or by something that one calls; and every
file of a request is put there by one. Exit code 1 and one line per fault."""

import pathlib
import re
import sys

ARGUMENTS = r"(?:[^;(){}]|\{[^;{}]*\}|\([^;(){}]*\))*"
READS = re.compile(
    r"\b((?:read|decode|parse|peek|check|restore|import|unpack|load)_\w+|parse|with_difference|material_libraries|"
    r"\w+_(?:of|files|includes|from_json))\s*\((" + ARGUMENTS + r"(?:std::string_view|TextCursor&|const MeshFileSet&|"
    r"const std::string& (?:bytes|text|content|data|json|value))" + ARGUMENTS + r")\)")
# Of a file: constructors, too. What is called so writes it.
OPENS = re.compile(
    r"\b(?!(?:write|save|export)_)(\w+)\s*\(" + ARGUMENTS + r"\b(?:filesystem::path|fs::path|std::(?:basic_)?i?f?(?:string)?stream)\b"
    r"(?:<\w+>)?>?\s*&{0,2}\s*\w" + ARGUMENTS + r"\)")
# A function that reads bytes, and the one that hands it those that a target made; or one that opens a file, and the one that it hands
# the bytes to.
BY = {
    **dict.fromkeys(("read_gmsh", "read_gmsh_1", "read_gmsh_2", "read_gmsh_4", "read_medit", "read_tetgen", "read_vega", "read_abaqus",
                     "read_vtk_legacy", "read_vtu", "read_real_array", "read_integer_array", "decode_base64", "read_materials",
                     "read_gmsh_names", "parse_abaqus_keyword", "read_row"), "read_mesh"),
    **dict.fromkeys(("read_obj", "read_ply", "read_stl", "read_off", "read_glb", "read_format"), "read_surface"),
    "read_vtu_points": "read_vtu_series",
    "parse": "SessionKey::parse",
    "read_mesh_file": "read_mesh",
    "read_surface_file": "read_surface",
    "read_edge_mesh_file": "read_edge_mesh",
    "read_line_mesh_file": "read_line_mesh",
    **dict.fromkeys(("parse_object", "read_beam_job_folder", "beam_job_scene"), "read_beam_job"),
    **dict.fromkeys(("read_line", "read_allow_list", "read_allowed_keys", "change_allow_list"), "AllowList"),
    "read_curve_setup": "curve_key_of",
    "read_token": "token_of",
    "ModelCache": "decode_model",
    "simulate_file": "scene_from_json",
    "load_scene": "read_scene",
    "load_beams": "read_message",
    **dict.fromkeys(("scene_of_lines", "kind_of_file"), "read_obj_lines"),
}
# What reads nothing that others made, or bytes of which it only tells something.
NOT_READ = {
    "parse_number": "a number, by every reader",
    "stream_of": "a view of bytes, of which check_wire() and peek_request() read",
    "parse_start_shift": "a setting of our own tests",
    "parse_scene": "read_scene(), and the sentence of its fault",
    "lost_transactions": "SQLite's own log beside the store, written by this process; bits are flipped in it by "
                         "tests/server/store/damaged_store_test.cpp",
    **dict.fromkeys(("Database", "back_up"), "SQLite opens its own file; what the rows hold is read by the target `stored`"),
    "copy_to": "written",
    "Reserve": "written, and never read: room for a full disk",
    "Files": "files of the page, sent as they are",
    **dict.fromkeys(("FileRoots", "paths_beside", "motion_format", "demand_folder", "length_of", "is_beam_job_folder", "is_beam_job",
                     "file_of_beam_job", "file_of_scene", "surface_beside", "lower_ending"), "where a file is, and not what it holds"),
    **dict.fromkeys(("read_bytes", "read_file_at", "painted_stiffness", "put_stiffness_bytes"),
                    "bytes, handed on as they are"),
    **dict.fromkeys(("mesh_file", "put_mesh_bytes", "put_linkage_bytes", "put_beam_bytes", "scene_of_tets", "surface_file",
                     "put_surface_bytes"),
                    "a client's own files, sent to the server, which reads them; of *INCLUDE and mtllib the names, line by line"),
    **dict.fromkeys(("put_pose_bytes", "put_motion_bytes"),
                    "as those; of a .pvd the names, by pugixml"),
    "read_curve_keys": "40 characters with white space around them, which libzmq decodes",
}
FILE_BYTES = ("pc2",)  # fields of bytes that are files
# Of C++: a variable or a function of a message's type, `auto` what is behind it, and fields that are gone into, one behind another.
DECLARED = r"\b(?:proto|v1)::(?P<type>\w+)[\s&*]+(?P<name>\w+)\b"
DEDUCED = r"\bauto[\s&*]+(?P<deduced>\w+)\s*[=:]\s*[&*]*"
CHAIN = r"\b(?P<start>\w+)(?:\([^()]*\))?(?P<steps>(?:\s*(?:\.|->)\s*(?:mutable|add|set)_\w+\()(?:[^()]*\)\s*(?:\.|->)\s*(?:mutable|add|set)_\w+\()*)"
OF_MESSAGES = re.compile(rf"(?P<end>^\}})|{DECLARED}|{DEDUCED}|{CHAIN}", re.MULTILINE)


def without_comments(text: str) -> str:
    return re.sub(r"//[^\n]*", "", text)


def readers(files: "dict[str, str]") -> "dict[str, str]":
    """Functions that read bytes, and the header of each."""
    found: "dict[str, str]" = {}
    for path, text in files.items():
        if path.endswith(".h") and path.startswith(("engine/", "server/", "clients/cpp/", "proto/")):
            for pattern in (READS, OPENS):
                for match in pattern.finditer(without_comments(text)):
                    found.setdefault(match[1], path)
    return found


def messages_of(text: str) -> "dict[str, dict[str, str]]":
    """Of a .proto: message -> field -> type, of maps that of their values. Messages in others: Outer_Inner, as C++ calls them."""
    found: "dict[str, dict[str, str]]" = {}
    scopes: "list[str | None]" = []  # names of messages; None: another block, whose fields are those of the message around it
    parts = r'"[^"\n]*"|\b(message|enum|service|oneof)\s+(\w+)\s*\{|[{}]|\b(?:map\s*<\s*\w+\s*,\s*([\w.]+)\s*>|([\w.]+))\s+(\w+)\s*=\s*\d+'
    for match in re.finditer(parts, without_comments(text)):
        if match[0].startswith('"'):
            continue
        if match[0] == "}":
            scopes.pop()
        elif match[0].endswith("{"):
            scopes.append(match[2] if match[1] == "message" else None)
        elif message := "_".join(scope for scope in scopes if scope):
            found.setdefault(message, {})[match[5]] = (match[3] or match[4]).split(".")[-1]
    return found


def filled_by(text: str, messages: "dict[str, dict[str, str]]") -> "set[tuple[str, str]]":
    """Message and field of all that a target goes into or sets; what it is called by a variable of another type does not count."""
    text = without_comments(text)
    functions = {match["name"]: match["type"] for match in re.finditer(DECLARED + r"\(", text)}
    known = dict(functions)
    filled = set()
    deduced, at = "", -1  # an auto that awaits what is behind it, and where that begins
    for match in OF_MESSAGES.finditer(text):
        if match["end"]:
            known = dict(functions)
        elif match["type"]:
            known[match["name"]] = match["type"]
        elif match["deduced"]:
            deduced, at = match["deduced"], match.end()
            known.pop(deduced, None)
        else:
            message = known.get(match["start"], "")
            for field in re.findall(r"(?:\.|->)\s*(?:mutable|add|set)_(\w+)\(", match["steps"]):
                if field in messages.get(message, {}):
                    filled.add((message, field))
                message = messages.get(message, {}).get(field, "")
            if match.start() == at and message:
                known[deduced] = message
    return filled


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
    protos = {path: messages_of(text) for path, text in files.items() if path.endswith(".proto")}
    messages: "dict[str, dict[str, str]]" = {}
    for found in protos.values():
        messages.update(found)
    filled = set()
    for path, text in files.items():
        if path.startswith("tests/fuzz/targets/"):
            filled |= filled_by(text, messages)
    for path, found in protos.items():
        for message, fields in found.items():
            for field, type_name in fields.items():
                is_file = type_name == "MeshFile" or (type_name == "bytes" and field in FILE_BYTES)
                if is_file and not path.endswith("stored.proto") and (message, field) not in filled:
                    faults.append(f"{path}: no target puts a file into {message}.{field}: tests/fuzz/targets/files.cpp")
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
