#include "server/wire/session_values.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string>
#include <string_view>

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

proto::SessionUse use_of(const proto::SessionStatus& status) {
  constexpr std::string_view kPrefix = "SESSION_STATE_";
  proto::SessionUse use;
  use.set_session(status.session());
  use.set_uid(status.uid());
  use.set_kind(status.kind());
  std::string state = proto::SessionState_Name(status.state());
  if (state.starts_with(kPrefix)) state.erase(0, kPrefix.size());
  for (char& c : state) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  use.set_state(state);
  use.set_people(static_cast<std::uint32_t>(status.clients_size()));
  use.set_edits(status.revision());
  if (status.state() != proto::SESSION_STATE_PARKED) use.set_bytes(status.memory_bytes());
  return use;
}

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
