#pragma once

#include <map>
#include <span>
#include <vector>

#include "engine/reduced/kinematics.h"

namespace limber::reduced {

/// Sites of a body by their nodes: equal groups are one site.
class SiteList {
 public:
  explicit SiteList(int node_count) : node_count_(node_count) {}

  struct Added {
    SiteId id;
    bool is_new;
  };
  /// @throws Error{kInvalidArgument} for no nodes, Error{kOutOfRange} naming the node
  Added add(std::vector<int> nodes);
  [[nodiscard]] const std::vector<int>& nodes(SiteId site) const { return sites_[site]; }

  /// @throws Error{kOutOfRange}
  void check(SiteId site) const;
  /// Sites and columns of queries. @throws Error{kOutOfRange}
  void check(std::span<const SiteQuery> queries, Eigen::Index columns) const;

 private:
  int node_count_;
  std::vector<std::vector<int>> sites_;
  std::map<std::vector<int>, SiteId> ids_;
};

}  // namespace limber::reduced
