#pragma once

#include <filesystem>

#include "server/service/options.h"

namespace limber::server {

struct ServeOptions {
  ServerOptions server;
  std::filesystem::path ready_file;  // written once the sockets are bound; empty: none
};

/// Runs until SIGINT, SIGTERM or a shutdown request; a second signal ends the process at once.
int serve(const ServeOptions& options);

}  // namespace limber::server
