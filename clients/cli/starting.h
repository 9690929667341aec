#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "clients/cli/context.h"
#include "limber/v1/service.pb.h"

namespace limber::cli {

/// How a limberd is started.
struct StartOptions {
  std::string stream, log;  // empty: chosen
  double wait_s = 20;
  std::vector<std::string> more;  // options of limberd
};

/// Folder of data that outlasts a server: $XDG_STATE_HOME/limber, or ~/.local/state/limber. Made if
/// it is not there.
[[nodiscard]] std::filesystem::path state_folder();

/// Whether one of limberd's options is among those handed over, as `--name X` or `--name=X`.
[[nodiscard]] bool hands_over(const StartOptions& options, const std::string& name);

enum class Start { kStarted, kRunsAlready };
/// Starts limberd in the background unless one answers, and waits until it is ready.
/// @param info  its description of itself
Start start_server(const Context& context, const StartOptions& options,
                   v1::GetServerInfoResponse& info);

/// Whether one answers. @param info  its description of itself then
[[nodiscard]] bool answers(const Context& context, client::Milliseconds patience,
                           v1::GetServerInfoResponse& info);

}  // namespace limber::cli
