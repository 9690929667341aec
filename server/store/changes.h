#pragma once

#include <cstdint>
#include <string>
#include <variant>

namespace limber::server::store {

/// What is written of sessions. Messages are given as bytes, their types in proto/.

/// A session that was opened; another one of its name goes.
struct OpenedSession {
  std::uint64_t uid = 0;
  std::string name, kind;
  std::string scene;      // Scene
  std::string status;     // SessionStatus, for lists
  std::string seal = {};  // made by the store
};
/// An accepted request of edits.
struct EditedSession {
  std::uint64_t uid = 0, revision = 0;
  std::string edit;  // StoredEdit
};
/// Stands for the edits of a session up to a revision: they go.
struct SavedCheckpoint {
  std::uint64_t uid = 0, revision = 0;
  std::string checkpoint;  // StoredCheckpoint
};
/// The newest answer of a session.
struct KeptAnswer {
  std::string answer;  // StoredAnswer
  std::string status;  // SessionStatus, for lists; empty: the stored one stays
};
struct ClosedSession {
  std::uint64_t uid = 0;
};
/// The reply to a request that changed something: a repetition gets it again.
struct KeptReply {
  std::string client;
  std::uint64_t id = 0, hash = 0;
  std::string reply;  // Reply
};
/// A server that has the store.
struct StartedRun {
  std::string instance;
};
using Change = std::variant<OpenedSession, EditedSession, SavedCheckpoint, ClosedSession, KeptReply,
                            StartedRun>;

/// The stored data of a session at the start of the server, without the long parts.
struct StoredHead {
  std::uint64_t uid = 0, revision = 0;
  std::string name, kind, status;
  std::uint64_t touched_s = 0;  // when it was last changed [s since 1970]
};

}  // namespace limber::server::store
