#include "engine/base/numerics/block_ldlt.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "engine/base/error.h"
#include "engine/base/numerics/dense_front.h"
#include "engine/base/numerics/fill_ordering.h"
#include "engine/base/numerics/front_plan.h"
#include "engine/base/parallel.h"

namespace limber {
namespace {

using detail::BlockSource;
using detail::front_stride;
using detail::FrontPlan;
using detail::PlannedFront;
constexpr std::ptrdiff_t kB = BlockLdlt::kBlock;
constexpr std::size_t kEntriesWorthThreads = 50'000;

void add_block(const double* block, double* target, std::ptrdiff_t stride) {
  for (int c = 0; c < kB; ++c) {
    for (int r = 0; r < kB; ++r) target[c * stride + r] += block[c * kB + r];
  }
}

void add_transposed(const double* block, double* target, std::ptrdiff_t stride) {
  for (int c = 0; c < kB; ++c) {
    for (int r = 0; r < kB; ++r) target[c * stride + r] += block[r * kB + c];
  }
}

/// Adds kB columns of `rows` numbers.
void add_columns(const double* values, std::ptrdiff_t values_stride, std::ptrdiff_t rows,
                 double* target, std::ptrdiff_t stride) {
  for (int c = 0; c < kB; ++c) {
    const double* const from = values + c * values_stride;
    double* const to = target + c * stride;
    for (int r = 0; r < rows; ++r) to[r] += from[r];
  }
}

/// Zero from the diagonal block down: blocks above it are not read.
void clear_lower(double* values, std::ptrdiff_t stride, int columns) {
  for (int c = 0; c < columns; ++c) {
    const int first = c / kB * kB;
    std::fill_n(values + c * stride + first, stride - first, 0.0);
  }
}

}  // namespace

class BlockLdlt::Impl {
 public:
  Impl(int nodes, const std::vector<std::pair<int, int>>& edges)
      : nodes_(nodes),
        plan_(detail::plan_fronts(nodes, edges)),
        diagonals_(static_cast<std::size_t>(nodes) * kEntries, 0.0),
        couplings_(edges.size() * kEntries, 0.0),
        panels_(plan_.panel_entries, 0.0),
        shared_remainders_(plan_.shared_entries, 0.0),
        counts_(plan_.tasks.size()) {
    std::size_t values = 0;
    for (const PlannedFront& front : plan_.fronts) {
      value_begin_.push_back(values);
      values += static_cast<std::size_t>(front.size) * kB;
    }
    values_.resize(values);
    give_back(make_workspace());
    give_back(make_workspace());
  }

  PivotCount factor() {
    parallel_for(static_cast<std::int64_t>(plan_.tasks.size()), 1,
                 [&](std::int64_t begin, std::int64_t end) {
                   auto workspace = borrow();
                   for (std::int64_t task = begin; task < end; ++task) {
                     PivotCount count;
                     for (const int front : plan_.tasks[task])
                       count += factor_front(front, *workspace);
                     counts_[task] = count;
                   }
                   give_back(std::move(workspace));
                 });
    PivotCount total;
    for (const PivotCount& count : counts_) total += count;
    auto workspace = borrow();
    for (const int front : plan_.top) total += factor_front(front, *workspace);
    give_back(std::move(workspace));
    return total;
  }

  void solve(double* x) {
    for_tasks([&](const std::vector<int>& fronts) {
      for (const int front : fronts) forward(front, x);
    });
    for (const int front : plan_.top) forward(front, x);
    for (auto front = plan_.top.rbegin(); front != plan_.top.rend(); ++front) backward(*front, x);
    for_tasks([&](const std::vector<int>& fronts) {
      for (auto front = fronts.rbegin(); front != fronts.rend(); ++front) backward(*front, x);
    });
  }

  int nodes_;
  FrontPlan plan_;
  std::vector<double> diagonals_, couplings_;
  std::vector<double> panels_;

 private:
  /// Memory of one thread for one task at a time; used again by the next, while it is in the cache.
  struct Workspace {
    std::vector<double> remainders;
    std::vector<double> scratch;  // sizes of the diagonal, then L D
  };

  /// Substitutions are short: tasks go to threads only where there is much to read.
  template <class Work>
  void for_tasks(const Work& work) const {
    const auto count = static_cast<std::int64_t>(plan_.tasks.size());
    const std::int64_t grain = plan_.panel_entries < kEntriesWorthThreads ? count : 1;
    if (count == 0) return;
    parallel_for(count, grain, [&](std::int64_t begin, std::int64_t end) {
      for (std::int64_t task = begin; task < end; ++task) work(plan_.tasks[task]);
    });
  }

  std::unique_ptr<Workspace> make_workspace() const {
    return std::make_unique<Workspace>(Workspace{std::vector<double>(plan_.task_entries),
                                                 std::vector<double>(plan_.scratch_entries)});
  }
  std::unique_ptr<Workspace> borrow() {
    const std::lock_guard lock(pool_mutex_);
    if (pool_.empty()) return make_workspace();  // more threads than ever before
    auto workspace = std::move(pool_.back());
    pool_.pop_back();
    return workspace;
  }
  void give_back(std::unique_ptr<Workspace> workspace) {
    const std::lock_guard lock(pool_mutex_);
    pool_.push_back(std::move(workspace));
  }

  double* remainder_of(const PlannedFront& front, Workspace& workspace) {
    return (front.shares_remainder ? shared_remainders_ : workspace.remainders).data() +
           front.remainder;
  }

