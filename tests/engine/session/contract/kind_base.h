#pragma once

#include <memory>
#include <string>
#include <vector>

#include "engine/session/core/listener.h"
#include "tests/engine/session/contract/recording.h"

namespace limber::session::contract {

/// What the adapters of all kinds have in common.
/// @tparam ListenerOfKind  where a kind has more than Listener<ResultOfKind>
template <class SessionOfKind, class ResultOfKind, class EditOfKind,
          class ListenerOfKind = Listener<ResultOfKind>>
struct KindBase {
  using Session = SessionOfKind;
  using Result = ResultOfKind;
  using Edit = EditOfKind;
  using Edits = std::vector<Edit>;

  class Recorder final : public ListenerOfKind, public Recording {
    void on_progress(const Progress&) override { note_progress(); }
    void on_state(State state, const std::string& message) override { note_state(state, message); }
    void on_result(const std::shared_ptr<const Result>& result) override {
      note_result(header(*result));
    }
  };

  static std::shared_ptr<const Result> newest_result(const Session& session) {
    return session.newest_result();
  }
  static std::shared_ptr<const Result> final_result(const Session& session) {
    return session.final_result();
  }
  static ResultHeader header(const Result& result) {
    ResultHeader header;
    header.revision = result.revision;
    header.sequence = result.sequence;
    header.is_final = result.is_final;
    header.solve_failed = result.solve_failed;
    header.is_cancelled = result.report.status == decltype(result.report.status)::kCancelled;
    if constexpr (requires { result.check; }) header.is_amendment = result.check == Check::kDone;
    header.message = result.report.message;
    return header;
  }
};

}  // namespace limber::session::contract
