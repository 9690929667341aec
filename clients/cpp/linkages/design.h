#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/cpp/client.h"
#include "clients/cpp/session_reference.h"

namespace limber::client {

/// The designs of a session of a rod linkage: rest lengths for a surface or targets, searched live.
/// Every call may throw ClientError as Client::call. Several may name the same session; must not
/// outlive its client.
class LinkageDesign {
 public:
  static constexpr Milliseconds kLarge{120000};  // for answers to requests that bring a surface

  /// For an existing session, as NAME or NAME@UID; nothing is sent.
  LinkageDesign(Client& client, std::string session, Naming naming = Naming::kByUid);

  /// Begins one; fields that are left out have the server's default. @param request  its session is
  /// put in
  /// @returns the job
  std::uint64_t start(v1::StartDesignRequest request);
  /// Changes the goal; absent fields stay. @param request  its session is put in
  v1::ChangeDesignResponse change(v1::ChangeDesignRequest request);
  v1::PauseDesignResponse pause();
  v1::ResumeDesignResponse resume();
  /// And waits until it has ended: edits are taken again. @throws ClientError TIMEOUT
  v1::StopDesignResponse stop(Milliseconds timeout = kLarge);
  /// The best rest lengths become the session's; a running design ends. @returns the revision
  std::uint64_t take(std::optional<std::uint64_t> expected_revision = {},
                     Milliseconds timeout = kLarge);
  /// The newest, begun by any client, with the sizes that take() would bring.
  [[nodiscard]] v1::GetDesignResponse newest();
  /// State of the newest, begun by any client; nothing before the first.
  [[nodiscard]] std::optional<v1::DesignInfo> info();
  /// For each segment, the length that take() would bring [length unit]; empty if there is none.
  [[nodiscard]] std::vector<double> best_lengths();
  /// Waits until the newest has ended. @throws ClientError of its failure; TIMEOUT;
  /// FAILED_PRECONDITION if there is none
  [[nodiscard]] v1::DesignInfo wait(Milliseconds timeout = Milliseconds{600000});
  /// The same, however it ended. @throws ClientError TIMEOUT; FAILED_PRECONDITION
  v1::DesignInfo wait_until_ended(Milliseconds timeout = Milliseconds{600000});

 private:
  template <class Request>
  typename Rpc<Request>::Response act();

  Client* client_;
  SessionReference session_;
};

}  // namespace limber::client
