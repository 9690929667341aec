#include "engine/rods/linkage/terminal_edge.h"

#include "engine/base/rotations/exponential_map.h"

namespace limber::rods {

JointState<double> advanced(const JointState<double>& joint,
                            const JointIncrement<double>& increment) {
  const Eigen::Vector3d turn = increment.segment<3>(kJointRotation);
  JointState<double> result = joint;
  result.position += increment.segment<3>(kJointPosition);
  if (!turn.isZero(0)) {
    const Eigen::Matrix3d rotation = rotations::exponential(turn);
    result.normal = (rotation * joint.normal).normalized();
    // Many small turns must not wear the frame down.
    const Eigen::Vector3d bisector = rotation * joint.bisector;
    result.bisector = (bisector - result.normal * result.normal.dot(bisector)).normalized();
  }
  result.opening_angle += increment[kJointAngle];
  result.lengths[kRodA] += increment[kJointLengthA];
  result.lengths[kRodB] += increment[kJointLengthB];
  return result;
}

}  // namespace limber::rods
