#include "engine/rods/design/kept_factors.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <utility>

namespace limber::rods::detail {
namespace {

bool same(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  return a.size() == b.size() && a == b;
}

bool same(const JointState<double>& a, const JointState<double>& b) {
  return a.position == b.position && a.normal == b.normal && a.bisector == b.bisector &&
         a.opening_angle == b.opening_angle && a.lengths[0] == b.lengths[0] &&
         a.lengths[1] == b.lengths[1];
}

bool same(const LinkageModel& model, const LinkageState& a, const LinkageState& b) {
  const bool joints = std::equal(
      a.joints().begin(), a.joints().end(), b.joints().begin(), b.joints().end(),
      [](const JointState<double>& x, const JointState<double>& y) { return same(x, y); });
  if (!joints) return false;
  for (std::size_t batch = 0; batch < model.chains()->batches().size(); ++batch) {
    const int index = static_cast<int>(batch);
    const std::size_t slots = model.first_slot(index + 1) - model.first_slot(index);
    // Bit by bit, which is quick.
    if (std::memcmp(a.slots(model, index), b.slots(model, index),
                    sizeof(double) * slots * LinkageState::kFields * kChainLanes) != 0)
      return false;
  }
  return true;
}

bool same(const LinkageModel& model, const DesignPoint& a, const DesignPoint& b) {
  return same(a.lengths, b.lengths) && same(a.edges, b.edges) && same(a.sections, b.sections) &&
         same(model, a.deployed, b.deployed) && same(model, a.flat, b.flat);
}

}  // namespace

std::unique_ptr<HessianFactor> KeptFactors::spare() {
  if (spares_.empty()) return nullptr;
  std::unique_ptr<HessianFactor> result = std::move(spares_.back());
  spares_.pop_back();
  return result;
}

void KeptFactors::give_back(std::unique_ptr<HessianFactor> factor) {
  if (factor) spares_.push_back(std::move(factor));
}

void KeptFactors::keep(const DesignPoint& point, Pair factors) {
  give_back(std::exchange(factors_.flat, std::move(factors.flat)));
  give_back(std::exchange(factors_.deployed, std::move(factors.deployed)));
  point_ = point;
}

KeptFactors::Pair KeptFactors::take(const LinkageModel& model, const DesignPoint& point) {
  if (!point_ || !same(model, *point_, point)) return {};
  point_.reset();
  return std::exchange(factors_, {});
}

}  // namespace limber::rods::detail
