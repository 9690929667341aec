#pragma once

#include <map>
#include <span>
#include <utility>
#include <vector>

#include "engine/reduced/kinematics.h"
#include "engine/reduced/site.h"

namespace limber::reduced {

/// Sites of a body by their nodes and weights: equal ones are one site, in whatever order.
class SiteList {
 public:
  explicit SiteList(int node_count) : node_count_(node_count) {}

  struct Added {
    SiteId id;
    bool is_new;
  };
  /// @throws Error{kInvalidArgument} for no nodes, or weights that are not as many, not finite or
  /// whose sum is not 1 to 1e-9; Error{kOutOfRange} naming the node
  Added add(Site site);
  Added add(const std::vector<int>& nodes) { return add(Site{nodes, {}}); }
  /// Its nodes ascending.
  [[nodiscard]] const Site& site(SiteId site) const { return sites_[site]; }
  [[nodiscard]] const std::vector<int>& nodes(SiteId site) const { return sites_[site].nodes; }

  /// @throws Error{kOutOfRange}
  void check(SiteId site) const;
  /// Sites and columns of queries. @throws Error{kOutOfRange}
  void check(std::span<const SiteQuery> queries, Eigen::Index columns) const;

 private:
  using Key = std::pair<std::vector<int>, std::vector<double>>;  // nodes, weights

  int node_count_;
  std::vector<Site> sites_;
  std::map<Key, SiteId> ids_;
};

}  // namespace limber::reduced
