#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>

#include "limber/v1/service.pb.h"
#include "server/kinds/registry.h"
#include "server/runtime/hub.h"
#include "server/runtime/reply_parts.h"
#include "server/runtime/stored_replies.h"
#include "server/runtime/ticket.h"
#include "server/service/client_directory.h"
#include "server/service/heavy_requests.h"
#include "server/service/kept_sessions.h"
#include "server/service/session_registry.h"
#include "server/wire/peek.h"

namespace limber::server {

/// Requests to answers. Light ones (few edits, waits, status) are handled on the transport's
/// thread, in the order of arrival. Heavy ones (meshes, frames) run on a pool, in any order.
/// Patient ones (exports, starts of jobs) run on another pool, at the priority of jobs. Many edits
/// of a session are made on the pool, too. While they run, later requests of the client to this
/// session are handled after them, in the order of arrival.
class Service {
 public:
  /// @param request_stop  called when a client asks for shutdown
  Service(Hub& hub, Kinds kinds, std::function<void()> request_stop);

  /// On the transport's thread. Never throws.
  void handle(Address address, zmq::message_t payload) noexcept;
  void subscribed(const std::string& prefix, Has has);
  /// Now and then: parks unused sessions, on the pool.
  void park_idle();
  /// Publishes the status of parked sessions: subscribers send requests after a silence.
  void publish_all_parked();
  [[nodiscard]] std::string overflow_reply(const Address& address,
                                           const UnreadReplies::Excess& excess) const;
  /// A reply did not reach this client: its requests that wait for a thread are dropped.
  void gone(const std::string& client);
  /// Its connection has ended: what waits for a result, a job or a thread for it is released.
  void disconnected(const std::string& client);

  /// Any thread: clients in place of those that were allowed, as somebody has read them from the
  /// list. It is read again: requests may have changed it meanwhile.
  void allow(AllowedKeys keys);

  /// Any thread: those that wait for a thread.
  void refuse_waiting(const Refusal& refusal);

  [[nodiscard]] SessionRegistry& sessions() { return sessions_; }
  [[nodiscard]] const SessionRegistry& sessions() const { return sessions_; }

  // Any thread:
  /// Without token and `status`.
  [[nodiscard]] proto::GetServerInfoResponse info() const;
  void describe_status(proto::ServerStatus& status) const;
  /// Reasons to send no clients now, a sentence each; empty: it is ready.
  [[nodiscard]] std::vector<std::string> not_ready() const;
  /// From now on; open sessions and running jobs stay.
  void set_limits(const ServiceLimits& limits);

 private:
  using Request = proto::Request;

  // verbs.cpp: one row for each kind of request.
  /// The thread of a request: the transport's, or one of a pool; a patient one has lower priority,
  /// since its answer is not animated.
  enum class Lane { kLight, kHeavy, kPatient };
  /// Requests that leave something behind are done once, however often they come.
  enum class Effect { kNone, kLasting };
  struct Verb {
    Lane lane = Lane::kLight;
    Effect effect = Effect::kNone;
    void (Service::*handle)(const SharedTicket& ticket, const Request& request) = nullptr;
    /// For requests about a session: their subject, which other kinds lack.
    const char* subject = "";
  };
  /// @param body  Request::BodyCase, or any other number that a client may send
  [[nodiscard]] static Verb verb_of(int body);
  /// A row's handler of a handler that returns its response, or that answers the ticket itself.
  template <auto kRequest, auto kReply, auto kHandler>
  void reply(const SharedTicket& ticket, const Request& request);
  template <auto kRequest, auto kHandler>
  void reply_later(const SharedTicket& ticket, const Request& request);
  void refuse_empty(const SharedTicket& ticket, const Request& request);

  /// Whether the request came before: then its reply is sent again, or will be when it is there.
  /// @throws Refusal for another request under the id of an earlier one
  [[nodiscard]] bool came_before(const SharedTicket& ticket, const Address& address,
                                 const RequestPeek& peek, const zmq::message_t& payload);
  void dispatch(const SharedTicket& ticket, int body, zmq::message_t payload);
  void work_on(HeavyRequests::Request request);
  void work_patiently_on(HeavyRequests::Request request);
  /// Takes a patient request when its turn among the edits of its session comes. @returns whether
  /// it is one
  [[nodiscard]] bool pass_to_patient(HeavyRequests::Request& request);
  /// Drops what the client has waiting for a thread, unless it was repeated on another connection.
  void drop_waiting(const std::string& client);
  /// May it be made on the transport's thread?
  [[nodiscard]] bool is_light_edit(const Request& request) const;
  void carry_out(const SharedTicket& ticket, const Request& request);
  [[nodiscard]] bool wait_for_return(const SharedTicket& ticket, const Request& request);
  void carry_out_again(const SharedTicket& ticket, const Request& request);

  /// Requests about a session that not all kinds have: by its record.
  void ask_session(const SharedTicket& ticket, const Request& request);
  /// Requests without a session that one kind has.
  void ask_kinds(const SharedTicket& ticket, const Request& request);

