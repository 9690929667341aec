#!/usr/bin/env python3
"""The check of fuzz targets must be able to fail: each gap in a small tree must be named, and nothing else."""

import sys

import fuzz_targets

# Readers that BY and NOT_READ name are there, so that nothing is said of them.
KNOWN = "".join(f"void {name}({'std::string_view text' if fuzz_targets.READS.match(f'{name}(std::string_view text)') else 'std::filesystem::path file'});\n"
                for name in (*fuzz_targets.BY, *fuzz_targets.NOT_READ))
CALLS = "".join(f"{name}(bytes);\n" for name in {*fuzz_targets.BY.values()})
WHOLE = {
    "engine/scene/formats/a.h": KNOWN + "Mesh read_new(const std::string& name, std::string_view content, Limits limits = {});\n"
                                "void write_new(const std::filesystem::path& file);\nstd::function<std::filesystem::path(const Name& name)> find;\n"
                                "auto lines_of(const F& f) -> decltype(f(std::filesystem::path()));\n",
    "proto/limber/v1/scene.proto": """message MeshSource {
  oneof source {
    MeshFile file = 2;  // MeshFile other = 3;
    string path = 1;
  }
}
message Motion { bytes pc2 = 2; bytes content = 3; }
message Scene {
  MeshSource mesh = 1;
  Motion motion = 2;
  repeated limber.v1.MeshSource poses = 3;
  Material material = 4;
}
message Material { string name = 1; }
""",
    "tests/fuzz/targets/files.cpp": CALLS + """
proto::Scene& small_scene(proto::Request& request) {
  proto::Scene& scene = *request.mutable_scene();
  return scene;
}
proto::Request request_of(const File& file) {
  proto::Request request;
  proto::Scene& scene = small_scene(request);
  auto& mesh = *scene
                    .mutable_mesh();
  put(file, *mesh.mutable_file());
  scene.mutable_motion()->set_pc2(bytes);
  scene.mutable_material()->set_name("a");
  return request;
}
void read() { read_new(name, bytes); }
""",
    "tests/fuzz/CMakeLists.txt": "set(fuzz_targets files)\n",
    "tests/fuzz/README.md": "| `files` |\n",
    "scripts/fuzz": "all=(files)\n",
    "tests/fuzz/corpus/files/one": "",
}
# what is changed in a file, and what must be said; None: nothing
GAPS = [
    ("tests/fuzz/targets/files.cpp", "read_new(name", "// read_new(name", "read_new() reads bytes"),
    ("engine/scene/formats/a.h", "Mesh read_new", "Mesh read_more(TextCursor& file);\nMesh read_new", "read_more() reads bytes"),
    ("engine/scene/formats/a.h", "Limits limits = {}", "Limits limits = Limits{1}", None),
    ("engine/scene/formats/a.h", "Mesh read_new", "Mesh read_more(std::string_view text, std::size_t most = std::size_t{1} << 30);\nMesh read_new",
     "read_more() reads bytes"),
    # Readers of files, whatever they are called.
    ("engine/scene/formats/a.h", "Mesh read_new", "Count lost(const std::filesystem::path& log,\n    Count page);\nMesh read_new", "lost() reads bytes"),
    ("engine/scene/formats/a.h", "Mesh read_new", "Count lost(Count most, std::filesystem::path log);\nMesh read_new", "lost() reads bytes"),
    ("engine/scene/formats/a.h", "Mesh read_new", "Count lost(const F& f = F(1), std::vector<std::filesystem::path> logs = {});\nMesh read_new",
     "lost() reads bytes"),
    ("engine/scene/formats/a.h", "Mesh read_new", "Items items(std::istream& in);\nMesh read_new", "items() reads bytes"),
    ("engine/scene/formats/a.h", "Mesh read_new", "Items items(std::ifstream&& in);\nMesh read_new", "items() reads bytes"),
    ("engine/scene/formats/a.h", "Mesh read_new", "explicit Cache(std::filesystem::path folder);\nMesh read_new", "Cache() reads bytes"),
    ("engine/scene/formats/a.h", "void lost_transactions(", "void write_lost_transactions(", "there is no reader lost_transactions any more"),
    ("engine/scene/formats/a.h", "void read_stl(", "void stl(", "there is no reader read_stl any more"),
    # Files of requests, by message and field.
    ("tests/fuzz/targets/files.cpp", "mutable_file", "mutable_path", "no target puts a file into MeshSource.file"),
    ("tests/fuzz/targets/files.cpp", "set_pc2", "pc2", "no target puts a file into Motion.pc2"),
    ("tests/fuzz/targets/files.cpp", "put(file", "// put(file", "no target puts a file into MeshSource.file"),
    ("tests/fuzz/targets/files.cpp", "scene\n                    .mutable_mesh()", "scene.mutable_material()", "no target puts a file into MeshSource.file"),
    ("tests/fuzz/targets/files.cpp", "auto& mesh = *", "auto& other = *", "no target puts a file into MeshSource.file"),
    ("tests/fuzz/targets/files.cpp", "auto& mesh = *scene\n                    .mutable_mesh();", "proto::MeshSource mesh;", None),
    ("tests/fuzz/targets/files.cpp", "auto& mesh = *scene\n                    .mutable_mesh();", "auto& mesh = *scene.add_poses();", None),
    ("tests/fuzz/targets/files.cpp", "  put(file, *mesh.mutable_file());", "", "no target puts a file into MeshSource.file"),
    ("tests/fuzz/targets/files.cpp", "  put(file, *mesh.mutable_file());\n  scene.mutable_motion()->set_pc2(bytes);",
     "  scene.mutable_motion()->set_pc2(bytes);\n}\nvoid more(Mesh& mesh) {\n  put(file, *mesh.mutable_file());",
     "no target puts a file into MeshSource.file"),  # another mesh
    ("proto/limber/v1/scene.proto", "    MeshFile file", "    repeated MeshFile drawings = 9;\n    MeshFile file", "into MeshSource.drawings"),
    ("proto/limber/v1/scene.proto", "message Material {", "message Surface { oneof source { MeshFile file = 1; } }\nmessage Material {",
     "into Surface.file"),
    ("proto/limber/v1/scene.proto", "message Material {", "message Material { MeshFile file = 3;", "into Material.file"),
    ("proto/limber/v1/scene.proto", "message Material {", "message Material { message Part { MeshFile file = 1; }", "into Material_Part.file"),
    ("proto/limber/v1/scene.proto", "message Material {", "message Material { map<string, limber.v1.MeshFile> files = 3;", "into Material.files"),
    ("tests/fuzz/CMakeLists.txt", "files)", "files jobs)", "jobs is a target without a source"),
    ("tests/fuzz/CMakeLists.txt", "files)", ")", "files is a source that no target is made of"),
    ("tests/fuzz/README.md", "files", "jobs", "README.md: does not name the target files"),
    ("scripts/fuzz", "files", "jobs", "scripts/fuzz: does not name the target files"),
]

wrong = [f"named without reason: {fault}" for fault in fuzz_targets.faults_of(WHOLE)]
for path, before, after, said in GAPS:
    assert before in WHOLE[path], (path, before)
    faults = fuzz_targets.faults_of({**WHOLE, path: WHOLE[path].replace(before, after)})
    if (faults != []) if said is None else (len(faults) != 1 or said not in faults[0]):
        wrong.append(f"{path}, {after!r}: {faults} in place of {said!r}")
without = {path: text for path, text in WHOLE.items() if "/corpus/" not in path}
if fuzz_targets.faults_of(without) != ["tests/fuzz/corpus/files: has no inputs"]:
    wrong.append("a target without inputs is not named")
print("\n".join(wrong) or f"{sum(said is not None for *_, said in GAPS) + 1} gaps were named")
sys.exit(1 if wrong else 0)
