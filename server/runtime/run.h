#pragma once

#include <atomic>
#include <cstdint>
#include <string>

#include "server/wire/errors.h"

namespace limber::server {

/// One run of the server. Random, so that no two runs share their ids.
struct Run {
  std::string instance;        // 16 hexadecimal digits
  std::uint64_t first_id = 0;  // the ids that this run gives are greater

  [[nodiscard]] static Run begin();
};

/// Ids of sessions or jobs, never given twice, neither in this run nor in another one. They have 16
/// decimal digits (exact in JSON's doubles): the first ten are random for the run, and the last six
/// count. Thread-safe.
class RunIds {
 public:
  explicit RunIds(std::uint64_t first) : first_(first), last_(first) {}

  [[nodiscard]] std::uint64_t next() { return last_.fetch_add(1) + 1; }
  /// Another run of a server gave this id.
  [[nodiscard]] bool is_of_another_run(std::uint64_t id) const;

 private:
  const std::uint64_t first_;
  std::atomic<std::uint64_t> last_;
};

/// A session's name may be taken again once it is closed; its uid is never reused.
struct SessionKey {
  std::string name;
  std::uint64_t uid = 0;

  /// "NAME@UID", by which requests reach this very session.
  [[nodiscard]] std::string reference() const;
  /// @param text  NAME or NAME@UID; uid is 0 without one
  /// @throws Refusal INVALID_ARGUMENT for a UID that is none, or not written as reference() does
  [[nodiscard]] static SessionKey parse(const std::string& text);
};

/// RESTARTED: the request refers to another run.
/// @param what  e.g. "job 7"; empty: the request as a whole
[[nodiscard]] Refusal restarted(const std::string& field, const std::string& what);

}  // namespace limber::server
