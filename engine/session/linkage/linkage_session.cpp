#include "engine/session/linkage/linkage_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <mutex>
#include <utility>

#include "engine/session/linkage/live_linkage.h"
#include "engine/session/linkage/pin_reach.h"
#include "engine/session/serial_task.h"

namespace limber::session {

/// Two halves, as Session::Impl has them: what any thread may touch, under mutex_; and live_, which
/// only the task touches, of which there is at most one at a time.
class LinkageSession::Impl : public std::enable_shared_from_this<LinkageSession::Impl> {
 public:
  using Clock = std::chrono::steady_clock;

  Impl(std::string id, scene::Linkage linkage, LinkageLimits limits, Executor executor,
       std::shared_ptr<LinkageListener> listener)
      : id_(std::move(id)),
        linkage_(std::move(linkage)),
        listener_(std::move(listener)),
        document_(opened(linkage_, limits)),
        task_(mutex_, std::move(executor), [this] { say_closed(); }),
        edited_at_(Clock::now()) {}

  struct Round {
    Revision revision = 0;
    std::shared_ptr<const scene::LinkageConditions> conditions;
    Clock::time_point edited_at;
    Cancellation cancellation;
    [[nodiscard]] double since_edit_ms() const {
      return std::chrono::duration<double, std::milli>(Clock::now() - edited_at).count();
    }
  };

  void post(std::unique_lock<std::mutex> lock) {
    task_.post(
        std::move(lock), [self = shared_from_this()] { self->run(); }, message_);
  }

  void open() {
    std::unique_lock lock(mutex_);
    work_ = true;
    post(std::move(lock));
    lock = std::unique_lock(mutex_);
    if (state_ == State::kBuilding && !task_.is_pending() && !message_.empty())
      throw Error(ErrorCode::kInternal, "", message_);
  }

  EditReceipt edit(const std::vector<LinkageEdit>& edits, std::optional<Revision> expected) {
    std::unique_lock lock(mutex_);
    if (task_.is_closed()) throw Error(ErrorCode::kFailedPrecondition, "", "the session is closed");
    if (state_ == State::kFailed) {
      throw Error(ErrorCode::kFailedPrecondition, "",
                  fmt::format("the session has no model: {}", message_));
    }
    const Revision before = document_.revision();
    const auto conditions = document_.conditions();
    EditReceipt receipt = document_.apply(edits, expected);
    if (holds_where_it_is(edits)) finish_first(before, conditions);
    edited_at_ = Clock::now();
    work_ = true;
    cancelled_ = false;
    if (!must_finish_) round_.request();
    post(std::move(lock));
    return receipt;
  }

  void cancel() {
    const std::lock_guard lock(mutex_);
    if (!task_.is_pending()) return;
    if (state_ == State::kBuilding) building_.request();
    cancelled_ = true;
    first_.clear();
    round_.request();
  }

  void shut(SerialTask::Farewell farewell) {
    std::unique_lock lock(mutex_);
    state_ = State::kClosed;
    building_.request();
    round_.request();
    task_.close(std::move(lock), farewell);
  }

  template <class Read>
  [[nodiscard]] auto read(const Read& get) const {
    const std::lock_guard lock(mutex_);
    return get(*this);
  }

 private:
  friend class LinkageSession;
  static constexpr std::chrono::milliseconds kPublishInterval{8};

  /// Joints and segments must be known before the model is built.
  static LinkageDocument opened(const scene::Linkage& linkage, LinkageLimits limits) {
    const LinkageCheck check = check_linkage(linkage);
    demand_sound(check);
    try {
      const auto reach = std::make_shared<PinReach>(rods::build_linkage_graph(linkage.lines));
      return {
          linkage.conditions, check.joints, check.segments, limits,
          [reach](const scene::LinkageConditions& conditions) { return reach->check(conditions); }};
    } catch (const Error& error) {
      throw Error(error.code(), "conditions." + error.field(), error.what());
    }
  }

  /// A pin without a position holds the joint where the edits before have it, not where an iterate
  /// on the way there happens to be.
  static bool holds_where_it_is(const std::vector<LinkageEdit>& edits) {
    return std::any_of(edits.begin(), edits.end(), [](const LinkageEdit& edit) {
      const auto* const pin = std::get_if<PinJoint>(&edit);
      return pin != nullptr && pin->held && *pin->held != scene::Held::kAngle && !pin->position;
    });
  }

  /// What there was before an edit is solved to its end before the edit is looked at. Called with
  /// the lock.
  void finish_first(Revision revision, std::shared_ptr<const scene::LinkageConditions> conditions) {
    const Revision taken = first_.empty() ? taken_ : first_.back().revision;
    if (task_.is_running() && taken == revision && !work_) {
      must_finish_ = true;  // it is just being solved
    } else if (taken != revision || work_) {
      first_.push_back({revision, std::move(conditions), edited_at_, {}});
    }
  }

  void say_closed() {
    tell(listener_.get(), [](LinkageListener& listener) { listener.on_state(State::kClosed, ""); });
  }

