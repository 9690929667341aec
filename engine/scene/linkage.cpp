#include "engine/scene/linkage.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "engine/base/degrees.h"

namespace limber::scene {
namespace {

constexpr std::uint64_t kLargestId = std::uint64_t{1} << 62;  // leaves room for those given later
constexpr double kGreatestLoad = 1e90;  // [N], [N m]: squares of what solvers make of it overflow

/// The greatest coordinate, whose square might overflow; infinite where one is not finite.
double largest_entry(const Eigen::Vector3d& vector) {
  return vector.allFinite() ? vector.cwiseAbs().maxCoeff()
                            : std::numeric_limits<double>::infinity();
}

class ConditionsValidator {
 public:
  ConditionsValidator(const LinkageConditions& conditions, int joints, int segments)
      : conditions_(conditions), joints_(joints), segments_(segments) {}

  std::vector<Issue> run() {
    check_pins();
    check_angles();
    check_targets();
    check_loads();
    check_sizes();
    check_gravity();
    if (conditions_.erection) check_erection(*conditions_.erection);
    return std::move(issues_);
  }

 private:
  void error(std::string field, std::string message, ErrorCode code = ErrorCode::kInvalidArgument) {
    issues_.push_back({Issue::Severity::kError, std::move(field), std::move(message), code});
  }
  bool check_joint(const std::string& field, int joint) {
    if (joint >= 0 && joint < joints_) return true;
    error(field, fmt::format("joint {} is outside 0 .. {}", joint, joints_ - 1),
          ErrorCode::kOutOfRange);
    return false;
  }
  void check_angle(const std::string& field, const std::string& what, double angle) {
    if (std::isfinite(angle) && std::abs(angle) < std::numbers::pi) return;
    error(field,
          fmt::format("{} of {:g} degrees cannot be reached, must be in (-180, 180)", what,
                      angle * kDegreesPerRadian),
          ErrorCode::kOutOfRange);
  }

  void check_erection(const LinkageErection& erection) {
    check_angle("erection.mean_angle", "a mean angle", erection.mean_angle);
    for (std::size_t i = 0; i < erection.path.size(); ++i)
      check_angle(fmt::format("erection.path[{}]", i), "a mean angle", erection.path[i]);
    std::set<int> pushed;
    for (std::size_t i = 0; i < erection.push.size(); ++i) {
      const JointLoad& load = erection.push[i];
      const std::string field = fmt::format("erection.push[{}]", i);
      if (!check_joint(field + ".joint", load.joint)) continue;
      if (!pushed.insert(load.joint).second)
        error(field + ".joint", fmt::format("joint {} is pushed twice", load.joint));
      if (!load.force.allFinite() || !load.moment.allFinite() || !std::isfinite(load.torque))
        error(field, "must be finite");
    }
    const auto check_joints = [&](const char* field, const Eigen::Matrix3Xd& positions) {
      if (positions.cols() != 0 && positions.cols() != joints_)
        error(field, fmt::format("must have a row for each of {} joints, has {}", joints_,
                                 positions.cols()));
      if (!positions.allFinite()) error(field, "must be finite");
    };
    check_joints("erection.flat_positions", erection.flat_positions);
    check_joints("erection.positions", erection.positions);
    if (!erection.path_moments.empty() && erection.path_moments.size() != erection.path.size())
      error("erection.path_moments", "must be as many as angles of the path");
    for (const double moment : erection.path_moments)
      if (!std::isfinite(moment)) error("erection.path_moments", "must be finite");
    if (erection.support) check_joint("erection.support.joint", erection.support->joint);
    if (!std::isfinite(erection.distance) || erection.distance < 0)
      error("erection.distance", "must be finite and >= 0");
  }

  void check_pins() {
    for (std::size_t i = 0; i < conditions_.pins.size(); ++i) {
      const JointPin& pin = conditions_.pins[i];
      const std::string field = fmt::format("pins[{}].joint", i);
      if (!check_joint(field, pin.joint)) continue;
      if (!pinned_.insert(pin.joint).second)
        error(field, fmt::format("joint {} is pinned twice", pin.joint));
      if (pin.held != Held::kMotion) held_angles_.insert(pin.joint);
      if (!pin.position) continue;
      const std::string position = fmt::format("pins[{}].position", i);
      if (pin.held == Held::kAngle) error(position, "only the angle of this joint is held");
      if (!pin.position->allFinite()) error(position, "must be finite");
    }
  }

  void check_angles() {
    std::set<int> distinct_joints;
    for (std::size_t i = 0; i < conditions_.angles.size(); ++i) {
      const JointAngle& setting = conditions_.angles[i];
      const std::string field = fmt::format("angles[{}]", i);
      check_angle(field + ".angle", fmt::format("an angle of joint {}", setting.joint),
                  setting.angle);
      if (!check_joint(field + ".joint", setting.joint)) continue;
      if (!distinct_joints.insert(setting.joint).second)
        error(field + ".joint", fmt::format("joint {} has two angles", setting.joint));
      if (held_angles_.count(setting.joint) > 0) {
        error(field + ".joint", fmt::format("the angle of joint {} is pinned: release it, or leave "
                                            "its angle alone",
                                            setting.joint));
      }
    }
    if (!conditions_.mean_angle) return;
    check_angle("mean_angle", "a mean angle", *conditions_.mean_angle);
    if (joints_ == 0) return error("mean_angle", "the linkage has no joints that could open");
    distinct_joints.insert(held_angles_.begin(), held_angles_.end());
    if (static_cast<int>(distinct_joints.size()) == joints_)
      return error("mean_angle", "the angles of all joints are given already");
    if (!held_angles_.empty() || !issues_.empty()) return;
    double rest = joints_ * *conditions_.mean_angle;
    for (const JointAngle& set : conditions_.angles) rest -= set.angle;
    rest /= static_cast<double>(joints_ - static_cast<int>(distinct_joints.size()));
    if (std::abs(rest) < std::numbers::pi) return;
    error("mean_angle",
          fmt::format("cannot be reached: what single angles leave to each other joint is {:.4g} "
                      "degrees, and must be in (-180, 180)",
                      rest * kDegreesPerRadian));
  }

