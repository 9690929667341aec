#pragma once

#include "limber/v1/service.pb.h"

namespace limber::client {

/// Which member of Request's and Reply's body a request type is, at compile time.
template <class RequestBody>
struct Rpc;

#define LIMBER_RPC(Type, member)                                                    \
  template <>                                                                       \
  struct Rpc<v1::Type##Request> {                                                   \
    using Response = v1::Type##Response;                                            \
    static constexpr const char* kName = #member;                                   \
    static void put(v1::Request& r, const v1::Type##Request& body) {                \
      *r.mutable_##member() = body;                                                 \
    }                                                                               \
    static bool is(const v1::Reply& r) { return r.has_##member(); }                 \
    static Response take(v1::Reply& r) { return std::move(*r.mutable_##member()); } \
  };

LIMBER_RPC(GetServerInfo, get_server_info)
LIMBER_RPC(OpenSession, open_session)
LIMBER_RPC(ListSessions, list_sessions)
LIMBER_RPC(GetSession, get_session)
LIMBER_RPC(CloseSession, close_session)
LIMBER_RPC(Edit, edit)
LIMBER_RPC(Wait, wait)
LIMBER_RPC(GetMaterial, get_material)
LIMBER_RPC(GetGeometry, get_geometry)
LIMBER_RPC(GetFrames, get_frames)
LIMBER_RPC(Export, export_)
LIMBER_RPC(Cancel, cancel)
LIMBER_RPC(SolveCold, solve_cold)
LIMBER_RPC(ValidateScene, validate_scene)
LIMBER_RPC(GetSample, get_sample)
LIMBER_RPC(Tetrahedralize, tetrahedralize)
LIMBER_RPC(Simulate, simulate)
LIMBER_RPC(GetJob, get_job)
LIMBER_RPC(ListJobs, list_jobs)
LIMBER_RPC(StartDesign, start_design)
LIMBER_RPC(ChangeDesign, change_design)
LIMBER_RPC(PauseDesign, pause_design)
LIMBER_RPC(ResumeDesign, resume_design)
LIMBER_RPC(StopDesign, stop_design)
LIMBER_RPC(TakeDesign, take_design)
LIMBER_RPC(GetDesign, get_design)
LIMBER_RPC(MakeStartingGrid, make_starting_grid)
LIMBER_RPC(SolveBeams, solve_beams)
LIMBER_RPC(GetBeamSolution, get_beam_solution)
LIMBER_RPC(Explain, explain)
LIMBER_RPC(LookAt, look_at)
LIMBER_RPC(SaveSession, save_session)
LIMBER_RPC(RestoreSession, restore_session)
LIMBER_RPC(JoinSession, join_session)
LIMBER_RPC(LeaveSession, leave_session)
LIMBER_RPC(Allow, allow)
LIMBER_RPC(Revoke, revoke)
LIMBER_RPC(ListAllowed, list_allowed)
LIMBER_RPC(Shutdown, shutdown)
#undef LIMBER_RPC

}  // namespace limber::client