  // handlers_session.cpp
  void open_session(const SharedTicket& ticket, const Request& request);
  [[nodiscard]] std::shared_ptr<Record> open(const proto::OpenSessionRequest& request,
                                             const std::string& client,
                                             proto::OpenSessionResponse& response,
                                             std::unique_lock<std::recursive_mutex>& order);
  proto::EditResponse edit(Record& record, const proto::EditRequest& request,
                           const session::Author& author);
  void take_design(const SharedTicket& ticket, const Request& request);
  /// For a revision that a request has made: it is stored, if sessions are, and then answered.
  void keep_edit(const SharedTicket& ticket, const Request& request, Record& record,
                 std::uint64_t revision, proto::Reply reply);
  void wait(const proto::WaitRequest& request, const SharedTicket& ticket);
  proto::ListSessionsResponse list_sessions(const proto::ListSessionsRequest&) const;
  proto::GetSessionResponse get_session(const proto::GetSessionRequest& request);
  void close(const proto::CloseSessionRequest& request, const SharedTicket& ticket);
  proto::SaveSessionResponse save_session(const proto::SaveSessionRequest& request);
  void restore_session(const proto::RestoreSessionRequest& request, const SharedTicket& ticket);
  proto::CancelResponse cancel(const proto::CancelRequest& request);
  void drop(const std::shared_ptr<Record>& record);
  void demand_store() const;
  /// Keys of clients that the list of keys has names for, by these.
  [[nodiscard]] std::string with_names_of_keys(std::string text) const;

  // handlers_presence.cpp
  void edit_session(const SharedTicket& ticket, const Request& request);
  void join_session(const SharedTicket& ticket, const Request& request);
  void leave_session(const SharedTicket& ticket, const Request& request);
  Attendance::Joined enter(Record& record, const Ticket& ticket, const ClientIdentity& client);
  /// The author of a revision counts as present in the session.
  void note_revision(Record& record, const Ticket& ticket, const std::string& name,
                     std::uint64_t revision, std::vector<std::string> edits);
  void leave_all(const std::string& client);

  // handlers_streams.cpp
  void follow(const SharedTicket& ticket, const Request& request);

  // handlers_frames.cpp
  proto::GetGeometryResponse get_geometry(const proto::GetGeometryRequest& request);
  proto::GetFramesResponse get_frames(const proto::GetFramesRequest& request);
  proto::GetFramesResponse get_job_frames(const proto::GetFramesRequest& request) const;
  proto::ExportResponse export_part(const proto::ExportRequest& request);
  void get_reply_part(const proto::GetReplyPartRequest& request, const SharedTicket& ticket);
  [[nodiscard]] std::uint64_t most_bytes_of(const proto::GetFramesRequest& request) const;
  void demand_message_room(std::uint64_t frame_bytes) const;

  // handlers_scene.cpp
  proto::ValidateSceneResponse validate_scene(const proto::ValidateSceneRequest& request) const;
  proto::GetSampleResponse get_sample(const proto::GetSampleRequest& request) const;

  // handlers_server.cpp
  void server_info(const proto::GetServerInfoRequest& request, const SharedTicket& ticket) const;
  // server_status.cpp
  [[nodiscard]] std::vector<std::string> faults() const;
  void describe_readers(proto::QueueUse& queues) const;
  void get_job(const proto::GetJobRequest& request, const SharedTicket& ticket);
  proto::ListJobsResponse list_jobs(const proto::ListJobsRequest&) const;
  void shut_down(const proto::ShutdownRequest&, const SharedTicket& ticket);
  // handlers_access.cpp
  proto::ListAllowedResponse list_allowed(const proto::ListAllowedRequest&) const;
  void allow_key(const proto::AllowRequest& request, const SharedTicket& ticket);
  void revoke_key(const proto::RevokeRequest& request, const SharedTicket& ticket);
  void change_list(const Ticket& ticket, const std::function<void(AllowList&)>& change);

  // @throws Refusal LIMIT_EXCEEDED: one more that is not answered at once, of this client, of all
  void demand_room_of_client(const Ticket& ticket) const;
  void demand_room_behind(const Ticket& ticket) const;  // of requests that are soon done
  void demand_room_to_wait(const Ticket& ticket) const;
  /// @throws Refusal INVALID_ARGUMENT for a time that is negative or longer than a day
  static double checked_seconds(double seconds, const char* field);

  Hub& hub_;
  const Kinds kinds_;
  SceneContext scenes_;
  std::function<void()> request_stop_;
  SessionRegistry sessions_;
  KeptSessions kept_;
  std::atomic<bool> is_parking_{false};
  ClientDirectory clients_;
  std::mutex list_order_;  // of changes of the list of keys
  StoredReplies replies_;
  ReplyParts reply_parts_;
  WaitingBytes waiting_bytes_;  // of both
  HeavyRequests heavy_, patient_;
};

}  // namespace limber::server
