#include "server/service/roles.h"

#include <fmt/format.h>

#include "limber/v1/service.pb.h"

namespace limber::server {

std::optional<Role> least_role(int body) {
  using Request = proto::Request;
  switch (static_cast<Request::BodyCase>(body)) {
    // Queries, and waits for results. Looking at a parked session brings it back.
    case Request::kGetServerInfo:
    case Request::kListSessions:
    case Request::kGetSession:
    case Request::kWait:
    case Request::kGetMaterial:
    case Request::kGetGeometry:
    case Request::kGetFrames:
    case Request::kExport:
    case Request::kSaveSession:
    case Request::kGetSample:
    case Request::kGetDesign:
    case Request::kGetBeamSolution:
    case Request::kExplain:
    case Request::kLookAt:
    case Request::kJoinSession:
    case Request::kLeaveSession:
    case Request::kFollow:
    case Request::kGetReplyPart:
    case Request::kGetJob:
    case Request::kListJobs:
      return Role::kView;
    // Requests that change something, or compute for the client.
    case Request::kOpenSession:
    case Request::kRestoreSession:
    case Request::kCloseSession:  // of a parked one more: Service::close()
    case Request::kEdit:
    case Request::kCancel:
    case Request::kSolveCold:
    case Request::kValidateScene:
    case Request::kTetrahedralize:
    case Request::kSimulate:
    case Request::kRecover:
    case Request::kStartDesign:
    case Request::kChangeDesign:
    case Request::kPauseDesign:
    case Request::kResumeDesign:
    case Request::kStopDesign:
    case Request::kTakeDesign:
    case Request::kMakeStartingGrid:
    case Request::kSolveBeams:
      return Role::kEdit;
    case Request::kShutdown:
    case Request::kAllow:
    case Request::kRevoke:
    case Request::kListAllowed:
      return Role::kAdminister;
    case Request::BODY_NOT_SET:
      break;
  }
  return std::nullopt;
}

void demand_role(Role has, Role needed, const std::string& field, const std::string& what) {
  if (has >= needed) return;
  throw Refusal(proto::ERROR_CODE_PERMISSION_DENIED, field,
                fmt::format("{} needs the role {}; this client has the role {}", what,
                            name_of(needed), name_of(has)),
                {{"needs", name_of(needed)}, {"has", name_of(has)}});
}

void demand_role(Role has, int body) {
  const auto needed = least_role(body);
  if (!needed || has >= *needed) return;
  const std::string& name = proto::Request::descriptor()->FindFieldByNumber(body)->name();
  demand_role(has, *needed, name, fmt::format("the request {}", name));
}

proto::Role to_proto(Role role) {
  switch (role) {
    case Role::kView:
      return proto::ROLE_VIEW;
    case Role::kEdit:
      return proto::ROLE_EDIT;
    case Role::kAdminister:
      return proto::ROLE_ADMINISTER;
  }
  return proto::ROLE_UNSPECIFIED;
}

std::optional<Role> from_proto(proto::Role role) {
  for (const Role own : {Role::kView, Role::kEdit, Role::kAdminister}) {
    if (to_proto(own) == role) return own;
  }
  return std::nullopt;
}

}  // namespace limber::server
