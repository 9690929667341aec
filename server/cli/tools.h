#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "server/cli/recover.h"
#include "server/cli/tetrahedralize.h"
#include "server/kinds/registry.h"

namespace limber::server {

/// The commands of limberd that need no server: validate, sample, tetrahedralize, simulate,
/// recover, backup, keygen, allow, revoke, allowed.
class ToolCommands {
 public:
  /// @param make_kinds  kinds with scenes that can be validated
  void add_to(CLI::App& app, const MakeKinds& make_kinds);
  /// The exit code of the command that was given; nothing if none was.
  std::optional<int> run() const;

 private:
  void add_recover(CLI::App& app);
  void add_tetrahedralize(CLI::App& app);

  std::filesystem::path input_, output_, scene_output_;
  std::string name_;
  TetrahedralizeCommand tetrahedralize_;
  RecoverOptions recovery_;
  std::function<int()> chosen_;
};

}  // namespace limber::server
