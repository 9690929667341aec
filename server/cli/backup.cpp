#include "server/cli/backup.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "server/store/backup.h"

namespace limber::server {
namespace {

struct Line {
  std::filesystem::path folder, file;
  bool replaces = false, is_json = false;
};

int run_backup(const Line& line) {
  const store::Backup backup =
      store::back_up(line.folder, line.file,
                     line.replaces ? store::Existing::kIsReplaced : store::Existing::kIsRefused);
  if (line.is_json) {
    fmt::print("{{\"sessions\": \"{}\", \"bytes\": \"{}\"}}\n", backup.sessions, backup.bytes);
  } else {
    fmt::print("{}: {} session{}, {:.1f} MB\n", line.file.string(), backup.sessions,
               backup.sessions == 1 ? "" : "s", static_cast<double>(backup.bytes) * 1e-6);
  }
  return 0;
}

}  // namespace

void add_backup_command(CLI::App& app, std::function<int()>& chosen) {
  auto line = std::make_shared<Line>();
  auto* backup = app.add_subcommand(
      "backup", "Copy the store of a folder into one file, also while a server has the folder");
  backup->add_option("folder", line->folder, "Folder of --data")->required();
  backup->add_option("file", line->file, "Copy to make; it gets this name once it is whole")
      ->required();
  backup->add_flag("--replace", line->replaces, "FILE may be there, and is replaced");
  backup->add_flag("--json", line->is_json, "The number of sessions and bytes as JSON");
  backup->callback([line, &chosen] { chosen = [line] { return run_backup(*line); }; });
}

}  // namespace limber::server
