#include "engine/base/numerics/multifrontal_cholesky.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/numerics/front_tree.h"

namespace limber::detail {
namespace {

using Map = Eigen::Map<Eigen::MatrixXd>;
using ConstMap = Eigen::Map<const Eigen::MatrixXd>;
using Eigen::Index;

constexpr std::size_t kNoTarget = std::numeric_limits<std::size_t>::max();
// Columns eliminated one by one before the dense kernels take over.
constexpr Index kPanelColumns = 32;

/// Rows of A with the same neighbours (coordinates of one node, mostly) as one node of a graph:
/// ordering that takes a fraction of the time.
struct CompressedGraph {
  std::vector<std::vector<int>> members;  // of each node: rows of A, ascending
  std::vector<std::pair<int, int>> edges;
};

CompressedGraph compress(const MultifrontalCholesky::Matrix& a) {
  const Index n = a.cols();
  std::vector<std::vector<int>> neighbours(static_cast<std::size_t>(n));  // itself included
  for (int column = 0; column < n; ++column) {
    neighbours[static_cast<std::size_t>(column)].push_back(column);
    for (MultifrontalCholesky::Matrix::InnerIterator entry(a, column); entry; ++entry) {
      const int row = static_cast<int>(entry.row());
      if (row <= column) continue;
      neighbours[static_cast<std::size_t>(column)].push_back(row);
      neighbours[static_cast<std::size_t>(row)].push_back(column);
    }
  }
  CompressedGraph graph;
  std::vector<int> node_of(static_cast<std::size_t>(n));
  std::map<std::vector<int>, int> known;
  for (std::size_t row = 0; row < neighbours.size(); ++row) {
    std::sort(neighbours[row].begin(), neighbours[row].end());
    const auto [place, is_new] =
        known.try_emplace(neighbours[row], static_cast<int>(graph.members.size()));
    if (is_new) graph.members.emplace_back();
    node_of[row] = place->second;
    graph.members[static_cast<std::size_t>(place->second)].push_back(static_cast<int>(row));
  }
  for (const auto& [pattern, node] : known) {
    int last = -1;
    for (const int row : pattern) {
      const int other = node_of[static_cast<std::size_t>(row)];
      if (other > node && other != last) graph.edges.emplace_back(node, other);
      last = other;
    }
  }
  std::sort(graph.edges.begin(), graph.edges.end());
  graph.edges.erase(std::unique(graph.edges.begin(), graph.edges.end()), graph.edges.end());
  return graph;
}

}  // namespace

void MultifrontalCholesky::analyse(const Matrix& a) {
  const CompressedGraph graph = compress(a);
  const FrontTree tree = cheapest_front_tree(static_cast<int>(graph.members.size()), graph.edges);
  order_.clear();
  fronts_.clear();
  std::vector<int> first(graph.members.size());  // place of a node's first row in the order
  for (const auto& planned : tree.fronts) {
    for (const int node : planned.columns) {
      first[static_cast<std::size_t>(node)] = static_cast<int>(order_.size());
      const std::vector<int>& members = graph.members[static_cast<std::size_t>(node)];
      order_.insert(order_.end(), members.begin(), members.end());
    }
  }
  std::size_t panel = 0;
  for (const auto& planned : tree.fronts) {
    Front front;
    front.first = first[static_cast<std::size_t>(planned.columns.front())];
    for (const int node : planned.columns)
      front.columns += static_cast<int>(graph.members[static_cast<std::size_t>(node)].size());
    for (const int node : planned.rows) {
      const std::size_t count = graph.members[static_cast<std::size_t>(node)].size();
      for (std::size_t k = 0; k < count; ++k)
        front.rows.push_back(first[static_cast<std::size_t>(node)] + static_cast<int>(k));
    }
    front.children = planned.children;
    front.panel = panel;
    panel += static_cast<std::size_t>(front.height() * front.columns);
    fronts_.push_back(std::move(front));
  }
  for (const Front& parent : fronts_) {
    for (const int c : parent.children) {
      Front& child = fronts_[static_cast<std::size_t>(c)];
      for (const int row : child.rows) {
        const bool is_column = row < parent.first + parent.columns;
        child.places.push_back(
            is_column ? row - parent.first
                      : parent.columns + static_cast<int>(std::lower_bound(parent.rows.begin(),
                                                                           parent.rows.end(), row) -
                                                          parent.rows.begin()));
      }
    }
  }
  panels_.assign(panel, 0.0);
  lay_out_remainders();
  place_values(a);
}

void MultifrontalCholesky::lay_out_remainders() {
  // Children come right before their parents, so their remainders are on top of the stack.
  std::size_t top = 0, highest = 0;
  for (Front& front : fronts_) {
    std::size_t base = top;
    for (const int child : front.children)
      base = std::min(base, fronts_[static_cast<std::size_t>(child)].remainder);
    front.work = top;
    front.remainder = base;
    const std::size_t entries = front.rows.size() * front.rows.size();
    highest = std::max(highest, top + entries);
    top = base + entries;
  }
  remainders_.assign(highest, 0.0);
}

void MultifrontalCholesky::place_values(const Matrix& a) {
  std::vector<int> place(order_.size());
  for (std::size_t k = 0; k < order_.size(); ++k)
    place[static_cast<std::size_t>(order_[k])] = static_cast<int>(k);
  std::vector<int> front_of(order_.size());
  for (std::size_t f = 0; f < fronts_.size(); ++f)
    std::fill_n(front_of.begin() + fronts_[f].first, fronts_[f].columns, static_cast<int>(f));
  targets_.assign(static_cast<std::size_t>(a.nonZeros()), kNoTarget);
  std::size_t k = 0;
  for (int column = 0; column < a.cols(); ++column) {
    for (Matrix::InnerIterator entry(a, column); entry; ++entry, ++k) {
      if (entry.row() < column) continue;
      const auto [early, late] =
          std::minmax(place[static_cast<std::size_t>(column)],
                      place[static_cast<std::size_t>(static_cast<int>(entry.row()))]);
      const Front& front =
          fronts_[static_cast<std::size_t>(front_of[static_cast<std::size_t>(early)])];
      Index row = late - front.first;
      if (row >= front.columns) {
        const auto found = std::lower_bound(front.rows.begin(), front.rows.end(), late);
        LIMBER_DEMAND(found != front.rows.end() && *found == late);
        row = front.columns + (found - front.rows.begin());
      }
      targets_[k] =
          front.panel + static_cast<std::size_t>((early - front.first) * front.height() + row);
    }
  }
}

std::optional<FailedPivot> MultifrontalCholesky::factor(const Matrix& a) {
  LIMBER_DEMAND(static_cast<std::size_t>(a.nonZeros()) == targets_.size());
  std::fill(panels_.begin(), panels_.end(), 0.0);
  const double* const values = a.valuePtr();
  for (std::size_t k = 0; k < targets_.size(); ++k) {
    if (targets_[k] != kNoTarget) panels_[targets_[k]] += values[k];
  }
  diagonal_.resize(size());
  for (const Front& front : fronts_) {
    for (Index k = 0; k < front.columns; ++k)
      diagonal_[front.first + k] =
          panels_[front.panel + static_cast<std::size_t>(k * (front.height() + 1))];
  }
  for (const Front& front : fronts_) {
    std::fill_n(remainders_.begin() + static_cast<std::ptrdiff_t>(front.work),
                front.rows.size() * front.rows.size(), 0.0);
    for (const int child : front.children)
      add_child(fronts_[static_cast<std::size_t>(child)], front);
    if (const auto failed = eliminate(front)) return failed;
    if (front.work != front.remainder) {
      const auto from = remainders_.begin() + static_cast<std::ptrdiff_t>(front.work);
      std::copy_n(from, front.rows.size() * front.rows.size(),
                  remainders_.begin() + static_cast<std::ptrdiff_t>(front.remainder));
    }
  }
  return std::nullopt;
}

void MultifrontalCholesky::add_child(const Front& child, const Front& front) {
  const Index rows = static_cast<Index>(child.rows.size());
  const Index own = static_cast<Index>(front.rows.size());
  for (Index c = 0; c < rows; ++c) {
    const double* const from = remainders_.data() + child.remainder + c * rows;
    const Index column = child.places[static_cast<std::size_t>(c)];
    // Position of the front's row 0: the remainder starts below the columns.
    double* const to = column < front.columns
                           ? panels_.data() + front.panel + column * front.height()
                           : remainders_.data() + front.work + (column - front.columns) * own;
    const Index shift = column < front.columns ? 0 : front.columns;
    for (Index r = c; r < rows; ++r)
      to[child.places[static_cast<std::size_t>(r)] - shift] += from[r];
  }
}

std::optional<FailedPivot> MultifrontalCholesky::eliminate(const Front& front) {
  const Index rows = static_cast<Index>(front.rows.size());
  Map panel(panels_.data() + front.panel, front.height(), front.columns);
  for (Index begin = 0; begin < front.columns; begin += kPanelColumns) {
    const Index count = std::min(kPanelColumns, front.columns - begin);
    auto block = panel.block(begin, begin, count, count);
    for (Index k = 0; k < count; ++k) {
      const double pivot = block(k, k) - block.row(k).head(k).squaredNorm();
      const Index place = front.first + begin + k;
      if (!(pivot > kRelativePivot * diagonal_[place]))
        return FailedPivot{order_[static_cast<std::size_t>(place)], pivot};
      block(k, k) = std::sqrt(pivot);
      const Index below = count - k - 1;
      if (below == 0) continue;
      auto column = block.col(k).tail(below);
      if (k > 0)
        column.noalias() -= block.bottomLeftCorner(below, k) * block.row(k).head(k).transpose();
      column /= block(k, k);
    }
    const Index below = front.height() - begin - count;
    const Index ahead = front.columns - begin - count;
    if (below == 0) continue;
    auto under = panel.block(begin + count, begin, below, count);
    block.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(under);
    if (ahead == 0) continue;
    // Entries above the diagonal are never read.
    panel.block(begin + count, begin + count, below, ahead).noalias() -=
        under * under.topRows(ahead).transpose();
  }
  if (rows > 0) {
    Map remainder(remainders_.data() + front.work, rows, rows);
    remainder.selfadjointView<Eigen::Lower>().rankUpdate(panel.bottomRows(rows), -1.0);
  }
  return std::nullopt;
}

void MultifrontalCholesky::solve_in_place(double* b, Index columns, Index stride,
                                          Workspace& workspace) const {
  Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>> given(b, size(), columns,
                                                             Eigen::OuterStride<>(stride));
  Eigen::MatrixXd& x = workspace.permuted;
  x.resize(size(), columns);
  for (Index k = 0; k < size(); ++k) x.row(k) = given.row(order_[static_cast<std::size_t>(k)]);
  Eigen::MatrixXd& below = workspace.rows;
  for (const Front& front : fronts_) {
    const ConstMap panel(panels_.data() + front.panel, front.height(), front.columns);
    auto own = x.middleRows(front.first, front.columns);
    panel.topRows(front.columns).triangularView<Eigen::Lower>().solveInPlace(own);
    const Index rows = static_cast<Index>(front.rows.size());
    if (rows == 0) continue;
    below.resize(rows, columns);
    below.noalias() = panel.bottomRows(rows) * own;
    for (Index r = 0; r < rows; ++r) x.row(front.rows[static_cast<std::size_t>(r)]) -= below.row(r);
  }
  for (auto front = fronts_.rbegin(); front != fronts_.rend(); ++front) {
    const ConstMap panel(panels_.data() + front->panel, front->height(), front->columns);
    auto own = x.middleRows(front->first, front->columns);
    const Index rows = static_cast<Index>(front->rows.size());
    if (rows > 0) {
      below.resize(rows, columns);
      for (Index r = 0; r < rows; ++r)
        below.row(r) = x.row(front->rows[static_cast<std::size_t>(r)]);
      own.noalias() -= panel.bottomRows(rows).transpose() * below;
    }
    panel.topRows(front->columns).triangularView<Eigen::Lower>().transpose().solveInPlace(own);
  }
  for (Index k = 0; k < size(); ++k) given.row(order_[static_cast<std::size_t>(k)]) = x.row(k);
}

}  // namespace limber::detail
