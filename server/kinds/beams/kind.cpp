#include "server/kinds/beams/kind.h"

#include <fmt/format.h>

#include <utility>

#include "engine/base/clauses.h"
#include "engine/session/beams/remarks.h"
#include "engine/session/beams/samples.h"
#include "server/kinds/beams/memory_estimate.h"
#include "server/kinds/beams/record.h"
#include "server/kinds/beams/result.h"
#include "server/kinds/beams/scenes.h"
#include "server/kinds/beams/solution.h"
#include "server/runtime/pooled_job.h"
#include "server/wire/issues.h"

namespace limber::server {
namespace {

class BeamOpening final : public Opening {
 public:
  BeamOpening(const proto::Scene& message, const SceneContext& context)
      : structure_(decode_beam_scene(message, "scene.", edge_loader(context.resolve))),
        discretisation_(demand_beam_memory(structure_, context.limits.session_bytes)) {}

  [[nodiscard]] std::string size() const override {
    return fmt::format("{} nodes, {} elements of beams", structure_.model.nodes.size(),
                       structure_.model.elements.size());
  }
  [[nodiscard]] SessionMemory memory() const override {
    return estimate_beam_memory(structure_.model);
  }
  [[nodiscard]] std::vector<proto::Issue> remarks() const override {
    std::vector<proto::Issue> remarks;
    for (const auto& issue : session::beam_remarks(structure_.model))
      remarks.push_back(encode_issue(issue, "scene.beams.structure."));
    return remarks;
  }
  [[nodiscard]] std::shared_ptr<Record> make_record(Hub& hub, const SessionKey& key,
                                                    JobId open_job) override {
    return record_ = std::make_shared<BeamRecord>(hub, key, structure_, open_job);
  }
  void start(Hub&, session::Executor executor) override {
    record_->attach(std::make_shared<session::BeamSession>(
        record_->id(), structure_.model, session::BeamLimits{}, std::move(executor), record_,
        structure_.shape, discretisation_));
  }

 private:
  const DecodedBeams structure_;
  const beams::BeamDiscretisation discretisation_;
  std::shared_ptr<BeamRecord> record_;
};

proto::SolveBeamsResponse solve_beams(const proto::SolveBeamsRequest& request, Hub& hub) {
  BeamRequest decoded = decode_beams(request);
  const std::uint64_t bytes = estimate_beam_bytes(decoded.model, decoded.shapes, decoded.stations);
  const std::uint64_t limit = hub.options.limits.session_bytes;
  if (limit > 0 && bytes > limit)
    throw limit_exceeded(request.has_job() ? "job" : "structure", "estimated bytes of the solution",
                         limit, bytes);
  proto::SolveBeamsResponse response;
  response.set_job(
      start_pooled_job(hub, "beams", "", [decoded = std::move(decoded)](const JobContext& job) {
        const session::BeamAnalysis analysis =
            session::analyse(decoded.model, decoded.options, decoded.shapes,
                             decoded.is_estimated ? job.part(0, 0.3) : job);
        JobProduct product;
        product.beams = encode_beams(analysis, decoded.stations);
        if (decoded.is_estimated && analysis.solution.report.converged()) {
          const auto check = session::check_discretisation(analysis, job.part(0.3, 1));
          product.discretisation_error = encode_discretisation(check);
          add_sentence(*product.beams->mutable_message(), describe_discretisation(check));
        }
        product.files = beam_files(analysis, decoded);
        for (const auto& issue : session::beam_remarks(decoded.model)) {
          product.issues.push_back(encode_issue(issue, "structure."));
          *product.beams->add_issues() = product.issues.back();
        }
        return product;
      }));
  return response;
}

class BeamKind final : public Kind {
 public:
  [[nodiscard]] const char* name() const override { return "beams"; }
  [[nodiscard]] bool accepts(const proto::Scene& scene) const override { return scene.has_beams(); }
  [[nodiscard]] std::unique_ptr<Opening> read(const proto::Scene& scene,
                                              const SceneContext& context) const override {
    return std::make_unique<BeamOpening>(scene, context);
  }
  [[nodiscard]] std::vector<proto::Issue> validate(const proto::Scene& scene,
                                                   const std::string& prefix,
                                                   const SceneContext& context) const override {
    return beam_issues(scene, prefix, edge_loader(context.resolve), context.limits.session_bytes);
  }
  void begin_in(proto::Scene& scene, const proto::Scene& start) const override {
    *scene.mutable_beams()->mutable_shape() = start.beams().shape();
  }
  [[nodiscard]] std::vector<std::string> sample_names() const override {
    return session::beam_sample_names();
  }
  [[nodiscard]] proto::Scene sample(const std::string& name) const override {
    return beam_sample_scene(name);
  }
  [[nodiscard]] bool answer(const proto::Request& request, proto::Reply& reply, Hub& hub,
                            const SceneContext&) const override {
    if (!request.has_solve_beams()) return false;
    *reply.mutable_solve_beams() = solve_beams(request.solve_beams(), hub);
    return true;
  }
};

}  // namespace

std::unique_ptr<const Kind> make_beam_kind() { return std::make_unique<BeamKind>(); }

}  // namespace limber::server
