#include "engine/base/numerics/fill_ordering.h"

#include <cholmod.h>

#include <algorithm>

#include "engine/base/error.h"
#include "engine/base/numerics/metis_lock.h"

namespace limber {
namespace {

// Parts of this many nodes are not dissected further.
constexpr double kSmallestPart = 12;

struct Common {
  Common() {
    cholmod_start(&value);
    value.print = 0;
    value.current = 0;
    value.method[0].nd_small = kSmallestPart;
    value.method[0].nd_components = 1;
  }
  ~Common() { cholmod_finish(&value); }
  Common(const Common&) = delete;
  Common& operator=(const Common&) = delete;
  cholmod_common value{};
};

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
  std::vector<int> starts = {0};
  std::vector<int> rows;
  for (std::vector<int>& column : below) {
    std::sort(column.begin(), column.end());
    rows.insert(rows.end(), column.begin(), std::unique(column.begin(), column.end()));
    starts.push_back(static_cast<int>(rows.size()));
  }
  cholmod_sparse graph{};
  graph.nrow = graph.ncol = static_cast<std::size_t>(nodes);
  graph.nzmax = rows.size();
  graph.p = starts.data();
  graph.i = rows.data();
  graph.stype = -1;
  graph.itype = CHOLMOD_INT;
  graph.xtype = CHOLMOD_PATTERN;
  graph.sorted = 1;
  graph.packed = 1;

  std::vector<int> order(static_cast<std::size_t>(nodes));
  if (nodes == 0) return order;
  Common common;
  int done = 0;
  if (method == FillOrdering::kMinimumDegree) {
    done = cholmod_amd(&graph, nullptr, 0, order.data(), &common.value);
  } else {
    std::vector<int> parents(order.size()), parts(order.size());
    const std::lock_guard lock(detail::metis_mutex());
    done = cholmod_nested_dissection(&graph, nullptr, 0, order.data(), parents.data(), parts.data(),
                                     &common.value) >= 0
               ? 1
               : 0;
  }
  if (done == 0) throw Error(ErrorCode::kLimitExceeded, "", "not enough memory to order the graph");
  return order;
}

}  // namespace limber
