// The table of requests: for each where it is handled, whether it leaves something behind, and by
// whom it is answered. A request without a row does not compile: the switch has no default.
#include <mutex>
#include <optional>

#include "server/service/service.h"
#include "server/wire/errors.h"

namespace limber::server {
namespace {

/// The body of a Request or Reply: the member of its oneof; null if it is empty.
const google::protobuf::FieldDescriptor* body_of(const google::protobuf::Message& message) {
  return message.GetReflection()->GetOneofFieldDescriptor(
      message, message.GetDescriptor()->FindOneofByName("body"));
}

/// The member `session` that every request about a session has.
std::string requested_session(const proto::Request& request) {
  const auto* body = body_of(request);
  LIMBER_DEMAND(body != nullptr);
  const auto& message = request.GetReflection()->GetMessage(request, body);
  const auto* session = message.GetDescriptor()->FindFieldByName("session");
  LIMBER_DEMAND(session != nullptr);
  return message.GetReflection()->GetString(message, session);
}

/// The member `revision` of the answer to a request that makes one.
std::optional<std::uint64_t> revision_of(const proto::Reply& reply) {
  const auto* body = body_of(reply);
  if (body == nullptr) return std::nullopt;
  const auto& message = reply.GetReflection()->GetMessage(reply, body);
  const auto* revision = message.GetDescriptor()->FindFieldByName("revision");
  if (revision == nullptr) return std::nullopt;
  return message.GetReflection()->GetUInt64(message, revision);
}

}  // namespace

template <auto kRequest, auto kReply, auto kHandler>
void Service::reply(const SharedTicket& ticket, const Request& request) {
  proto::Reply reply;
  *(reply.*kReply)() = (this->*kHandler)((request.*kRequest)());
  ticket->answer(std::move(reply));
}

template <auto kRequest, auto kHandler>
void Service::reply_later(const SharedTicket& ticket, const Request& request) {
  (this->*kHandler)((request.*kRequest)(), ticket);
}

void Service::ask_session(const SharedTicket& ticket, const Request& request) {
  const auto record = kept_.find(requested_session(request));
  proto::Reply reply;
  const Verb verb = verb_of(request.body_case());
  if (verb.effect == Effect::kLasting)
    (void)ClientDirectory::identify(*ticket, request.client_name());
  std::unique_lock order(record->edit_order(), std::defer_lock);
  // The one such request that is an edit; others may take long.
  if (kept_.is_on() && request.has_take_design()) order.lock();
  if (!record->answer(request, reply)) throw record->lacks(verb.subject);
  const auto revision = revision_of(reply);
  if (!revision || verb.effect != Effect::kLasting) {
    ticket->answer(std::move(reply));
    return;
  }
  note_revision(*record, *ticket, request.client_name(), *revision, {body_of(request)->name()});
  keep_edit(ticket, request, *record, *revision, std::move(reply));
}

void Service::ask_kinds(const SharedTicket& ticket, const Request& request) {
  proto::Reply reply;
  if (!kinds_.answer(request, reply, hub_, scenes_)) {
    throw Refusal(proto::ERROR_CODE_UNSUPPORTED, "body",
                  "this server has not the kind of scene that the request is for");
  }
  ticket->answer(std::move(reply));
}

void Service::refuse_empty(const SharedTicket&, const Request&) {
  throw invalid("body", "a request without content");
}

Service::Verb Service::verb_of(int body) {
  using Reply = proto::Reply;
  using S = Service;
  constexpr Lane kLight = Lane::kLight, kHeavy = Lane::kHeavy, kPatient = Lane::kPatient;
  constexpr Effect kNone = Effect::kNone, kLasting = Effect::kLasting;
  switch (static_cast<Request::BodyCase>(body)) {
    case Request::kGetServerInfo:
      return {kLight, kNone, &S::reply_later<&Request::get_server_info, &S::server_info>};
    case Request::kOpenSession:
      return {kHeavy, kLasting, &S::open_session};
    case Request::kListSessions:
      return {kLight, kNone,
              &S::reply<&Request::list_sessions, &Reply::mutable_list_sessions, &S::list_sessions>};
    case Request::kGetSession:
      return {kHeavy, kNone,
              &S::reply<&Request::get_session, &Reply::mutable_get_session, &S::get_session>};
    case Request::kCloseSession:
      return {kHeavy, kLasting, &S::reply_later<&Request::close_session, &S::close>};
    case Request::kEdit:
      return {kLight, kLasting, &S::edit_session};
    case Request::kWait:
      return {kLight, kNone, &S::reply_later<&Request::wait, &S::wait>};
    case Request::kGetMaterial:
      return {kHeavy, kNone, &S::ask_session, "fitted material"};
    case Request::kGetGeometry:
      return {kHeavy, kNone,
              &S::reply<&Request::get_geometry, &Reply::mutable_get_geometry, &S::get_geometry>};
    case Request::kGetFrames:
      return {kHeavy, kNone,
              &S::reply<&Request::get_frames, &Reply::mutable_get_frames, &S::get_frames>};
    case Request::kExport:
      return {kPatient, kNone,
              &S::reply<&Request::export_, &Reply::mutable_export_, &S::export_part>};
    case Request::kCancel:
      return {kLight, kLasting, &S::reply<&Request::cancel, &Reply::mutable_cancel, &S::cancel>};
    case Request::kSolveCold:
      return {kLight, kLasting, &S::ask_session, "cold solve"};
    case Request::kValidateScene:
      return {
          kPatient, kNone,
          &S::reply<&Request::validate_scene, &Reply::mutable_validate_scene, &S::validate_scene>};
    case Request::kGetSample:
      return {kPatient, kNone,
              &S::reply<&Request::get_sample, &Reply::mutable_get_sample, &S::get_sample>};
    case Request::kTetrahedralize:
      return {kPatient, kLasting, &S::ask_kinds};
    case Request::kSimulate:
      return {kPatient, kLasting, &S::ask_kinds};
    case Request::kRecover:
      return {kPatient, kLasting, &S::ask_kinds};
    case Request::kStartDesign:
      return {kHeavy, kLasting, &S::ask_session, "design"};
    case Request::kChangeDesign:
      return {kHeavy, kLasting, &S::ask_session, "design"};
    case Request::kPauseDesign:
      return {kLight, kLasting, &S::ask_session, "design"};
    case Request::kResumeDesign:
      return {kLight, kLasting, &S::ask_session, "design"};
    case Request::kStopDesign:
      return {kLight, kLasting, &S::ask_session, "design"};
    case Request::kTakeDesign:
      return {kLight, kLasting, &S::take_design, "design"};
    case Request::kGetDesign:
      return {kHeavy, kNone, &S::ask_session, "design"};
    case Request::kMakeStartingGrid:
      return {kPatient, kNone, &S::ask_kinds};
    case Request::kSolveBeams:
      return {kPatient, kLasting, &S::ask_kinds};
    case Request::kGetBeamSolution:
      return {kHeavy, kNone, &S::ask_session, "solution of beams"};
    case Request::kExplain:
      return {kHeavy, kNone, &S::ask_session, "explanation"};
    case Request::kLookAt:
      return {kLight, kNone, &S::ask_session, "long motion"};
    case Request::kSaveSession:
      return {kPatient, kNone,
              &S::reply<&Request::save_session, &Reply::mutable_save_session, &S::save_session>};
    case Request::kRestoreSession:
      return {kHeavy, kLasting, &S::reply_later<&Request::restore_session, &S::restore_session>};
    case Request::kJoinSession:
      return {kLight, kNone, &S::join_session};
    case Request::kLeaveSession:
      return {kLight, kNone, &S::leave_session};
    case Request::kFollow:
      return {kLight, kNone, &S::follow};
    case Request::kGetReplyPart:
      return {kLight, kNone, &S::reply_later<&Request::get_reply_part, &S::get_reply_part>};
    case Request::kGetJob:
      return {kLight, kNone, &S::reply_later<&Request::get_job, &S::get_job>};
    case Request::kListJobs:
      return {kLight, kNone,
              &S::reply<&Request::list_jobs, &Reply::mutable_list_jobs, &S::list_jobs>};
    case Request::kShutdown:
      return {kLight, kLasting, &S::reply_later<&Request::shutdown, &S::shut_down>};
    case Request::kAllow:
      return {kHeavy, kLasting, &S::reply_later<&Request::allow, &S::allow_key>};
    case Request::kRevoke:
      return {kHeavy, kLasting, &S::reply_later<&Request::revoke, &S::revoke_key>};
    case Request::kListAllowed:
      return {kHeavy, kNone,
              &S::reply<&Request::list_allowed, &Reply::mutable_list_allowed, &S::list_allowed>};
    case Request::BODY_NOT_SET:
      break;
  }
  return {kLight, kNone, &S::refuse_empty};
}

}  // namespace limber::server
