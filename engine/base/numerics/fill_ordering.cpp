#include "engine/base/numerics/fill_ordering.h"

#ifdef LIMBER_SUPERNODAL
#include <cholmod.h>
#else
#include <amd.h>
#include <metis.h>
#endif

#include <algorithm>
#include <numeric>

#include "engine/base/error.h"
#include "engine/base/numerics/metis_lock.h"

namespace limber {
namespace {

/// Neighbours below each node, ascending: column k has rows[starts[k]] up to rows[starts[k + 1]].
struct LowerGraph {
  std::vector<int> starts = {0};
  std::vector<int> rows;
};

#ifdef LIMBER_SUPERNODAL

// Parts of this many nodes are not dissected further.
constexpr double kSmallestPart = 12;

struct OrderingCommon {
  OrderingCommon() {
    cholmod_start(&value);
    value.print = 0;
    value.current = 0;
    value.method[0].nd_small = kSmallestPart;
    value.method[0].nd_components = 1;
  }
  ~OrderingCommon() { cholmod_finish(&value); }
  OrderingCommon(const OrderingCommon&) = delete;
  OrderingCommon& operator=(const OrderingCommon&) = delete;
  cholmod_common value{};
};

/// @returns whether memory sufficed
bool find_order(LowerGraph& lower, FillOrdering method, std::vector<int>& order) {
  cholmod_sparse graph{};
  graph.nrow = graph.ncol = order.size();
  graph.nzmax = lower.rows.size();
  graph.p = lower.starts.data();
  graph.i = lower.rows.data();
  graph.stype = -1;
  graph.itype = CHOLMOD_INT;
  graph.xtype = CHOLMOD_PATTERN;
  graph.sorted = 1;
  graph.packed = 1;
  OrderingCommon common;
  if (method == FillOrdering::kMinimumDegree)
    return cholmod_amd(&graph, nullptr, 0, order.data(), &common.value) != 0;
  std::vector<int> parents(order.size()), parts(order.size());
  const std::lock_guard lock(detail::metis_mutex());
  return cholmod_nested_dissection(&graph, nullptr, 0, order.data(), parents.data(), parts.data(),
                                   &common.value) >= 0;
}

#else

/// The same of AMD and METIS themselves: METIS ends its dissection by minimum degree of its own.
/// @returns whether memory sufficed
bool find_order(LowerGraph& lower, FillOrdering method, std::vector<int>& order) {
  const auto nodes = order.size();
  if (method == FillOrdering::kMinimumDegree) {
    // AMD takes either half.
    return amd_order(static_cast<int>(nodes), lower.starts.data(), lower.rows.data(), order.data(),
                     nullptr, nullptr) >= AMD_OK;
  }
  static_assert(sizeof(idx_t) == sizeof(int));
  std::vector<std::vector<int>> neighbours(nodes);
  for (std::size_t k = 0; k < nodes; ++k) {
    for (int e = lower.starts[k]; e < lower.starts[k + 1]; ++e) {
      const int row = lower.rows[static_cast<std::size_t>(e)];
      neighbours[k].push_back(row);
      neighbours[static_cast<std::size_t>(row)].push_back(static_cast<int>(k));
    }
  }
  std::vector<idx_t> starts = {0}, both, places(nodes);
  for (const std::vector<int>& of_node : neighbours) {
    both.insert(both.end(), of_node.begin(), of_node.end());
    starts.push_back(static_cast<idx_t>(both.size()));
  }
  both.push_back(0);  // not empty, for METIS
  idx_t count = static_cast<idx_t>(nodes);
  const std::lock_guard lock(detail::metis_mutex());
  return METIS_NodeND(&count, starts.data(), both.data(), nullptr, nullptr, order.data(),
                      places.data()) == METIS_OK;
}

#endif

}  // namespace

std::mutex& detail::metis_mutex() {
  static std::mutex mutex;
  return mutex;
}

std::vector<int> fill_reducing_order(int nodes, const std::vector<std::pair<int, int>>& edges,
                                     FillOrdering method) {
  std::vector<std::vector<int>> below(static_cast<std::size_t>(nodes));
  for (const auto& [a, b] : edges) {
    LIMBER_DEMAND(a != b && std::min(a, b) >= 0 && std::max(a, b) < nodes);
    below[std::min(a, b)].push_back(std::max(a, b));
  }
  LowerGraph lower;
  for (std::vector<int>& column : below) {
    std::sort(column.begin(), column.end());
    lower.rows.insert(lower.rows.end(), column.begin(), std::unique(column.begin(), column.end()));
    lower.starts.push_back(static_cast<int>(lower.rows.size()));
  }
  std::vector<int> order(static_cast<std::size_t>(nodes));
  if (lower.rows.empty()) {  // AMD takes no pattern without entries
    std::iota(order.begin(), order.end(), 0);
    return order;
  }
  if (!find_order(lower, method, order))
    throw Error(ErrorCode::kLimitExceeded, "", "not enough memory to order the graph");
  return order;
}

}  // namespace limber
