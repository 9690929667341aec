#include "server/kinds/linkages/kind.h"

#include <fmt/format.h>

#include <limits>
#include <utility>

#include "engine/base/checked_number.h"
#include "engine/scene/samples/linkage_samples.h"
#include "engine/session/linkages/remarks.h"
#include "server/kinds/linkages/design_requests.h"
#include "server/kinds/linkages/record.h"
#include "server/kinds/linkages/result.h"
#include "server/kinds/linkages/scenes.h"
#include "server/wire/fields.h"
#include "server/wire/issues.h"

namespace limber::server {
namespace {

/// Fields of the linkage in errors of `call` become those of the request.
template <class Call>
auto with_linkage_fields(const proto::Scene& message, const Call& call) {
  const auto rename = [&](const std::string& field) {
    return field.empty() ? field : "scene." + linkage_field_in(message, field);
  };
  return with_fields(rename, call);
}

class LinkageOpening final : public Opening {
 public:
  LinkageOpening(const proto::Scene& message, const SceneContext& context)
      : message_(message),
        linkage_(decode_linkage(message, "scene.", line_loader(context.resolve))) {
    const session::LinkageCheck sizes = check_linkage(linkage_, context.limits.session_bytes);
    with_linkage_fields(message, [&] { session::demand_sound(sizes); });
    memory_ = estimate_linkage_memory(linkage_);
    for (scene::Issue issue : session::linkage_remarks(linkage_)) {
      issue.field = linkage_field_in(message, issue.field);
      remarks_.push_back(encode_issue(issue, "scene."));
    }
    const auto& lines = message.linkage().lines();
    opened_.name = linkage_.name;
    if (lines.has_path() || lines.has_sample()) opened_.lines = lines;
    opened_.joints = sizes.joints;
    opened_.segments = sizes.segments;
    opened_.length_unit = linkage_.length_unit_in_metres;
    opened_.resolve = context.resolve;
    most_targets_ = to_whole<int>(std::uint32_t{context.limits.constraints})
                        .value_or(std::numeric_limits<int>::max());
    most_chosen_edges_ = most_chosen_edges(linkage_, context.limits.session_bytes);
  }

  [[nodiscard]] std::string size() const override {
    return fmt::format("{} segments, {} joints", opened_.segments, opened_.joints);
  }
  [[nodiscard]] SessionMemory memory() const override { return memory_; }
  [[nodiscard]] std::vector<proto::Issue> remarks() const override { return remarks_; }
  [[nodiscard]] std::shared_ptr<Record> make_record(Hub& hub, const SessionKey& key,
                                                    JobId open_job) override {
    opened_.id = key.name;
    return record_ = std::make_shared<LinkageRecord>(hub, key, opened_, open_job);
  }
  void start(Hub&, session::Executor executor) override {
    session::LinkageLimits limits;
    limits.max_targets = most_targets_;
    limits.most_chosen_edges = most_chosen_edges_;
    record_->attach(with_linkage_fields(message_, [&] {
      return std::make_shared<session::LinkageSession>(
          opened_.id, std::move(linkage_), limits, std::move(executor), record_,
          decode_linkage_answer(record_->expected_answer()));
    }));
  }

 private:
  const proto::Scene& message_;  // of the request, which outlives this
  scene::Linkage linkage_;
  SessionMemory memory_;
  int most_targets_ = 0;
  int most_chosen_edges_ = 0;
  std::vector<proto::Issue> remarks_;
  LinkageRecord::Opened opened_;
  std::shared_ptr<LinkageRecord> record_;
};

class LinkageKind final : public Kind {
 public:
  [[nodiscard]] const char* name() const override { return "linkages"; }
  [[nodiscard]] bool accepts(const proto::Scene& scene) const override {
    return scene.has_linkage();
  }
  [[nodiscard]] std::unique_ptr<Opening> read(const proto::Scene& scene,
                                              const SceneContext& context) const override {
    return std::make_unique<LinkageOpening>(scene, context);
  }
  [[nodiscard]] std::vector<proto::Issue> validate(const proto::Scene& scene,
                                                   const std::string& prefix,
                                                   const SceneContext& context) const override {
    return linkage_issues(scene, prefix, line_loader(context.resolve),
                          context.limits.session_bytes);
  }
  void begin_in(proto::Scene& scene, const proto::Scene& start) const override {
    proto::RodLinkage& linkage = *scene.mutable_linkage();
    *linkage.mutable_shape() = start.linkage().shape();
    linkage.set_edges_per_segment(start.linkage().edges_per_segment());
  }
  [[nodiscard]] std::vector<std::string> sample_names() const override {
    return scene::linkage_sample_names();
  }
  [[nodiscard]] proto::Scene sample(const std::string& name) const override {
    return linkage_sample_scene(name);
  }
  [[nodiscard]] bool answer(const proto::Request& request, proto::Reply& reply, Hub&,
                            const SceneContext& context) const override {
    if (!request.has_make_starting_grid()) return false;
    *reply.mutable_make_starting_grid() =
        make_starting_grid(request.make_starting_grid(), surface_loader(context.resolve));
    return true;
  }
};

}  // namespace

std::unique_ptr<const Kind> make_linkage_kind() { return std::make_unique<LinkageKind>(); }

}  // namespace limber::server
