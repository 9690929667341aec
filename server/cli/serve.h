#pragma once

#include <filesystem>
#include <optional>

#include "server/kinds/registry.h"
#include "server/web/options.h"

namespace limber::server {

struct ServeOptions {
  ServerOptions server;
  std::optional<web::Options> web;    // the gateway for pages; nothing: none
  std::filesystem::path ready_file;   // written once the sockets are bound; empty: none
  std::filesystem::path curve_allow;  // read again on SIGHUP; empty: none
};

/// Runs until SIGINT, SIGTERM or a shutdown request; a second of these signals ends the process at
/// once. SIGHUP reads the allowed keys again.
/// @param make_kinds  the kinds that it has
int serve(const ServeOptions& options, const MakeKinds& make_kinds);

}  // namespace limber::server