  void run() {
    if (!task_.begin()) return;
    try {
      if (live_ || build()) {
        while (const std::optional<Round> round = next_round()) solve(*round);
        return;
      }
      task_.finish(std::unique_lock(mutex_));
    } catch (...) {  // out of memory between rounds: what was accepted waits for the next call
      std::unique_lock lock(mutex_);
      work_ = true;
      task_.finish(std::move(lock));
    }
  }

  bool build() {
    std::string message;
    try {
      const auto tell_progress = [this](const std::string& stage, double fraction) {
        tell(listener_.get(), [&](LinkageListener& listener) {
          listener.on_progress({stage, fraction});
        });
      };
      tell_progress("linkage", 0);
      live_ = std::make_unique<LiveLinkage>(linkage_, JobContext{building_, tell_progress});
      auto geometry = std::make_shared<const LinkageGeometry>(describe());
      bool open = false;
      {
        const std::lock_guard lock(mutex_);
        geometry_ = std::move(geometry);
        shape_ = std::make_shared<const LinkageShape>(live_->shape());
        statics_ = std::make_shared<const LinkageStatics>(live_->statics());
        open = !task_.is_closed();
        if (open) state_ = State::kReady;
      }
      if (open)
        tell(listener_.get(),
             [](LinkageListener& listener) { listener.on_state(State::kReady, ""); });
      return true;
    } catch (const Error& error) {
      message =
          error.field().empty() ? error.what() : fmt::format("{}: {}", error.field(), error.what());
    } catch (const std::exception& error) {
      message = error.what();
    } catch (...) {
      message = "unknown exception";
    }
    live_.reset();
    bool open = false;
    {
      const std::lock_guard lock(mutex_);
      open = !task_.is_closed();
      if (open) {
        state_ = State::kFailed;
        message_ = message;
      }
    }
    if (open)
      tell(listener_.get(),
           [&](LinkageListener& listener) { listener.on_state(State::kFailed, message); });
    return false;
  }

  [[nodiscard]] LinkageGeometry describe() const {
    const rods::LinkageModel& model = live_->model();
    const LinkageShape& shape = live_->shape();
    LinkageGeometry geometry;
    geometry.coordinates = shape.size();
    geometry.outline = shape.outline();
    geometry.surface = shape.triangles();
    geometry.surface_nodes = shape.surface_nodes();
    const auto& segments = model.graph().segments;
    geometry.joints_of_segment.resize(2, static_cast<Eigen::Index>(segments.size()));
    for (std::size_t s = 0; s < segments.size(); ++s) {
      geometry.edges.push_back(model.variables().edges(static_cast<int>(s)));
      geometry.joints_of_segment.col(static_cast<Eigen::Index>(s)) << segments[s].joints[0],
          segments[s].joints[1];
    }
    for (const auto& joint : model.graph().joints) geometry.vertex_of_joint.push_back(joint.vertex);
    return geometry;
  }

  /// Nothing to do: the task ends, in the same breath.
  std::optional<Round> next_round() {
    std::unique_lock lock(mutex_);
    if (task_.is_closed() || !work_) {
      task_.finish(std::move(lock));
      return std::nullopt;
    }
    round_ = Cancellation();
    if (!first_.empty()) {
      Round round = std::move(first_.front());
      first_.pop_front();
      round.cancellation = round_;
      taken_ = round.revision;
      must_finish_ = true;
      return round;
    }
    work_ = must_finish_ = false;
    if (cancelled_) round_.request();
    taken_ = document_.revision();
    return Round{taken_, document_.conditions(), edited_at_, round_};
  }

  void solve(const Round& round) {
    published_at_ = Clock::now();
    LiveLinkage::Outcome outcome;
    try {
      outcome = live_->solve(round.conditions, JobContext{round.cancellation, {}},
                             [&] { publish_iterate(round); });
    } catch (const std::exception& error) {
      live_->restore();
      outcome.report.status = rods::EquilibriumStatus::kStalled;
      outcome.report.message = error.what();
    }
    const bool interrupted = read([](const Impl& impl) {
      return impl.task_.is_closed() || (impl.work_ && !impl.must_finish_);
    });
    const bool cancelled = outcome.report.status == rods::EquilibriumStatus::kCancelled;
    if (cancelled && interrupted) {  // a newer revision goes on from this iterate
      live_->stay_near();
      return;
    }
    if (cancelled) live_->restore();
    auto result = std::make_shared<LinkageResult>();
    result->converged = true;
    result->solve_failed = !outcome.reached && !cancelled;
    result->report = outcome.reached ? outcome.report : live_->report_of_shape(outcome.report);
    const bool moved = !cancelled && !outcome.path.empty();
    if (moved) result->path = std::move(outcome.path);
    result->frames = moved ? columns(outcome.frames) : columns({shape_now()});
    result->strains =
        moved ? columns(outcome.strains) : columns({live_->statics().strains(live_->state())});
    hand_out(std::move(result), round);
  }

  void publish_iterate(const Round& round) {
    const auto now = Clock::now();
    if (now - published_at_ < kPublishInterval) return;
    published_at_ = now;
    auto result = std::make_shared<LinkageResult>();
    result->frames = columns({shape_now()});
    hand_out(std::move(result), round);
  }

