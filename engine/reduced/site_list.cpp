#include "engine/reduced/site_list.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/base/error.h"

namespace limber::reduced {

SiteList::Added SiteList::add(std::vector<int> nodes) {
  if (nodes.empty())
    throw Error(ErrorCode::kInvalidArgument, "nodes", "a site needs at least one node");
  std::sort(nodes.begin(), nodes.end());
  for (const int node : nodes) {
    if (node < 0 || node >= node_count_) {
      throw Error(ErrorCode::kOutOfRange, "nodes",
                  fmt::format("node {} is not in [0, {})", node, node_count_));
    }
  }
  const auto [found, is_new] = ids_.emplace(nodes, static_cast<SiteId>(sites_.size()));
  if (is_new) sites_.push_back(std::move(nodes));
  return {found->second, is_new};
}

void SiteList::check(SiteId site) const {
  if (site < 0 || site >= static_cast<SiteId>(sites_.size())) {
    throw Error(ErrorCode::kOutOfRange, "queries",
                fmt::format("site {} is not in [0, {})", site, sites_.size()));
  }
}

void SiteList::check(std::span<const SiteQuery> queries, Eigen::Index columns) const {
  for (const SiteQuery& query : queries) {
    check(query.site);
    if (query.column < 0 || query.column >= columns) {
      throw Error(ErrorCode::kOutOfRange, "queries",
                  fmt::format("column {} is not in [0, {})", query.column, columns));
    }
  }
}

}  // namespace limber::reduced
