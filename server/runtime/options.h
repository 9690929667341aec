#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "server/runtime/live.h"
#include "server/store/options.h"
#include "server/transport/transport.h"

namespace limber::server {

/// Enforced, and named in the errors that enforce them. May change while the server runs
/// (Server::set_limits).
struct ServiceLimits {
  Live<std::uint32_t> sessions = 1000;
  Live<std::uint64_t> mesh_tets = 500'000;
  Live<std::uint32_t> frames = 100'000;
  Live<std::uint32_t> constraints = 4096;          // per session
  Live<std::uint32_t> jobs = 8;                    // running at once, besides openings
  Live<std::uint64_t> session_bytes = 8ull << 30;  // estimated before a session is built
  Live<std::uint64_t> memory_bytes =
      0;  // of all sessions together; 0: three quarters of the machine's
  Live<std::uint32_t> waits = 10'000;          // requests that wait for a result or a job
  Live<std::uint32_t> client_requests = 1000;  // of one client that wait or run
  Live<std::uint32_t> sure_requests = 64;  // of one client that may wait however many others wait
  Live<std::uint64_t> queued_request_bytes = 1ull
                                             << 30;  // of heavy requests that wait for a thread
};

/// Whether a client may end the server by a Shutdown request. Signals always may.
enum class ShutdownRequests { kRefused, kAllowed };

struct ServerOptions {
  TransportOptions transport;
  ShutdownRequests shutdown_requests = ShutdownRequests::kRefused;
  ServiceLimits limits;
  std::vector<std::filesystem::path> mesh_roots;  // MeshSource.path may name files below these
  /// Stored sessions without requests for so long are parked; 0: only to make room for others.
  std::chrono::seconds park_after{900};
  std::filesystem::path cache_folder;        // of built models; empty: none
  std::optional<store::StoreOptions> store;  // of sessions; nothing: they end with the server
  int session_threads = 0;  // builds and solves; 0: --max-jobs and the number of cores together
  int request_threads = 3;  // heavy requests: parsing of meshes, encoding of frames, long edits;
                            // and as many for patient ones, such as exports
  std::chrono::milliseconds grace{2000};  // from the wish to stop to the end
  /// Server::request_drain(): the time before that for open requests, at most.
  Live<double> drain_s = 10.0;

  /// How often the status of every session is published again: subscribers that missed the
  /// last frames of a motion learn from it that there are newer ones.
  std::chrono::milliseconds status_interval{2000};

  /// @throws Refusal naming the option
  void validate() const;
};

}  // namespace limber::server
