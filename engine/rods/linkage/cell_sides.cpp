#include "engine/rods/linkage/cell_sides.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "engine/rods/linkage/joint_orientation.h"

namespace limber::rods::detail {
namespace {

/// Ends of links around their joints, and walks along links that turn to one side at each joint.
class Cells {
 public:
  Cells(const std::vector<RodPair>& pairs, const std::vector<JointLink>& links,
        const std::vector<Eigen::Vector3d>& normals, const std::vector<double>& cosines)
      : cosines_(cosines), around_(2 * links.size()) {
    int segments = 0;
    for (const JointLink& link : links) segments = std::max(segments, link.segment + 1);
    std::vector<int> link_of(static_cast<std::size_t>(segments), -1);
    for (std::size_t i = 0; i < links.size(); ++i) link_of[links[i].segment] = static_cast<int>(i);
    for (std::size_t j = 0; j < pairs.size(); ++j) {
      std::vector<int> ends;  // counter-clockwise about the normal
      for (const Spoke& spoke : in_order(pairs[j], normals[j])) {
        const int link = spoke.segment < segments ? link_of[spoke.segment] : -1;
        if (link < 0) continue;
        ends.push_back(2 * link + (links[link].joints[0] == static_cast<int>(j) ? 0 : 1));
      }
      for (std::size_t k = 0; k < ends.size(); ++k) {
        const int next = ends[(k + 1) % ends.size()];
        around_[ends[k]][1] = next;
        around_[next][0] = ends[k];
      }
    }
  }

  /// Closed walks along a link on either side, in either direction.
  [[nodiscard]] int count_at(int link) const {
    std::vector<int> met;
    int walks = 0;
    for (int state = 4 * link; state < 4 * link + 4; ++state) {
      if (std::find(met.begin(), met.end(), state) != met.end()) continue;
      ++walks;
      int at = state;
      do {
        if (at / 4 == link) met.push_back(at);
        at = next(at);
      } while (at != state);
    }
    return walks;
  }

 private:
  static std::vector<Spoke> in_order(const RodPair& pair, const Eigen::Vector3d& normal) {
    const bool turned = pair.tangents[0].cross(pair.tangents[1]).dot(normal) < 0;
    std::vector<Spoke> order;
    for (const std::size_t place : {0, 1}) {
      for (const int r : {0, 1}) {
        // The second rod's spokes the other way round where its tangent is on the right.
        const std::size_t k = r == 1 && turned ? 1 - place : place;
        if (k < pair.rods[r].size()) order.push_back(pair.rods[r][k]);
      }
    }
    return order;
  }

  /// A state is an end of a link, from which it is walked to the other, and the side of the cell:
  /// 2 * end + (0: left, 1: right).
  [[nodiscard]] int next(int state) const {
    const int end = state / 2, link = end / 2;
    const int side = state % 2 ^ (cosines_[link] < 0 ? 1 : 0);
    return 2 * around_[end ^ 1][side] + side;
  }

  const std::vector<double>& cosines_;
  std::vector<std::array<int, 2>> around_;  // of ends: the next one clockwise, counter-clockwise
};

}  // namespace

void correct_sides(const std::vector<RodPair>& pairs, const std::vector<JointLink>& links,
                   const std::vector<Eigen::Vector3d>& normals, double most,
                   std::vector<double>& cosines) {
  std::vector<int> order;
  for (std::size_t i = 0; i < links.size(); ++i)
    if (std::abs(cosines[i]) < most) order.push_back(static_cast<int>(i));
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return std::abs(cosines[a]) < std::abs(cosines[b]); });
  const Cells cells(pairs, links, normals, cosines);
  for (bool more = true; more;) {  // ends: there are at most twice as many cells as links
    more = false;
    for (const int link : order) {
      const int before = cells.count_at(link);
      cosines[link] = -cosines[link];
      if (cells.count_at(link) > before) {
        more = true;
      } else {
        cosines[link] = -cosines[link];
      }
    }
  }
}

}  // namespace limber::rods::detail
