#include "engine/base/numerics/front_plan.h"

#include <algorithm>
#include <map>

#include "engine/base/error.h"
#include "engine/base/numerics/dense_front.h"
#include "engine/base/numerics/front_tree.h"

namespace limber::detail {
namespace {

constexpr std::size_t kEntries = static_cast<std::size_t>(kBlock) * kBlock;
// A subtree with less than this share of the whole work is not split further.
constexpr double kTaskShare = 0.08;
// Multiplications of blocks below which one thread does it all: waking another takes longer.
constexpr double kWorthSharing = 1500;

void place_sources(const std::vector<std::pair<int, int>>& edges, int nodes, FrontPlan& plan) {
  std::vector<int> front_of(static_cast<std::size_t>(nodes));
  std::vector<int> column_of(front_of.size());
  for (std::size_t f = 0; f < plan.fronts.size(); ++f) {
    PlannedFront& front = plan.fronts[f];
    for (int c = 0; c < front.columns; ++c) {
      const int node = front.nodes[c];
      front_of[node] = static_cast<int>(f);
      column_of[node] = c;
      front.sources.push_back(
          {BlockSource::Kind::kDiagonal, static_cast<std::size_t>(node) * kEntries, c, c});
    }
  }
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto [a, b] = edges[e];
    const bool first_is_column =
        std::pair(front_of[a], column_of[a]) < std::pair(front_of[b], column_of[b]);
    const int column = first_is_column ? a : b;
    const int row = first_is_column ? b : a;
    PlannedFront& front = plan.fronts[front_of[column]];
    const auto place = std::find(front.nodes.begin(), front.nodes.end(), row);
    LIMBER_DEMAND(place != front.nodes.end());
    front.sources.push_back(
        {first_is_column ? BlockSource::Kind::kTransposedCoupling : BlockSource::Kind::kCoupling,
         e * kEntries, column_of[column], static_cast<int>(place - front.nodes.begin())});
  }
}

/// Subtrees of about equal work; all above them is the top.
void split_work(const FrontTree& tree, FrontPlan& plan) {
  std::vector<double> work(tree.fronts.size());
  double total = 0;
  for (std::size_t f = 0; f < work.size(); ++f) {
    const Front& front = tree.fronts[f];
    work[f] += front_cost(static_cast<double>(front.columns.size()), front.size()) + 1;
    if (front.parent >= 0) {
      work[front.parent] += work[f];
    } else {
      total += work[f];
    }
  }
  const double largest_task = total < kWorthSharing ? total : kTaskShare * total;
  std::vector<int> owner(work.size(), -1);  // the task a front belongs to, by its root
  std::vector<std::pair<double, int>> roots;
  for (std::size_t f = work.size(); f-- > 0;) {
    const Front& front = tree.fronts[f];
    const bool below_task = front.parent >= 0 && owner[front.parent] >= 0;
    if (below_task) {
      owner[f] = owner[front.parent];
    } else if (work[f] <= largest_task || front.children.empty()) {
      owner[f] = static_cast<int>(f);
      roots.emplace_back(-work[f], static_cast<int>(f));
    }
  }
  // The big ones first, so that the last to finish are small.
  std::sort(roots.begin(), roots.end());
  std::map<int, int> task_of;
  for (const auto& [negative_work, root] : roots)
    task_of.emplace(root, static_cast<int>(task_of.size()));
  plan.tasks.resize(roots.size());
  for (std::size_t f = 0; f < work.size(); ++f) {
    if (owner[f] < 0) {
      plan.top.push_back(static_cast<int>(f));
    } else {
      plan.tasks[task_of[owner[f]]].push_back(static_cast<int>(f));
    }
  }
}

/// Memory of remainders, reused within a list of fronts once their parent has taken them.
class RemainderMemory {
 public:
  std::size_t take(std::size_t entries) {
    std::size_t place = 0;
    for (const auto& [start, size] : taken_) {
      if (place + entries <= start) break;
      place = start + size;
    }
    if (entries > 0) taken_.emplace(place, entries);
    end_ = std::max(end_, place + entries);
    return place;
  }
  void release(std::size_t place) { taken_.erase(place); }
  [[nodiscard]] std::size_t end() const { return end_; }

 private:
  std::size_t end_ = 0;
  std::map<std::size_t, std::size_t> taken_;
};

std::size_t remainder_entries(const PlannedFront& front) {
  const int rows = kBlock * (front.size - front.columns);
  // Tiles reach three columns beyond the last.
  return rows == 0 ? 0 : static_cast<std::size_t>(front_stride(rows)) * (rows + 3);
}

/// Remainders of a list of fronts in order, given back when the parent has taken them.
void lay_out(const std::vector<int>& list, bool shared, RemainderMemory& memory, FrontPlan& plan) {
  for (const int f : list) {
    PlannedFront& front = plan.fronts[f];
    if (front.shares_remainder == shared) front.remainder = memory.take(remainder_entries(front));
    for (const int child : front.children) {
      if (plan.fronts[child].shares_remainder == shared)
        memory.release(plan.fronts[child].remainder);
    }
  }
}

void lay_out_memory(FrontPlan& plan) {
  for (PlannedFront& front : plan.fronts) {
    const std::size_t stride = front_stride(kBlock * front.size);
    const std::size_t columns = static_cast<std::size_t>(kBlock) * front.columns;
    front.panel = plan.panel_entries;
    plan.panel_entries += stride * columns;
    plan.widest_front = std::max(plan.widest_front, columns);
    plan.scratch_entries = std::max(plan.scratch_entries, stride * columns);
  }
  plan.panel_entries += 8;  // vectors reach beyond the last row
  plan.scratch_entries += plan.widest_front + 8;
  RemainderMemory shared;
  for (const std::vector<int>& task : plan.tasks) {
    PlannedFront& root = plan.fronts[task.back()];
    root.shares_remainder = true;
    root.remainder = shared.take(remainder_entries(root));
    RemainderMemory memory;
    lay_out(task, false, memory, plan);
    plan.task_entries = std::max(plan.task_entries, memory.end() + 8);
  }
  for (const int front : plan.top) plan.fronts[front].shares_remainder = true;
  lay_out(plan.top, true, shared, plan);
  plan.shared_entries = shared.end() + 8;
}

}  // namespace

FrontPlan plan_fronts(int nodes, const std::vector<std::pair<int, int>>& edges) {
  const FrontTree tree = cheapest_front_tree(nodes, edges);
  FrontPlan plan;
  for (const Front& front : tree.fronts) {
    PlannedFront planned;
    planned.columns = static_cast<int>(front.columns.size());
    planned.size = front.size();
    planned.nodes = front.columns;
    planned.nodes.insert(planned.nodes.end(), front.rows.begin(), front.rows.end());
    planned.children = front.children;
    planned.places = front.places;
    plan.fronts.push_back(std::move(planned));
  }
  place_sources(edges, nodes, plan);
  split_work(tree, plan);
  lay_out_memory(plan);
  return plan;
}

}  // namespace limber::detail
