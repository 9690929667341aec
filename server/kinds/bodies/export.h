#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "engine/session/bodies/session.h"
#include "limber/v1/service.pb.h"
#include "server/kinds/bodies/carried_surface.h"
#include "server/runtime/job_motion.h"

namespace limber::server {

namespace proto = limber::v1;

/// A motion that a job made, with the scene that it is of.
struct ComputedMotion {
  scene::Scene scene;
  session::Geometry geometry;  // without a basis
  Eigen::MatrixXd positions;   // 3 source nodes x frames [scene units]
  double frames_per_second = 30;
};
/// As what a job leaves behind.
[[nodiscard]] std::shared_ptr<const JobMotion> job_motion(ComputedMotion motion);

/// A motion as files, cut into parts of about 16 MB so that none is larger than a message may be.
/// Point caches are of single precision. For a body far from the origin, they and the .obj next to
/// them are relative to its middle (scene::origin_for()), which a comment of the .obj states.
struct MotionExport {
  std::shared_ptr<const session::Geometry> geometry;
  int frame_count = 0;
  /// Positions of `count` frames from `first` on, 3 source nodes x count [scene units].
  std::function<Eigen::MatrixXd(int first, int count)> positions;
  std::string stem;
  double frames_per_second = 30;
  std::shared_ptr<const CarriedSurface> surface = {};  // null: none

  [[nodiscard]] std::uint32_t part_count(proto::ExportFormat format) const;
  /// @throws Refusal OUT_OF_RANGE naming `part`
  [[nodiscard]] proto::ExportResponse part(proto::ExportFormat format, std::uint32_t part) const;

 private:
  [[nodiscard]] int frames_per_part(proto::ExportFormat format) const;
  void add_pvd(int first, int count, proto::ExportResponse& response) const;
  void add_pc2(int first, int count, proto::ExportResponse& response) const;
  void add_surface(int first, int count, proto::ExportResponse& response) const;
  void add_detail(int first, int count, proto::ExportResponse& response) const;
  [[nodiscard]] Eigen::Vector3d origin() const;
  void add_cache(const std::string& name, const Eigen::MatrixXd& positions, int first,
                 proto::ExportResponse& response) const;
};

/// A scene as .json, next to its mesh as .vtu and its base motion, if there is one, as .pc2: files
/// that `limber validate` and OpenSession read again.
[[nodiscard]] proto::ExportResponse export_scene(const scene::Scene& scene,
                                                 const std::string& stem);

/// A part of the files of a job's motion; as a scene, the scene with the motion as its base motion,
/// in one part.
/// @throws Refusal OUT_OF_RANGE naming `part`
[[nodiscard]] proto::ExportResponse export_computed(
    const std::shared_ptr<const ComputedMotion>& motion, proto::ExportFormat format,
    const std::string& stem, std::uint32_t part);

/// @throws Refusal unless it is a format of bodies
void demand_body_format(proto::ExportFormat format);

}  // namespace limber::server
