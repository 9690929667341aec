#pragma once

#include "limber/v1/service.pb.h"

namespace limber::client {

/// Which member of Request's and Reply's body a request type is, at compile time. `kRepeatable`:
/// sending it twice does no harm, so that it may be sent again if no answer comes.
template <class RequestBody>
struct Rpc;

#define LIMBER_RPC(Type, member, repeatable)                                        \
  template <>                                                                       \
  struct Rpc<v1::Type##Request> {                                                   \
    using Response = v1::Type##Response;                                            \
    static constexpr bool kRepeatable = repeatable;                                 \
    static constexpr const char* kName = #member;                                   \
    static void put(v1::Request& r, const v1::Type##Request& body) {                \
      *r.mutable_##member() = body;                                                 \
    }                                                                               \
    static bool is(const v1::Reply& r) { return r.has_##member(); }                 \
    static Response take(v1::Reply& r) { return std::move(*r.mutable_##member()); } \
  };

LIMBER_RPC(GetServerInfo, get_server_info, true)
LIMBER_RPC(OpenSession, open_session, false)
LIMBER_RPC(ListSessions, list_sessions, true)
LIMBER_RPC(GetSession, get_session, true)
LIMBER_RPC(CloseSession, close_session, false)
LIMBER_RPC(Edit, edit, false)
LIMBER_RPC(Wait, wait, true)
LIMBER_RPC(GetMaterial, get_material, true)
LIMBER_RPC(GetGeometry, get_geometry, true)
LIMBER_RPC(GetFrames, get_frames, true)
LIMBER_RPC(Export, export_, true)
LIMBER_RPC(Cancel, cancel, true)
LIMBER_RPC(SolveCold, solve_cold, false)
LIMBER_RPC(ValidateScene, validate_scene, true)
LIMBER_RPC(GetSample, get_sample, true)
LIMBER_RPC(Tetrahedralize, tetrahedralize, false)
LIMBER_RPC(Simulate, simulate, false)
LIMBER_RPC(GetJob, get_job, true)
LIMBER_RPC(ListJobs, list_jobs, true)
LIMBER_RPC(StartDesign, start_design, false)
LIMBER_RPC(ChangeDesign, change_design, true)
LIMBER_RPC(PauseDesign, pause_design, false)
LIMBER_RPC(ResumeDesign, resume_design, false)
LIMBER_RPC(StopDesign, stop_design, false)
LIMBER_RPC(TakeDesign, take_design, false)
LIMBER_RPC(GetDesign, get_design, true)
LIMBER_RPC(MakeStartingGrid, make_starting_grid, true)
LIMBER_RPC(SolveBeams, solve_beams, false)
LIMBER_RPC(GetBeamSolution, get_beam_solution, true)
LIMBER_RPC(Shutdown, shutdown, false)
#undef LIMBER_RPC

}  // namespace limber::client
