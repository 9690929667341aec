#include "engine/session/linkages/path_summary.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numbers>
#include <vector>

#include "engine/base/degrees.h"
#include "engine/session/linkages/unit_name.h"

namespace limber::session {
namespace {

constexpr std::size_t kMaxNamed = 3;

template <class Item, class Same>
bool has(const std::vector<Item>& items, const Same& same) {
  return std::any_of(items.begin(), items.end(), same);
}

std::string load_text(const scene::JointLoad& load) {
  std::string text;
  const auto add = [&](const char* what, double size, const char* unit) {
    if (size != 0)
      text += fmt::format("{}a {} of {:.4g} {}", text.empty() ? "" : ", ", what, size, unit);
  };
  add("force", load.force.stableNorm(), "N");
  add("moment", load.moment.stableNorm(), "N m");
  add("torque", load.torque, "N m");
  return fmt::format("{} at joint {}", text, load.joint);
}

std::string place_text(const Eigen::Vector3d& place, double length_unit) {
  return fmt::format("({:.4g}, {:.4g}, {:.4g}) {}", place.x(), place.y(), place.z(),
                     unit_name(length_unit));
}

std::string target_text(const scene::LinkageTarget& target, double length_unit) {
  return fmt::format("{} {} at {} by {:.4g} N/m", target.joint >= 0 ? "joint" : "segment",
                     target.joint >= 0 ? target.joint : target.segment,
                     place_text(target.position, length_unit), target.stiffness);
}

std::vector<std::string> requests(const scene::LinkageConditions& before,
                                  const scene::LinkageConditions& requested, double length_unit) {
  std::vector<std::string> found;
  if (requested.mean_angle && requested.mean_angle != before.mean_angle)
    found.push_back(
        fmt::format("a mean angle of {:.4g} degrees", *requested.mean_angle * kDegreesPerRadian));
  for (const scene::JointAngle& set : requested.angles) {
    if (has(before.angles, [&](const scene::JointAngle& known) {
          return known.joint == set.joint && known.angle == set.angle;
        }))
      continue;
    found.push_back(fmt::format("an angle of {:.4g} degrees at joint {}",
                                set.angle * kDegreesPerRadian, set.joint));
  }
  for (const scene::JointLoad& load : requested.loads) {
    if (has(before.loads, [&](const scene::JointLoad& known) {
          return known.joint == load.joint && known.force == load.force &&
                 known.moment == load.moment && known.torque == load.torque;
        }))
      continue;
    found.push_back(load_text(load));
  }
  for (const scene::LinkageTarget& target : requested.targets) {
    if (has(before.targets, [&](const scene::LinkageTarget& known) {
          return known.id == target.id && known.joint == target.joint &&
                 known.segment == target.segment && known.share == target.share &&
                 known.position == target.position && known.stiffness == target.stiffness;
        }))
      continue;
    found.push_back(target_text(target, length_unit));
  }
  for (const scene::JointPin& pin : requested.pins) {
    if (!pin.position || has(before.pins, [&](const scene::JointPin& known) {
          return known.joint == pin.joint && known.position == pin.position;
        }))
      continue;
    found.push_back(
        fmt::format("joint {} at {}", pin.joint, place_text(*pin.position, length_unit)));
  }
  if (!requested.gravity.isZero(0) && requested.gravity != before.gravity)
    found.push_back(fmt::format("gravity of {:.4g} m/s^2", requested.gravity.stableNorm()));
  return found;
}

}  // namespace

std::string describe_resistance(const rods::Resistance& resistance, double length_unit) {
  std::string text;
  if (resistance.pin) {
    text += fmt::format("; the most loaded pin is at joint {}, with a force of {:.3g} N",
                        resistance.pin->joint, resistance.pin->force.norm());
  }
  if (resistance.angle) {
    text +=
        fmt::format("; the set angle that resists most is at joint {}, with a torque of {:.3g} N m",
                    resistance.angle->joint, resistance.angle->opening_torque * length_unit);
  }
  return text;
}

std::string describe_request(const scene::LinkageConditions& before,
                             const scene::LinkageConditions& requested, double length_unit) {
  const std::vector<std::string> found = requests(before, requested, length_unit);
  if (found.empty()) return {};
  const std::size_t count = std::min(found.size(), kMaxNamed);
  std::string text = fmt::format(
      "; requested: {}",
      fmt::join(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count), "; "));
  if (found.size() > count) text += fmt::format(", and {} more", found.size() - count);
  return text;
}

}  // namespace limber::session
