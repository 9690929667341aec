#pragma once

#include <Eigen/Core>

#include "limber/v1/common.pb.h"

namespace limber::server {

namespace proto = limber::v1;

[[nodiscard]] inline Eigen::Vector3d decode_vector(const proto::Vector3& message) {
  return {message.x(), message.y(), message.z()};
}

inline void encode_vector(const Eigen::Vector3d& vector, proto::Vector3& message) {
  message.set_x(vector.x());
  message.set_y(vector.y());
  message.set_z(vector.z());
}

}  // namespace limber::server
