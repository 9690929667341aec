#include "tests/engine/session/springs/session.h"

#include <map>
#include <utility>

#include "engine/session/core/session_core.h"

namespace limber::session::springs {

/// What a round solves.
struct SpringOrder {
  std::shared_ptr<const Conditions> conditions;
};

class SpringSession::Impl final : public SessionCore<SpringResult, SpringOrder> {
 public:
  Impl(std::string id, Chain chain, Executor executor, std::shared_ptr<SpringListener> listener)
      : SessionCore(std::move(id), std::move(executor), std::move(listener)),
        document_(std::move(chain)) {}

  EditReceipt edit(const std::vector<SpringEdit>& edits, std::optional<Revision> expected) {
    std::optional<SpringDocument::Prepared> prepared;
    return change([&] { prepared.emplace(document_.prepare(edits, expected)); },
                  [&] { return document_.commit(std::move(*prepared)); });
  }
  [[nodiscard]] const SpringDocument& document() const { return document_; }

 private:
  std::string build(const JobContext&) override { return {}; }  // nothing takes time
  Revision document_revision() const override { return document_.revision(); }
  SpringOrder take_order() override { return {document_.conditions()}; }

  void solve(const Round& round) override {
    const auto known = answers_.find(round.order.conditions);
    if (known != answers_.end() && !round.is_cancelled) return finish(round, known->second);
    finish(round,
           find_equilibrium(document_.chain(), *round.order.conditions, shape_, round.cancellation,
                            [&](const Shape& shape) { publish_iterate(round, shape); }));
  }
  void solve_failed(const Round& round, const std::string& reason) override {
    Equilibrium failed{shape_, {}};
    failed.report.message = reason;
    finish(round, failed);
  }

  void publish_iterate(const Round& round, const Shape& shape) {
    if (!is_time_to_publish()) return;
    auto result = std::make_shared<SpringResult>();
    result->shape = std::make_shared<const Shape>(shape);
    publish(std::move(result), round);
  }
  void finish(const Round& round, const Equilibrium& reached) {
    const Status status = reached.report.status;
    if (status == Status::kCancelled && is_out_of_date()) {
      shape_ = reached.shape;  // the newer edit continues from here
      return;
    }
    if (status == Status::kConverged) {
      equilibrium_ = std::make_shared<const Shape>(reached.shape);
      std::erase_if(answers_, [](const auto& answer) { return answer.first.expired(); });
      answers_.emplace(round.order.conditions, reached);
    }
    shape_ = *equilibrium_;
    auto result = std::make_shared<SpringResult>();
    result->is_final = true;
    result->solve_failed = status == Status::kFailed;
    result->report = reached.report;
    result->shape = equilibrium_;
    publish(std::move(result), round);
  }

  SpringDocument document_;
  // The task's:
  Shape shape_ = document_.chain().nodes;  // where the next solve begins
  std::shared_ptr<const Shape> equilibrium_ = std::make_shared<const Shape>(shape_);  // the last
  /// Of conditions that are still held by the document: undo comes back to the very same object.
  std::map<std::weak_ptr<const Conditions>, Equilibrium, std::owner_less<>> answers_;
};

SpringSession::SpringSession(std::string id, Chain chain, Executor executor,
                             std::shared_ptr<SpringListener> listener)
    : impl_(std::make_shared<Impl>(std::move(id), std::move(chain), std::move(executor),
                                   std::move(listener))) {
  impl_->open();
}
SpringSession::~SpringSession() { impl_->shut(Impl::CloseNotification::kNone); }

const std::string& SpringSession::id() const { return impl_->id(); }
State SpringSession::state() const { return impl_->state(); }
std::string SpringSession::state_message() const { return impl_->message(); }
Revision SpringSession::revision() const {
  return impl_->read([this] { return impl_->document().revision(); });
}
std::shared_ptr<const Conditions> SpringSession::conditions() const {
  return impl_->read([this] { return impl_->document().conditions(); });
}
EditReceipt SpringSession::edit(const std::vector<SpringEdit>& edits,
                                std::optional<Revision> expected, const Author& /*author*/) {
  return impl_->edit(edits, expected);
}
void SpringSession::cancel() { impl_->cancel(); }
void SpringSession::close() { impl_->shut(Impl::CloseNotification::kSent); }
std::shared_ptr<const SpringResult> SpringSession::newest_result() const {
  return impl_->newest_result();
}
std::shared_ptr<const SpringResult> SpringSession::final_result() const {
  return impl_->final_result();
}

}  // namespace limber::session::springs
