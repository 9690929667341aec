#include "server/kinds/bodies/kind.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "engine/base/checked_number.h"
#include "engine/scene/samples/samples.h"
#include "server/kinds/bodies/carried_surface.h"
#include "server/kinds/bodies/limits.h"
#include "server/kinds/bodies/memory_estimate.h"
#include "server/kinds/bodies/record.h"
#include "server/kinds/bodies/requests.h"
#include "server/kinds/bodies/scene_readers.h"
#include "server/kinds/bodies/scenes.h"
#include "server/wire/fields.h"
#include "server/wire/issues.h"

namespace limber::server {
namespace {

BodyRecord::Opened describe_body(const proto::Scene& message, const scene::Scene& scene,
                                 const PathResolver& resolve) {
  BodyRecord::Opened opened;
  opened.name = scene.name;
  if (message.mesh().has_path() || message.mesh().has_sample()) opened.mesh_source = message.mesh();
  opened.nodes = scene.mesh.node_count();
  opened.tets = scene.mesh.tet_count();
  opened.frames = scene.frame_count;
  opened.length_unit = scene.length_unit_in_metres;
  opened.lanes = scene.model.mode_count;
  opened.keyframe_rows = keyframe_rows(scene);
  const std::size_t constraints = constraints_of(scene), keyframes = scene.keyframes.size();
  opened.bytes =
      estimate_session_bytes(scene) - estimate_constraint_bytes(constraints, opened.lanes) -
      estimate_keyframe_bytes(keyframes, opened.keyframe_rows, constraints, opened.lanes) -
      estimate_pose_bytes(keyframes, opened.nodes, opened.tets);
  opened.resolve = resolve;
  opened.surface = carry_surface(scene);
  return opened;
}

/// Modes may grow as far as the session's memory goes.
session::ModeChoiceOptions mode_choice_within(const scene::Scene& scene, std::uint64_t bytes) {
  session::ModeChoiceOptions options;
  if (scene.model.names_modes()) return options;
  scene::ModelRequest larger = scene.model;
  while (options.most > options.least) {
    larger.mode_count = options.most;
    if (estimate_session_bytes(scene, larger) <= bytes) break;
    options.most = std::max(options.least, options.most * 3 / 4);
  }
  return options;
}

class BodyOpening final : public Opening {
 public:
  BodyOpening(const proto::Scene& message, const SceneContext& context,
              std::shared_ptr<session::ModelCache> cache)
      : cache_(std::move(cache)), decoded_(decode_body(message, "scene.", context)) {
    remarks_ = server::remarks(message, decoded_, "scene.");
    demand_memory(decoded_.scene, scene_limits(context.limits));
    most_constraints_ = to_whole<int>(std::uint32_t{context.limits.constraints})
                            .value_or(std::numeric_limits<int>::max());
    memory_ = {estimate_session_bytes(decoded_.scene), estimate_kept_bytes(decoded_.scene)};
    opened_ = describe_body(message, decoded_.scene, context.resolve);
    if (opened_.surface) add_remarks(*opened_.surface);
  }

  [[nodiscard]] std::string size() const override {
    return fmt::format("{} nodes, {} tets, {} frames", opened_.nodes, opened_.tets, opened_.frames);
  }
  [[nodiscard]] SessionMemory memory() const override { return memory_; }
  [[nodiscard]] std::vector<proto::Issue> remarks() const override { return remarks_; }
  [[nodiscard]] std::shared_ptr<Record> make_record(Hub& hub, const SessionKey& key,
                                                    JobId open_job) override {
    opened_.id = key.name;
    return record_ = std::make_shared<BodyRecord>(hub, key, opened_, open_job);
  }
  void start(Hub& hub, session::Executor executor) override {
    session::SessionOptions options;
    options.max_constraints = most_constraints_;
    options.start_search.emplace();
    options.mode_choice = mode_choice_within(decoded_.scene, hub.options.limits.session_bytes);
    record_->constraints_changed(decoded_.scene.constraints.size());
    const auto in_scene = [](const std::string& field) {
      return field.empty() ? field : "scene." + field;
    };
    record_->attach(with_fields(in_scene, [&] {
      return std::make_shared<session::BodySession>(opened_.id, std::move(decoded_.scene), options,
                                                    cache_, std::move(executor), record_);
    }));
  }

 private:
  void add_remarks(const CarriedSurface& surface) {
    for (const auto& text : remarks_on(surface))
      remarks_.push_back(encode_warning("scene.surface", text));
  }

  std::shared_ptr<session::ModelCache> cache_;
  DecodedScene decoded_;
  int most_constraints_ = 0;
  SessionMemory memory_;
  std::vector<proto::Issue> remarks_;
  BodyRecord::Opened opened_;
  std::shared_ptr<BodyRecord> record_;
};

class BodyKind final : public Kind {
 public:
  explicit BodyKind(const ServerOptions& options)
      : cache_(std::make_shared<session::ModelCache>(options.cache_folder)) {}

  [[nodiscard]] const char* name() const override { return "bodies"; }
  [[nodiscard]] bool accepts(const proto::Scene& scene) const override { return is_body(scene); }
  [[nodiscard]] std::unique_ptr<Opening> read(const proto::Scene& scene,
                                              const SceneContext& context) const override {
    return std::make_unique<BodyOpening>(scene, context, cache_);
  }
  [[nodiscard]] std::vector<proto::Issue> validate(const proto::Scene& scene,
                                                   const std::string& prefix,
                                                   const SceneContext& context) const override {
    return scene_issues(scene, prefix, scene_limits(context.limits),
                        scene_readers(context.resolve, mesh_read_limits(context.limits)));
  }
  [[nodiscard]] proto::Scene defaults_of(const proto::Scene& scene) const override {
    proto::Scene defaults;
    *defaults.mutable_dynamics() = encode_dynamics(
        decode_dynamics(scene.dynamics()).resolved(scene::Discretisation::kSampled));
    return defaults;
  }
  void add_older_defaults(proto::Scene& scene) const override {
    if (scene.dynamics().discretisation() == proto::TIME_DISCRETISATION_UNSPECIFIED)
      scene.mutable_dynamics()->set_discretisation(proto::TIME_DISCRETISATION_DIFFERENCES);
  }
  void begin_in(proto::Scene& scene, const proto::Scene& start) const override {
    *scene.mutable_start() = start.start();
  }
  [[nodiscard]] std::vector<std::string> sample_names() const override {
    return scene::sample_names();
  }
  [[nodiscard]] proto::Scene sample(const std::string& name) const override {
    return sample_scene(name);
  }
  [[nodiscard]] bool is_heavy(const proto::Edit& edit) const override {
    const auto& keyframe = edit.add_keyframe().keyframe();
    return keyframe.has_file() || keyframe.has_path();
  }
  [[nodiscard]] bool may_be_large(const proto::Edit& edit) const override {
    return edit.has_add_keyframe() || edit.has_set_pins();
  }
  [[nodiscard]] bool answer(const proto::Request& request, proto::Reply& reply, Hub& hub,
                            const SceneContext& context) const override {
    return answer_body_request(request, reply, hub, context);
  }

 private:
  std::shared_ptr<session::ModelCache> cache_;
};

}  // namespace

std::unique_ptr<const Kind> make_body_kind(const ServerOptions& options) {
  return std::make_unique<BodyKind>(options);
}

}  // namespace limber::server