  PivotCount factor_front(int index, Workspace& workspace) {
    const PlannedFront& front = plan_.fronts[index];
    const int size = kBlock * front.size;
    const int columns = kBlock * front.columns;
    const int rows = size - columns;
    const std::ptrdiff_t stride = front_stride(size);
    const std::ptrdiff_t own_stride = front_stride(rows);
    double* const panel = panels_.data() + front.panel;
    double* const remainder = remainder_of(front, workspace);
    clear_lower(panel, stride, columns);
    clear_lower(remainder, own_stride, rows);
    add_values(front, panel, stride);
    double* const scales = workspace.scratch.data();
    for (int c = 0; c < columns; ++c) scales[c] = std::abs(panel[c * stride + c]);
    for (const int child : front.children)
      add_remainder(plan_.fronts[child], remainder_of(plan_.fronts[child], workspace), front, panel,
                    remainder);
    double* const products = scales + plan_.widest_front;
    const PivotCount count = detail::eliminate_columns(panel, products, scales, size, columns);
    if (rows > 0) detail::update_remainder(panel, products, size, columns, remainder);
    return count;
  }

  void add_values(const PlannedFront& front, double* panel, std::ptrdiff_t stride) const {
    for (const BlockSource& source : front.sources) {
      double* const target = panel + source.column * kB * stride + source.row * kB;
      switch (source.kind) {
        case BlockSource::Kind::kDiagonal:
          add_block(diagonals_.data() + source.offset, target, stride);
          break;
        case BlockSource::Kind::kCoupling:
          add_block(couplings_.data() + source.offset, target, stride);
          break;
        case BlockSource::Kind::kTransposedCoupling:
          add_transposed(couplings_.data() + source.offset, target, stride);
          break;
      }
    }
  }

  static void add_remainder(const PlannedFront& child, const double* values,
                            const PlannedFront& front, double* panel, double* remainder) {
    const std::ptrdiff_t stride = front_stride(kBlock * front.size);
    const std::ptrdiff_t own_stride = front_stride(kBlock * (front.size - front.columns));
    const int rows = child.size - child.columns;
    const std::ptrdiff_t child_stride = front_stride(kBlock * rows);
    for (int c = 0; c < rows; ++c) {
      const int column = child.places[c];
      const bool in_panel = column < front.columns;
      double* const target = in_panel ? panel + column * kB * stride
                                      : remainder + (column - front.columns) * kB * own_stride;
      const std::ptrdiff_t target_stride = in_panel ? stride : own_stride;
      const int first_row = in_panel ? 0 : front.columns;
      for (int r = c; r < rows;) {
        int last = r + 1;  // rows that stay neighbours in the parent go together
        while (last < rows && child.places[last] == child.places[last - 1] + 1) ++last;
        add_columns(values + c * kB * child_stride + r * kB, child_stride, (last - r) * kB,
                    target + (child.places[r] - first_row) * kB, target_stride);
        r = last;
      }
    }
  }

  /// Values of a front's nodes, columns first.
  double* values_of(int front) { return values_.data() + value_begin_[front]; }

  void forward(int index, const double* x) {
    const PlannedFront& front = plan_.fronts[index];
    double* const values = values_of(index);
    for (int k = 0; k < front.columns; ++k)
      std::copy_n(x + front.nodes[k] * kB, kB, values + k * kB);
    std::fill_n(values + kB * front.columns, kB * (front.size - front.columns), 0.0);
    for (const int child : front.children) {
      const PlannedFront& below = plan_.fronts[child];
      const double* const left = values_of(child) + kB * below.columns;
      for (int k = 0; k < below.size - below.columns; ++k) {
        double* const target = values + below.places[k] * kB;
        for (int i = 0; i < kB; ++i) target[i] += left[k * kB + i];
      }
    }
    detail::substitute_forward(panels_.data() + front.panel, kB * front.size, kB * front.columns,
                               values);
  }

  void backward(int index, double* x) {
    const PlannedFront& front = plan_.fronts[index];
    double* const values = values_of(index);
    for (int k = front.columns; k < front.size; ++k)
      std::copy_n(x + front.nodes[k] * kB, kB, values + k * kB);
    detail::substitute_backward(panels_.data() + front.panel, kB * front.size, kB * front.columns,
                                values);
    for (int k = 0; k < front.columns; ++k)
      std::copy_n(values + k * kB, kB, x + front.nodes[k] * kB);
  }

  std::vector<double> shared_remainders_;
  std::mutex pool_mutex_;
  std::vector<std::unique_ptr<Workspace>> pool_;
  std::vector<PivotCount> counts_;
  std::vector<std::size_t> value_begin_;  // of each front, in values_
  std::vector<double> values_;            // of a solve
};

BlockLdlt::BlockLdlt(int nodes, const std::vector<std::pair<int, int>>& edges)
    : impl_(std::make_unique<Impl>(nodes, edges)) {}
BlockLdlt::~BlockLdlt() = default;
BlockLdlt::BlockLdlt(BlockLdlt&&) noexcept = default;
BlockLdlt& BlockLdlt::operator=(BlockLdlt&&) noexcept = default;

int BlockLdlt::nodes() const noexcept { return impl_->nodes_; }
std::size_t BlockLdlt::factor_entries() const noexcept { return impl_->panels_.size(); }
double* BlockLdlt::diagonal(int node) noexcept {
  return impl_->diagonals_.data() + static_cast<std::ptrdiff_t>(node) * kEntries;
}
double* BlockLdlt::coupling(int edge) noexcept {
  return impl_->couplings_.data() + static_cast<std::ptrdiff_t>(edge) * kEntries;
}
PivotCount BlockLdlt::factor() { return impl_->factor(); }
void BlockLdlt::solve_in_place(double* x) { impl_->solve(x); }

}  // namespace limber
