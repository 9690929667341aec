#include "engine/base/numerics/front_tree.h"

#include <algorithm>
#include <functional>
#include <iterator>
#include <numeric>

#include "engine/base/error.h"
#include "engine/base/numerics/fill_ordering.h"

namespace limber::detail {
namespace {

// Cost of a front in addition to its multiplications: starting it, and adding its remainder to the
// parent's. Unit: multiplications of 9 x 9 blocks (measured).
constexpr double kFrontOverhead = 6;
constexpr double kOverheadPerBlock = 0.35;

double total_cost(double columns, double rows) {
  return front_cost(columns, columns + rows) + kFrontOverhead + kOverheadPerBlock * rows * rows / 2;
}

/// Fronts of one column each, numbered by the order of elimination; rows are such numbers too.
std::vector<Front> single_columns(int nodes, const std::vector<std::pair<int, int>>& edges,
                                  const std::vector<int>& order) {
  std::vector<int> position(static_cast<std::size_t>(nodes));
  for (int k = 0; k < nodes; ++k) position[order[k]] = k;
  std::vector<Front> fronts(static_cast<std::size_t>(nodes));
  for (const auto& [a, b] : edges) {
    const auto [low, high] = std::minmax(position[a], position[b]);
    fronts[low].rows.push_back(high);
  }
  for (int k = 0; k < nodes; ++k) {
    Front& front = fronts[k];
    front.columns = {k};
    for (const int child : front.children)
      front.rows.insert(front.rows.end(), fronts[child].rows.begin() + 1, fronts[child].rows.end());
    std::sort(front.rows.begin(), front.rows.end());
    front.rows.erase(std::unique(front.rows.begin(), front.rows.end()), front.rows.end());
    if (front.rows.empty()) continue;
    front.parent = front.rows.front();
    fronts[front.parent].children.push_back(k);
  }
  return fronts;
}

void swallow_children(std::vector<Front>& fronts, std::vector<bool>& gone) {
  for (std::size_t p = 0; p < fronts.size(); ++p) {
    Front& parent = fronts[p];
    std::vector<int> children = parent.children;
    std::sort(children.begin(), children.end(), [&](int a, int b) {
      return std::pair(fronts[b].rows.size(), a) < std::pair(fronts[a].rows.size(), b);
    });
    for (const int c : children) {
      Front& child = fronts[c];
      const double columns = static_cast<double>(parent.columns.size());
      const double own = static_cast<double>(child.columns.size());
      const double rows = static_cast<double>(parent.rows.size());
      const double apart =
          total_cost(columns, rows) + total_cost(own, static_cast<double>(child.rows.size()));
      if (total_cost(columns + own, rows) > apart) continue;
      gone[c] = true;
      child.columns.insert(child.columns.end(), parent.columns.begin(), parent.columns.end());
      parent.columns = std::move(child.columns);
      std::erase(parent.children, c);
      for (const int grandchild : child.children) {
        fronts[grandchild].parent = static_cast<int>(p);
        parent.children.push_back(grandchild);
      }
    }
    std::sort(parent.children.begin(), parent.children.end());
  }
}

}  // namespace

double front_cost(double columns, double size) {
  // sum over k < columns of (size - k)^2 / 2
  const auto squares = [](double n) { return n * (n + 1) * (2 * n + 1) / 6; };
  return (squares(size) - squares(size - columns)) / 2;
}

FrontTree build_front_tree(int nodes, const std::vector<std::pair<int, int>>& edges,
                           const std::vector<int>& order) {
  std::vector<Front> fronts = single_columns(nodes, edges, order);
  std::vector<bool> gone(fronts.size(), false);
  swallow_children(fronts, gone);

  // Children right before their parents, so that their remainders are still in the cache.
  std::vector<int> sequence;
  const std::function<void(int)> visit = [&](int f) {
    for (const int child : fronts[f].children) visit(child);
    sequence.push_back(f);
  };
  for (std::size_t f = 0; f < fronts.size(); ++f) {
    if (!gone[f] && fronts[f].parent < 0) visit(static_cast<int>(f));
  }
  std::vector<int> number(fronts.size(), -1);
  std::vector<int> elimination(static_cast<std::size_t>(nodes));
  int next = 0;
  for (std::size_t k = 0; k < sequence.size(); ++k) {
    number[sequence[k]] = static_cast<int>(k);
    for (const int column : fronts[sequence[k]].columns) elimination[column] = next++;
  }
  LIMBER_DEMAND(next == nodes);

  FrontTree tree;
  for (const int f : sequence) {
    Front front = std::move(fronts[f]);
    tree.cost += total_cost(static_cast<double>(front.columns.size()),
                            static_cast<double>(front.rows.size()));
    std::sort(front.rows.begin(), front.rows.end(),
              [&](int a, int b) { return elimination[a] < elimination[b]; });
    for (int& child : front.children) child = number[child];
    front.parent = front.parent < 0 ? -1 : number[front.parent];
    tree.fronts.push_back(std::move(front));
  }
  std::vector<int> place(static_cast<std::size_t>(nodes), -1);
  for (const Front& parent : tree.fronts) {
    int position = 0;
    for (const int node : parent.columns) place[node] = position++;
    for (const int node : parent.rows) place[node] = position++;
    for (const int child : parent.children) {
      Front& front = tree.fronts[child];
      for (const int row : front.rows) front.places.push_back(place[row]);
      LIMBER_DEMAND(std::is_sorted(front.places.begin(), front.places.end()));
    }
  }
  for (Front& front : tree.fronts) {
    for (int& node : front.columns) node = order[node];
    for (int& node : front.rows) node = order[node];
  }
  return tree;
}

FrontTree cheapest_front_tree(int nodes, const std::vector<std::pair<int, int>>& edges) {
  FrontTree best;
  for (const FillOrdering method :
       {FillOrdering::kMinimumDegree, FillOrdering::kNestedDissection}) {
    FrontTree tree = build_front_tree(nodes, edges, fill_reducing_order(nodes, edges, method));
    if (best.fronts.empty() || tree.cost < best.cost) best = std::move(tree);
  }
  return best;
}

}  // namespace limber::detail
