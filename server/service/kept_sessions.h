#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "limber/v1/stored.pb.h"
#include "server/kinds/registry.h"
#include "server/runtime/stored_replies.h"
#include "server/runtime/ticket.h"
#include "server/service/checkpoints.h"
#include "server/service/session_parking.h"
#include "server/service/session_registry.h"

namespace limber::server {

/// Sessions and the store of the server. It writes requests that change a session before they are
/// acknowledged, brings sessions back, and adds them to the registry. Without a store, nothing is
/// written. Thread-safe.
class KeptSessions {
 public:
  KeptSessions(Hub& hub, const Kinds& kinds, const SceneContext& scenes, SessionRegistry& sessions)
      : hub_(hub),
        kinds_(kinds),
        scenes_(scenes),
        sessions_(sessions),
        parking_(hub, sessions),
        checkpoints_(hub) {}

  [[nodiscard]] bool is_on() const { return hub_.store != nullptr; }
  /// At the start: stored sessions are parked, and replies of before are known again.
  void recall(StoredReplies& replies);
  /// Whether a server of this instance had these sessions before: what a client says of its
  /// sessions is true of this one's, too.
  [[nodiscard]] bool had(const std::string& instance) const { return runs_.contains(instance); }
  /// Before a change is made. @throws Error{kIo} while the store cannot be written
  void demand_writable() const;

  /// For a change that was made: it is written, and then answered. If it could not be written, the
  /// answer reports it.
  /// @param undo  called where a session that was opened could not be written
  void opened(const SharedTicket& ticket, const std::shared_ptr<Record>& record,
              const proto::Scene& scene, proto::Reply reply, std::function<void()> undo);
  /// @param made  what the record says of it; with its edit_order()
  /// @param name  public name of the author
  void edited(const SharedTicket& ticket, Record& record, std::uint64_t revision,
              const proto::EditRequest& made, const std::string& name,
              const session::Author& author, proto::Reply reply);
  void closed(const SharedTicket& ticket, std::uint64_t uid, proto::Reply reply);

  /// The job of a session's opening, which cancels its work.
  [[nodiscard]] JobId start_open_job(const SessionKey& key);
  [[nodiscard]] SessionParking& parking() { return parking_; }
  [[nodiscard]] const SessionParking& parking() const { return parking_; }
  /// Into the registry; failed ones that had to go for it are closed.
  void put(const std::shared_ptr<Record>& record);
  /// A session that has to go for another: it is closed.
  void give_way(Record& record);

  /// The session of a reference, brought back if it was parked: its scene is read, it begins at its
  /// checkpoint, the later edits are made again, and its model is built.
  /// @throws as SessionRegistry::find(); Error{kIo, "session"} if the stored session cannot be read
  [[nodiscard]] std::shared_ptr<Record> find(const std::string& reference);
  /// A session as one message. @throws as find()
  [[nodiscard]] proto::StoredSession load(const std::string& reference);
  struct Restored {
    std::shared_ptr<Record> record;
    /// Its edit_order(): until its release, the session is neither edited nor closed.
    std::unique_lock<std::recursive_mutex> order;
  };
  /// Makes a session of a stored one, under a name that is reserved for it.
  [[nodiscard]] Restored restore(const SessionKey& key, const proto::StoredSession& stored) {
    return restore(key, stored, scenes_, nullptr);
  }
  /// Writes all of a session that was restored from a file. With its edit_order(), held since
  /// before it was in the registry: changes by others are written after it.
  void imported(const SharedTicket& ticket, Record& record, const proto::StoredSession& stored,
                proto::Reply reply, std::function<void()> undo);

 private:
  /// @param undo  where it is given, what cannot be written is forgotten
  void write(const SharedTicket& ticket, std::vector<store::Change> changes, proto::Reply reply,
             std::function<void()> undo = nullptr);
  static void recall_makers(Record& record, const proto::StoredSession& stored);
  void bring_back(const SessionRegistry::Parked& parked);
  [[nodiscard]] Restored restore(const SessionKey& key, const proto::StoredSession& stored,
                                 const SceneContext& scenes,
                                 const std::shared_ptr<Attendance>& people);

  Hub& hub_;
  const Kinds& kinds_;
  const SceneContext& scenes_;
  SessionRegistry& sessions_;
  SessionParking parking_;
  Checkpoints checkpoints_;
  std::set<std::string> runs_;  // instances of before
  std::mutex mutex_;
  std::condition_variable brought_back_;
  std::set<std::string> coming_;  // names of sessions that some thread is bringing back
};

}  // namespace limber::server
