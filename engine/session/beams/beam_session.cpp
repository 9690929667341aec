#include "engine/session/beams/beam_session.h"

#include <fmt/format.h>

#include <chrono>
#include <deque>
#include <mutex>
#include <utility>

#include "engine/base/rotations/logarithm.h"
#include "engine/session/beams/live_beams.h"
#include "engine/session/serial_task.h"

namespace limber::session {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPublishInterval{8};

std::shared_ptr<const Eigen::MatrixXf> columns(const std::vector<Eigen::VectorXf>& shapes) {
  auto frames =
      std::make_shared<Eigen::MatrixXf>(shapes[0].size(), static_cast<Eigen::Index>(shapes.size()));
  for (std::size_t i = 0; i < shapes.size(); ++i)
    frames->col(static_cast<Eigen::Index>(i)) = shapes[i];
  return frames;
}

/// Nodes in a shape that is known to be the newest; null: it is not.
class KnownPlaces final : public BeamDocument::Places {
 public:
  KnownPlaces(const BeamDocument& document, std::shared_ptr<const BeamResult> settled)
      : document_(document), settled_(std::move(settled)) {}

  [[nodiscard]] beams::PrescribedMotion of(int node) const override {
    if (!settled_ || !settled_->analysis)
      throw Error(ErrorCode::kFailedPrecondition, "node",
                  fmt::format("node {} is not at rest yet: wait for revision {}", node,
                              document_.revision()));
    const beams::BeamState& state = settled_->analysis->solution.state;
    const auto i = static_cast<std::size_t>(node);
    beams::PrescribedMotion motion;
    motion.node = node;
    motion.translates = motion.rotates = {true, true, true};
    motion.translation = state.positions.col(node) - document_.model().nodes[i].position;
    motion.rotation = rotations::logarithm(state.rotations[i]);
    return motion;
  }

 private:
  const BeamDocument& document_;
  std::shared_ptr<const BeamResult> settled_;
};

}  // namespace

/// Two halves, as Session::Impl has them: what any thread may touch, under mutex_; and live_, which
/// only the task touches, of which there is at most one at a time.
class BeamSession::Impl : public std::enable_shared_from_this<BeamSession::Impl> {
 public:
  Impl(std::string id, beams::BeamModel model, BeamLimits limits, Executor executor,
       std::shared_ptr<BeamListener> listener, std::optional<beams::BeamState> shape)
      : id_(std::move(id)),
        listener_(std::move(listener)),
        document_(std::move(model), limits),
        task_(mutex_, std::move(executor), [this] { say(State::kClosed); }),
        edited_at_(Clock::now()),
        live_(document_.model(), std::move(shape)) {}

  void open();
  EditReceipt edit(const std::vector<BeamEdit>& edits, std::optional<Revision> expected);
  void cancel();
  void shut(SerialTask::Farewell farewell);

  template <class Read>
  [[nodiscard]] auto read(const Read& get) const {
    const std::lock_guard lock(mutex_);
    return get(*this);
  }

 private:
  friend class BeamSession;
  using Conditions = std::shared_ptr<const BeamConditions>;
  struct Round {
    Revision revision = 0;
    Conditions conditions;
    Clock::time_point edited_at;
    Cancellation cancellation;
  };

  // With the lock:
  void demand_open() const {
    if (task_.is_closed()) throw Error(ErrorCode::kFailedPrecondition, "", "the session is closed");
  }
  void post(std::unique_lock<std::mutex> lock);
  [[nodiscard]] bool chooses_side(const BeamConditions& conditions) const;
  void finish_first(Revision revision, Conditions conditions);

  void say(State state) {
    tell(listener_.get(), [state](BeamListener& listener) { listener.on_state(state, ""); });
  }

  // The task's:
  void run();
  void begin();
  [[nodiscard]] std::optional<Round> next_round();
  void solve(const Round& round);
  void publish_iterate(const beams::BeamState& state, const Round& round);
  void hand_out(std::shared_ptr<BeamResult> result, const Round& round);

  const std::string id_;
  const std::shared_ptr<BeamListener> listener_;

