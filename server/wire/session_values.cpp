#include "server/wire/session_values.h"

#include <algorithm>
#include <cmath>

#include "server/wire/enum_table.h"

namespace limber::server {

namespace {

constexpr EnumTable<session::State, proto::SessionState, proto::SESSION_STATE_CLOSED>
    kSessionStates{{session::State::kBuilding, proto::SESSION_STATE_BUILDING},
                   {session::State::kReady, proto::SESSION_STATE_READY},
                   {session::State::kFailed, proto::SESSION_STATE_FAILED},
                   {session::State::kClosed, proto::SESSION_STATE_CLOSED}};

}  // namespace

proto::SessionState encode_state(session::State state) { return kSessionStates.encode(state); }

proto::Progress encode_progress(const session::Progress& progress) {
  proto::Progress message;
  message.set_stage(progress.stage);
  message.set_fraction(
      std::isfinite(progress.fraction) ? std::min(1.0, std::max(0.0, progress.fraction)) : 0.0);
  return message;
}

proto::ResultInfo encode_header(const session::ResultHeader& header) {
  proto::ResultInfo info;
  info.set_revision(header.revision);
  info.set_sequence(header.sequence);
  info.set_converged(header.is_final);
  info.set_solve_failed(header.solve_failed);
  info.set_since_edit_ms(header.since_edit_ms);
  return info;
}

}  // namespace limber::server
