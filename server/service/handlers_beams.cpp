// Structures of beams, solved as jobs.
#include "server/codec/beams.h"
#include "server/service/memory_estimate.h"
#include "server/service/service.h"

namespace limber::server {

proto::SolveBeamsResponse Service::solve_beams(const proto::SolveBeamsRequest& request) {
  BeamRequest decoded = decode_beams(request);
  const std::uint64_t bytes = estimate_beam_bytes(decoded.model, decoded.shapes);
  const std::uint64_t limit = hub_.options.limits.session_bytes;
  if (limit > 0 && bytes > limit)
    throw limit_exceeded(request.has_job() ? "job" : "structure", "estimated bytes of the solution",
                         limit, bytes);
  proto::SolveBeamsResponse response;
  response.set_job(
      start_job("beams", "", [decoded = std::move(decoded)](const JobContext& context) {
        const session::BeamAnalysis analysis =
            session::analyse(decoded.model, decoded.options, decoded.shapes, context);
        JobProduct product;
        product.beams = encode_beams(analysis);
        product.files = beam_files(analysis, decoded);
        return product;
      }));
  return response;
}

}  // namespace limber::server
