// The table of requests: for each kind where it is handled, whether it leaves something behind, and
// by whom it is answered. A kind without a row does not compile: the switch has no default.
#include "server/service/service.h"
#include "server/wire/errors.h"

namespace limber::server {

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

void Service::refuse_empty(const SharedTicket&, const Request&) {
  throw invalid("body", "a request without content");
}

Service::Verb Service::verb_of(int body) {
  using Reply = proto::Reply;
  using S = Service;
  constexpr Lane kLight = Lane::kLight, kHeavy = Lane::kHeavy;
  constexpr Effect kNone = Effect::kNone, kLasting = Effect::kLasting;
  switch (static_cast<Request::BodyCase>(body)) {
    case Request::kGetServerInfo:
      return {
          kLight, kNone,
          &S::reply<&Request::get_server_info, &Reply::mutable_get_server_info, &S::server_info>};
    case Request::kOpenSession:
      return {kHeavy, kLasting,
              &S::reply<&Request::open_session, &Reply::mutable_open_session, &S::open>};
    case Request::kListSessions:
      return {kLight, kNone,
              &S::reply<&Request::list_sessions, &Reply::mutable_list_sessions, &S::list_sessions>};
    case Request::kGetSession:
      return {kHeavy, kNone,
              &S::reply<&Request::get_session, &Reply::mutable_get_session, &S::get_session>};
    case Request::kCloseSession:
      return {kHeavy, kLasting,
              &S::reply<&Request::close_session, &Reply::mutable_close_session, &S::close>};
    case Request::kEdit:
      return {kLight, kLasting, &S::reply<&Request::edit, &Reply::mutable_edit, &S::edit>};
    case Request::kWait:
      return {kLight, kNone, &S::reply_later<&Request::wait, &S::wait>};
    case Request::kGetMaterial:
      return {kHeavy, kNone,
              &S::reply<&Request::get_material, &Reply::mutable_get_material, &S::get_material>};
    case Request::kGetGeometry:
      return {kHeavy, kNone,
              &S::reply<&Request::get_geometry, &Reply::mutable_get_geometry, &S::get_geometry>};
    case Request::kGetFrames:
      return {kHeavy, kNone,
              &S::reply<&Request::get_frames, &Reply::mutable_get_frames, &S::get_frames>};
    case Request::kExport:
      return {kHeavy, kNone,
              &S::reply<&Request::export_, &Reply::mutable_export_, &S::export_part>};
    case Request::kCancel:
      return {kLight, kLasting, &S::reply<&Request::cancel, &Reply::mutable_cancel, &S::cancel>};
    case Request::kSolveCold:
      return {kLight, kLasting,
              &S::reply<&Request::solve_cold, &Reply::mutable_solve_cold, &S::solve_cold>};
    case Request::kValidateScene:
      return {
          kHeavy, kNone,
          &S::reply<&Request::validate_scene, &Reply::mutable_validate_scene, &S::validate_scene>};
    case Request::kGetSample:
      return {kHeavy, kNone,
              &S::reply<&Request::get_sample, &Reply::mutable_get_sample, &S::get_sample>};
    case Request::kTetrahedralize:
      return {
          kHeavy, kLasting,
          &S::reply<&Request::tetrahedralize, &Reply::mutable_tetrahedralize, &S::tetrahedralize>};
    case Request::kSimulate:
      return {kHeavy, kLasting,
              &S::reply<&Request::simulate, &Reply::mutable_simulate, &S::simulate>};
    case Request::kRecover:
      return {kHeavy, kLasting, &S::reply<&Request::recover, &Reply::mutable_recover, &S::recover>};
    case Request::kStartDesign:
      return {kHeavy, kLasting,
              &S::reply<&Request::start_design, &Reply::mutable_start_design, &S::start_design>};
    case Request::kChangeDesign:
      return {kHeavy, kLasting,
              &S::reply<&Request::change_design, &Reply::mutable_change_design, &S::change_design>};
    case Request::kPauseDesign:
      return {kLight, kLasting,
              &S::reply<&Request::pause_design, &Reply::mutable_pause_design, &S::pause_design>};
    case Request::kResumeDesign:
      return {kLight, kLasting,
              &S::reply<&Request::resume_design, &Reply::mutable_resume_design, &S::resume_design>};
    case Request::kStopDesign:
      return {kLight, kLasting,
              &S::reply<&Request::stop_design, &Reply::mutable_stop_design, &S::stop_design>};
    case Request::kTakeDesign:
      return {kLight, kLasting,
              &S::reply<&Request::take_design, &Reply::mutable_take_design, &S::take_design>};
    case Request::kGetDesign:
      return {kHeavy, kNone,
              &S::reply<&Request::get_design, &Reply::mutable_get_design, &S::get_design>};
    case Request::kMakeStartingGrid:
      return {kHeavy, kNone,
              &S::reply<&Request::make_starting_grid, &Reply::mutable_make_starting_grid,
                        &S::starting_grid>};
    case Request::kSolveBeams:
      return {kHeavy, kLasting,
              &S::reply<&Request::solve_beams, &Reply::mutable_solve_beams, &S::solve_beams>};
    case Request::kGetBeamSolution:
      return {kHeavy, kNone,
              &S::reply<&Request::get_beam_solution, &Reply::mutable_get_beam_solution,
                        &S::get_beam_solution>};
    case Request::kGetJob:
      return {kLight, kNone, &S::reply_later<&Request::get_job, &S::get_job>};
    case Request::kListJobs:
      return {kLight, kNone,
              &S::reply<&Request::list_jobs, &Reply::mutable_list_jobs, &S::list_jobs>};
    case Request::kShutdown:
      return {kLight, kLasting, &S::reply_later<&Request::shutdown, &S::shut_down>};
    case Request::BODY_NOT_SET:
      break;
  }
  return {kLight, kNone, &S::refuse_empty};
}

}  // namespace limber::server