  /// Held by the edit under way, before mutex_: the document changes under both, so that either is
  /// enough to read it and many edits hold up no reader.
  std::mutex edits_;
  mutable std::mutex mutex_;
  BeamDocument document_;
  SerialTask task_;
  Clock::time_point edited_at_;
  bool work_ = false, cancelled_ = false;
  std::deque<Round> first_;   // to be solved before what the document says, whatever comes
  bool must_finish_ = false;  // edits do not interrupt the round under way
  State state_ = State::kBuilding;
  std::string message_;
  Cancellation round_;  // of the solve under way
  std::uint64_t sequence_ = 0;
  std::shared_ptr<const BeamResult> newest_, final_;

  LiveBeams live_;                  // the task's
  Clock::time_point published_at_;  // the task's
};

void BeamSession::Impl::post(std::unique_lock<std::mutex> lock) {
  task_.post(
      std::move(lock), [self = shared_from_this()] { self->run(); }, message_);
}

void BeamSession::Impl::open() {
  std::unique_lock lock(mutex_);
  work_ = true;
  post(std::move(lock));
  lock = std::unique_lock(mutex_);
  if (state_ == State::kBuilding && !task_.is_pending() && !message_.empty())
    throw Error(ErrorCode::kInternal, "", message_);
}

/// Do pushes act, or temporary loads of the structure, which is in no equilibrium yet? Called with
/// the lock.
bool BeamSession::Impl::chooses_side(const BeamConditions& conditions) const {
  const bool is_solved = final_ && final_->analysis;
  return !conditions.temporary_loads.empty() ||
         (!is_solved && !document_.model().temporary_loads.empty());
}

/// Temporary loads choose a side: what has them is solved to its end before an edit is looked at.
/// Called with the lock.
void BeamSession::Impl::finish_first(Revision revision, Conditions conditions) {
  if (work_ && chooses_side(*conditions))
    first_.push_back({revision, std::move(conditions), edited_at_, {}});
}

EditReceipt BeamSession::Impl::edit(const std::vector<BeamEdit>& edits,
                                    std::optional<Revision> expected) {
  const std::lock_guard one_at_a_time(edits_);
  const std::shared_ptr<const BeamResult> settled = read([](const Impl& impl) {
    impl.demand_open();
    const bool is_settled =
        impl.final_ && impl.final_->revision == impl.document_.revision() && !impl.work_;
    return is_settled ? impl.final_ : nullptr;
  });
  BeamDocument::Prepared prepared =
      document_.prepare(edits, expected, KnownPlaces(document_, settled));
  std::unique_lock lock(mutex_);
  demand_open();
  const Revision before = document_.revision();
  const Conditions conditions = document_.conditions();
  EditReceipt receipt = document_.commit(std::move(prepared));
  finish_first(before, conditions);
  edited_at_ = Clock::now();
  work_ = true;
  cancelled_ = false;
  if (!must_finish_) round_.request();
  post(std::move(lock));
  return receipt;
}

void BeamSession::Impl::cancel() {
  const std::lock_guard lock(mutex_);
  if (!task_.is_pending()) return;
  cancelled_ = true;
  first_.clear();
  round_.request();
}

void BeamSession::Impl::shut(SerialTask::Farewell farewell) {
  std::unique_lock lock(mutex_);
  state_ = State::kClosed;
  round_.request();
  task_.close(std::move(lock), farewell);
}

void BeamSession::Impl::run() {
  if (!task_.begin()) return;
  try {
    begin();
    while (const auto round = next_round()) solve(*round);
  } catch (...) {  // out of memory between rounds: what was accepted waits for the next call
    std::unique_lock lock(mutex_);
    work_ = true;
    task_.finish(std::move(lock));
  }
}

void BeamSession::Impl::begin() {
  {
    const std::lock_guard lock(mutex_);
    if (task_.is_closed() || state_ != State::kBuilding) return;
    state_ = State::kReady;
  }
  say(State::kReady);
}

/// Nothing to do: the task ends, in the same breath.
std::optional<BeamSession::Impl::Round> BeamSession::Impl::next_round() {
  std::unique_lock lock(mutex_);
  if (task_.is_closed() || !work_) {
    task_.finish(std::move(lock));
    return {};
  }
  round_ = Cancellation();
  Round round{document_.revision(), document_.conditions(), edited_at_, round_};
  if (first_.empty()) {
    work_ = false;
    if (cancelled_) round_.request();
  } else {
    round = std::move(first_.front());
    round.cancellation = round_;
    first_.pop_front();
  }
  must_finish_ = chooses_side(*round.conditions);
  return round;
}

