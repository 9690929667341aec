#include "server/runtime/options.h"

#include "server/wire/errors.h"

namespace limber::server {

void ServerOptions::validate() const {
  transport.validate();
  if (session_threads < 0 || session_threads > 1024)
    throw invalid("--threads", "must be in [0, 1024]");
  if (request_threads < 1 || request_threads > 1024)
    throw invalid("--request-threads", "must be in [1, 1024]");
  if (limits.sessions == 0) throw invalid("--max-sessions", "must be > 0");
  if (park_after.count() < 0) throw invalid("--park-after", "must be >= 0");
  if (limits.jobs == 0) throw invalid("--max-jobs", "must be > 0");
  if (limits.constraints == 0) throw invalid("--max-constraints", "must be > 0");
  if (!(drain_s >= 0) || drain_s > 86'400)
    throw invalid("--drain-seconds", "must be in [0, 86400]");
  if (limits.frames < 3) throw invalid("--max-frames", "must be >= 3");
  for (const auto& root : mesh_roots) {
    if (!std::filesystem::is_directory(root))
      throw invalid("--mesh-root", root.string() + " is no folder");
  }
}

}  // namespace limber::server
