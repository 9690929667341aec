#include "tests/server/kinds/springs/kind.h"

#include <fmt/format.h>

#include <utility>

#include "server/wire/issues.h"
#include "springs.pb.h"
#include "tests/server/kinds/springs/messages.h"
#include "tests/server/kinds/springs/record.h"

namespace limber::server::springs {
namespace {

class ChainOpening final : public Opening {
 public:
  explicit ChainOpening(const proto::Scene& scene)
      : name_(scene.name()), chain_(decode_chain(scene, "scene.")) {}

  [[nodiscard]] std::string size() const override {
    return fmt::format("{} springs", chain_.springs.size());
  }
  [[nodiscard]] SessionMemory memory() const override {
    return {1000 * chain_.springs.size(), 1000 * chain_.springs.size()};
  }
  [[nodiscard]] std::shared_ptr<Record> make_record(Hub& hub, const SessionKey& key,
                                                    JobId open_job) override {
    return record_ = std::make_shared<ChainRecord>(hub, key, name_, chain_, open_job);
  }
  void start(Hub&, session::Executor executor) override {
    record_->attach(std::make_shared<session::springs::SpringSession>(
        record_->id(), chain_, std::move(executor), record_));
  }

 private:
  std::string name_;
  session::springs::Chain chain_;
  std::shared_ptr<ChainRecord> record_;
};

class ChainKind final : public Kind {
 public:
  [[nodiscard]] const char* name() const override { return "springs"; }
  [[nodiscard]] bool accepts(const proto::Scene& scene) const override {
    return scene.extension().Is<limber::springs::Chain>();
  }
  [[nodiscard]] std::unique_ptr<Opening> read(const proto::Scene& scene,
                                              const SceneContext&) const override {
    return std::make_unique<ChainOpening>(scene);
  }
  [[nodiscard]] std::vector<proto::Issue> validate(const proto::Scene& scene,
                                                   const std::string& prefix,
                                                   const SceneContext&) const override {
    Faults faults(Faults::Mode::kCollect);
    faults.try_to([&] { (void)decode_chain(scene, prefix); });
    std::vector<proto::Issue> issues;
    for (const auto& fault : faults.found()) issues.push_back(encode_fault(fault));
    return issues;
  }
};

}  // namespace

std::unique_ptr<const Kind> make_kind() { return std::make_unique<ChainKind>(); }

}  // namespace limber::server::springs