void BeamSession::Impl::solve(const Round& round) {
  published_at_ = Clock::now();
  LiveBeams::Outcome outcome;
  try {
    outcome = live_.solve(round.conditions, JobContext{round.cancellation, {}},
                          [&](const beams::BeamState& state) { publish_iterate(state, round); });
  } catch (const std::exception& error) {
    live_.restore();
    outcome.report.status = beams::BeamStatus::kStalled;
    outcome.report.message = error.what();
  }
  const bool cancelled = outcome.report.status == beams::BeamStatus::kCancelled;
  // A newer revision goes on from what was reached.
  const auto interrupted = [](const Impl& impl) {
    return impl.task_.is_closed() || (impl.work_ && !impl.must_finish_);
  };
  if (cancelled && read(interrupted)) return;
  if (cancelled) live_.restore();
  auto result = std::make_shared<BeamResult>();
  result->converged = true;
  result->solve_failed = !outcome.reached && !cancelled;
  result->report = std::move(outcome.report);
  result->frames =
      columns(outcome.reached ? outcome.frames : std::vector{beam_coordinates(live_.state())});
  result->analysis = live_.analysis();
  hand_out(std::move(result), round);
}

void BeamSession::Impl::publish_iterate(const beams::BeamState& state, const Round& round) {
  const auto now = Clock::now();
  if (now - published_at_ < kPublishInterval) return;
  published_at_ = now;
  auto result = std::make_shared<BeamResult>();
  result->frames = columns({beam_coordinates(state)});
  hand_out(std::move(result), round);
}

void BeamSession::Impl::hand_out(std::shared_ptr<BeamResult> result, const Round& round) {
  result->revision = round.revision;
  result->since_edit_ms =
      std::chrono::duration<double, std::milli>(Clock::now() - round.edited_at).count();
  std::shared_ptr<const BeamResult> older, older_final;  // freed without the lock
  {
    const std::lock_guard lock(mutex_);
    if (task_.is_closed()) return;
    result->sequence = ++sequence_;
    older = std::exchange(newest_, result);
    if (result->converged) older_final = std::exchange(final_, result);
  }
  tell(listener_.get(), [&](BeamListener& listener) { listener.on_result(result); });
}

BeamSession::BeamSession(std::string id, beams::BeamModel model, BeamLimits limits,
                         Executor executor, std::shared_ptr<BeamListener> listener,
                         std::optional<beams::BeamState> shape)
    : impl_(std::make_shared<Impl>(std::move(id), std::move(model), limits, std::move(executor),
                                   std::move(listener), std::move(shape))) {
  impl_->open();
}
BeamSession::~BeamSession() { impl_->shut(SerialTask::Farewell::kSilent); }

const std::string& BeamSession::id() const { return impl_->id_; }
State BeamSession::state() const {
  return impl_->read([](const Impl& impl) { return impl.state_; });
}
Revision BeamSession::revision() const {
  return impl_->read([](const Impl& impl) { return impl.document_.revision(); });
}
beams::BeamModel BeamSession::model() const {
  const beams::BeamModel& opened = impl_->document_.model();
  beams::BeamModel model = with_conditions(opened, *conditions());
  model.temporary_loads.insert(model.temporary_loads.begin(), opened.temporary_loads.begin(),
                               opened.temporary_loads.end());
  return model;
}
std::shared_ptr<const BeamConditions> BeamSession::conditions() const {
  return impl_->read([](const Impl& impl) { return impl.document_.conditions(); });
}
EditReceipt BeamSession::edit(const std::vector<BeamEdit>& edits,
                              std::optional<Revision> expected) {
  return impl_->edit(edits, expected);
}
void BeamSession::cancel() { impl_->cancel(); }
void BeamSession::close() { impl_->shut(SerialTask::Farewell::kSaid); }
std::shared_ptr<const BeamResult> BeamSession::newest_result() const {
  return impl_->read([](const Impl& impl) { return impl.newest_; });
}
std::shared_ptr<const BeamResult> BeamSession::final_result() const {
  return impl_->read([](const Impl& impl) { return impl.final_; });
}

}  // namespace limber::session
