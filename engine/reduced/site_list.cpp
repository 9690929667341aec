#include "engine/reduced/site_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "engine/base/error.h"

namespace limber::reduced {

namespace {

/// Sums of weights that were divided by their sum differ from 1 by rounding.
constexpr double kSumTolerance = 1e-9;

void check_weights(const Site& site) {
  if (site.weights.empty()) return;
  if (site.weights.size() != site.nodes.size()) {
    throw Error(ErrorCode::kInvalidArgument, "weights",
                fmt::format("{} weights of {} nodes: give one for each, or none",
                            site.weights.size(), site.nodes.size()));
  }
  const double sum = std::accumulate(site.weights.begin(), site.weights.end(), 0.0);
  if (!(std::abs(sum - 1) <= kSumTolerance)) {  // as infinities and NaN do
    throw Error(ErrorCode::kInvalidArgument, "weights",
                fmt::format("the sum of the weights must be 1, is {}", sum));
  }
}

Site by_node(Site site) {
  if (site.weights.empty()) {
    std::sort(site.nodes.begin(), site.nodes.end());
    return site;
  }
  std::vector<std::pair<int, double>> pairs;
  for (std::size_t i = 0; i < site.nodes.size(); ++i)
    pairs.emplace_back(site.nodes[i], site.weights[i]);
  std::sort(pairs.begin(), pairs.end());
  for (std::size_t i = 0; i < pairs.size(); ++i)
    std::tie(site.nodes[i], site.weights[i]) = pairs[i];
  return site;
}

}  // namespace

SiteList::Added SiteList::add(Site site) {
  if (site.nodes.empty())
    throw Error(ErrorCode::kInvalidArgument, "nodes", "a site needs at least one node");
  check_weights(site);
  site = by_node(std::move(site));
  for (const int node : site.nodes) {
    if (node < 0 || node >= node_count_) {
      throw Error(ErrorCode::kOutOfRange, "nodes",
                  fmt::format("node {} is not in [0, {})", node, node_count_));
    }
  }
  const auto [found, is_new] =
      ids_.emplace(Key{site.nodes, site.weights}, static_cast<SiteId>(sites_.size()));
  if (is_new) sites_.push_back(std::move(site));
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