  [[nodiscard]] Eigen::VectorXf shape_now() const {
    return live_->shape().coordinates(live_->model(), live_->state());
  }

  static std::shared_ptr<const Eigen::MatrixXf> columns(const std::vector<Eigen::VectorXf>& path) {
    auto frames = std::make_shared<Eigen::MatrixXf>(path.empty() ? 0 : path[0].size(),
                                                    static_cast<Eigen::Index>(path.size()));
    for (std::size_t i = 0; i < path.size(); ++i)
      frames->col(static_cast<Eigen::Index>(i)) = path[i];
    return frames;
  }

  void hand_out(std::shared_ptr<LinkageResult> result, const Round& round) {
    result->revision = round.revision;
    result->mean_angle = live_->state().mean_opening_angle();
    result->since_edit_ms = round.since_edit_ms();
    std::shared_ptr<const LinkageResult> older, older_final;  // freed without the lock
    {
      const std::lock_guard lock(mutex_);
      if (task_.is_closed()) return;
      result->sequence = ++sequence_;
      older = std::exchange(newest_, result);
      if (result->converged) older_final = std::exchange(final_, result);
    }
    tell(listener_.get(), [&](LinkageListener& listener) { listener.on_result(result); });
  }

  const std::string id_;
  const scene::Linkage linkage_;
  const std::shared_ptr<LinkageListener> listener_;

  mutable std::mutex mutex_;
  LinkageDocument document_;
  SerialTask task_;
  Clock::time_point edited_at_;
  bool work_ = false, cancelled_ = false;
  std::deque<Round> first_;   // to be solved before what the document says, whatever comes
  Revision taken_ = 0;        // of the round under way, or the last
  bool must_finish_ = false;  // edits do not interrupt it
  State state_ = State::kBuilding;
  std::string message_;
  const Cancellation building_;
  Cancellation round_;  // of the solve under way
  std::uint64_t sequence_ = 0;
  std::shared_ptr<const LinkageResult> newest_, final_;
  std::shared_ptr<const LinkageGeometry> geometry_;
  std::shared_ptr<const LinkageShape> shape_;
  std::shared_ptr<const LinkageStatics> statics_;

  std::unique_ptr<LiveLinkage> live_;  // the task's
  Clock::time_point published_at_;     // the task's
};

LinkageSession::LinkageSession(std::string id, scene::Linkage linkage, LinkageLimits limits,
                               Executor executor, std::shared_ptr<LinkageListener> listener)
    : impl_(std::make_shared<Impl>(std::move(id), std::move(linkage), limits, std::move(executor),
                                   std::move(listener))) {
  impl_->open();
}
LinkageSession::~LinkageSession() { impl_->shut(SerialTask::Farewell::kSilent); }

const std::string& LinkageSession::id() const { return impl_->id_; }
State LinkageSession::state() const {
  return impl_->read([](const Impl& impl) { return impl.state_; });
}
std::string LinkageSession::state_message() const {
  return impl_->read([](const Impl& impl) { return impl.message_; });
}
Revision LinkageSession::revision() const {
  return impl_->read([](const Impl& impl) { return impl.document_.revision(); });
}
scene::Linkage LinkageSession::linkage() const {
  scene::Linkage linkage = impl_->linkage_;
  linkage.conditions = *conditions();
  return linkage;
}
std::shared_ptr<const scene::LinkageConditions> LinkageSession::conditions() const {
  return impl_->read([](const Impl& impl) { return impl.document_.conditions(); });
}
EditReceipt LinkageSession::edit(const std::vector<LinkageEdit>& edits,
                                 std::optional<Revision> expected) {
  return impl_->edit(edits, expected);
}
void LinkageSession::cancel() { impl_->cancel(); }
void LinkageSession::close() { impl_->shut(SerialTask::Farewell::kSaid); }
std::shared_ptr<const LinkageResult> LinkageSession::newest_result() const {
  return impl_->read([](const Impl& impl) { return impl.newest_; });
}
std::shared_ptr<const LinkageResult> LinkageSession::final_result() const {
  return impl_->read([](const Impl& impl) { return impl.final_; });
}
std::shared_ptr<const LinkageGeometry> LinkageSession::geometry() const {
  return impl_->read([](const Impl& impl) { return impl.geometry_; });
}
std::shared_ptr<const LinkageShape> LinkageSession::shape() const {
  return impl_->read([](const Impl& impl) { return impl.shape_; });
}
std::shared_ptr<const LinkageStatics> LinkageSession::statics() const {
  return impl_->read([](const Impl& impl) { return impl.statics_; });
}
Eigen::VectorXf LinkageSession::surface(
    const Eigen::Ref<const Eigen::VectorXf>& coordinates) const {
  const auto shape = impl_->read([](const Impl& impl) { return impl.shape_; });
  if (!shape) throw Error(ErrorCode::kFailedPrecondition, "", "the linkage is not built yet");
  if (coordinates.size() != shape->size())
    throw Error(ErrorCode::kInvalidArgument, "coordinates", "of another linkage");
  return shape->surface(coordinates);
}

}  // namespace limber::session