  void check_targets() {
    std::set<std::uint64_t> ids;
    for (std::size_t i = 0; i < conditions_.targets.size(); ++i) {
      const LinkageTarget& target = conditions_.targets[i];
      const std::string field = fmt::format("targets[{}]", i);
      if (target.id > kLargestId) {
        error(field + ".id", fmt::format("ids are at most {}", kLargestId), ErrorCode::kOutOfRange);
      } else if (target.id != 0 && !ids.insert(target.id).second) {
        error(field + ".id", fmt::format("the id {} is taken", target.id),
              ErrorCode::kAlreadyExists);
      }
      if ((target.joint >= 0) == (target.segment >= 0)) {
        error(field, "a joint or a segment is expected, and not both");
      } else if (target.joint >= 0) {
        check_joint(field + ".joint", target.joint);
      } else if (target.segment >= segments_) {
        error(field + ".segment",
              fmt::format("segment {} is outside 0 .. {}", target.segment, segments_ - 1),
              ErrorCode::kOutOfRange);
      }
      if (!(target.share >= 0 && target.share <= 1))
        error(field + ".share", fmt::format("must be in [0, 1], is {:g}", target.share));
      if (!target.position.allFinite()) error(field + ".position", "must be finite");
      check_stiffness(field + ".stiffness", target);
    }
  }

  void check_stiffness(const std::string& field, const LinkageTarget& target) {
    if (target.stiffness > 0 && target.stiffness <= kGreatestLoad) return;
    const std::string where = target.joint >= 0 ? fmt::format("joint {}", target.joint)
                                                : fmt::format("segment {}", target.segment);
    if (target.stiffness > 0 && std::isfinite(target.stiffness)) {
      return error(field,
                   fmt::format("the spring at {} has {:g} N/m: no more than {:g} N/m can be "
                               "reckoned with",
                               where, target.stiffness, kGreatestLoad),
                   ErrorCode::kOutOfRange);
    }
    error(field, fmt::format("of the spring at {}: must be > 0 and finite, is {:g} N/m", where,
                             target.stiffness));
  }

  void check_loads() {
    std::set<int> distinct_joints;
    for (std::size_t i = 0; i < conditions_.loads.size(); ++i) {
      const JointLoad& load = conditions_.loads[i];
      const std::string field = fmt::format("loads[{}]", i);
      if (check_joint(field + ".joint", load.joint) && !distinct_joints.insert(load.joint).second)
        error(field + ".joint", fmt::format("joint {} has two loads", load.joint));
      check_load(field + ".force", load.joint, "force", largest_entry(load.force), "N");
      check_load(field + ".moment", load.joint, "moment", largest_entry(load.moment), "N m");
      check_load(field + ".torque", load.joint, "torque", std::abs(load.torque), "N m");
    }
  }
  void check_load(const std::string& field, int joint, const char* what, double size,
                  const char* unit) {
    if (!std::isfinite(size))
      return error(field, fmt::format("the {} of joint {} must be finite", what, joint));
    if (size <= kGreatestLoad) return;
    error(field,
          fmt::format("the {} of joint {} is {:g} {}: no more than {:g} {} can be reckoned with",
                      what, joint, size, unit, kGreatestLoad, unit),
          ErrorCode::kOutOfRange);
  }

  void check_gravity() {
    const double size = largest_entry(conditions_.gravity);
    if (!std::isfinite(size)) return error("gravity", "must be finite");
    if (size <= kGreatestLoad) return;
    error("gravity",
          fmt::format("{:g} m/s^2: no more than {:g} m/s^2 can be reckoned with", size,
                      kGreatestLoad),
          ErrorCode::kOutOfRange);
  }

  void check_sizes() {
    const auto check_positive = [&](const char* field, const Eigen::VectorXd& sizes) {
      for (Eigen::Index i = 0; i < sizes.size(); ++i) {
        if (sizes[i] > 0 && std::isfinite(sizes[i])) continue;
        error(fmt::format("{}[{}]", field, i),
              fmt::format("must be > 0 and finite, is {:g}", sizes[i]));
      }
    };
    const auto check_segments = [&](const char* field, const char* what,
                                    const Eigen::VectorXd& sizes) {
      if (sizes.size() == 0 || sizes.size() == segments_) return check_positive(field, sizes);
      error(field, fmt::format("{} {} for {} segments", sizes.size(), what, segments_));
    };
    check_segments("segment_lengths", "lengths", conditions_.segment_lengths);
    check_segments("section_scales", "scales", conditions_.section_scales);
    check_positive("edge_lengths", conditions_.edge_lengths);
    if (conditions_.edge_lengths.size() > 0 && conditions_.segment_lengths.size() > 0)
      error("edge_lengths", "are given beside segment_lengths: only one of them can hold");
  }

  const LinkageConditions& conditions_;
  const int joints_, segments_;
  std::set<int> pinned_, held_angles_;
  std::vector<Issue> issues_;
};

}  // namespace

std::vector<Issue> validate(const LinkageConditions& conditions, int joints, int segments) {
  return ConditionsValidator(conditions, joints, segments).run();
}

}  // namespace limber::scene
