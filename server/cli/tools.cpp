#include "server/cli/tools.h"

#include <fmt/format.h>

#include <fstream>

#include "engine/scene/mesh_formats.h"
#include "engine/scene/samples.h"
#include "server/codec/errors.h"
#include "server/codec/scene_json.h"
#include "server/service/mesh_sources.h"
#include "server/service/scene_files.h"
#include "server/transport/curve.h"

namespace limber::server {
namespace {

namespace fs = std::filesystem;

/// Of a scene file: paths are relative to it, and the user may name any file of theirs.
MeshLoader local_loader(const fs::path& scene_file) {
  return [folder = scene_file.parent_path()](const proto::MeshSource& source,
                                             const std::string& field) {
    if (!source.has_path()) return MeshSources({}).load(source, field);
    auto reading = scene::read_mesh_file(folder / source.path());
    return LoadedMesh{std::move(reading.mesh), std::move(reading.warnings)};
  };
}

int validate_file(const fs::path& file) {
  std::vector<proto::Issue> issues;
  try {
    issues = scene_issues(scene_from_json(scene::read_bytes(file)), "", {}, local_loader(file));
  } catch (const Refusal& fault) {
    fmt::print("error: {}{}{}\n", fault.field(), fault.field().empty() ? "" : ": ", fault.what());
    return 1;
  }
  bool usable = true;
  for (const auto& issue : issues) {
    const bool error = issue.severity() == proto::Issue::SEVERITY_ERROR;
    usable = usable && !error;
    fmt::print("{}: {}{}{}\n", error ? "error" : "warning", issue.field(),
               issue.field().empty() ? "" : ": ", issue.message());
  }
  if (usable) fmt::print("{}: can be opened\n", file.string());
  return usable ? 0 : 1;
}

int make_keys(const fs::path& file) {
  const CurveKeys keys = make_curve_keys();
  write_curve_keys(file, keys);
  fmt::print("{}: secret key (keep it)\n{}.pub: public key {}\n", file.string(), file.string(),
             keys.public_key);
  return 0;
}

}  // namespace

void ToolCommands::add_to(CLI::App& app) {
  auto* validate = app.add_subcommand(
      "validate", "Say what is wrong with a scene file, and where; exit code 1 on errors");
  validate->add_option("scene", input_, "Scene file (.json); a mesh path in it is relative to it")
      ->required();
  validate->callback([this] { chosen_ = [this] { return validate_file(input_); }; });

  auto* keygen = app.add_subcommand("keygen", "Make a CURVE key pair: FILE (secret) and FILE.pub");
  keygen->add_option("file", output_, "File of the secret key; must not exist")->required();
  keygen->callback([this] { chosen_ = [this] { return make_keys(output_); }; });
}

std::optional<int> ToolCommands::run() const {
  if (!chosen_) return std::nullopt;
  return chosen_();
}

}  // namespace limber::server
