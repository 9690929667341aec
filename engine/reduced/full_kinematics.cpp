#include "engine/reduced/full_kinematics.h"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/reduced/base_coordinates.h"
#include "engine/reduced/kinematics_kernels.h"
#include "engine/reduced/rs_kernel.h"
#include "engine/reduced/site_list.h"

namespace limber::reduced {
namespace {

using Vec = rotations::Pack<double>;
namespace stdx = rotations::stdx;
constexpr int kWidth = static_cast<int>(Vec::size());

/// Queries of one frame that a pass over the tets takes along: bounds the node forces it keeps.
constexpr int kQueriesAtOnce = 8;

/// Tets between two looks at whether anybody still wants the result.
constexpr int kTetsUnheeded = 256;

Vec load(const double* from) { return Vec(from, stdx::element_aligned); }

int whole_registers(int count) { return (count + kWidth - 1) / kWidth * kWidth; }

double sum_of_lanes(const Vec& value) {
  double sum = 0;
  for (int lane = 0; lane < kWidth; ++lane) sum += value[lane];
  return sum;
}

/// The tets component by component, padded with tets of no size at node 0.
struct TetLanes {
  int count = 0, padded = 0;
  std::vector<int> corners;    // 3 * node of corner a at a * padded + t
  std::vector<double> shapes;  // component j of the gradient of corner a (1..3): row 3 (a - 1) + j

  explicit TetLanes(const bodies::GradientOperator& gradient)
      : count(gradient.tet_count()),
        padded(whole_registers(count)),
        corners(static_cast<std::size_t>(4 * padded), 0),
        shapes(static_cast<std::size_t>(9 * padded), 0.0) {
    for (int t = 0; t < count; ++t) {
      for (int a = 0; a < 4; ++a) corners[a * padded + t] = 3 * gradient.tets()(a, t);
      const auto shape = gradient.shape_gradients(t);
      for (int a = 1; a < 4; ++a) {
        for (int j = 0; j < 3; ++j) shapes[(3 * (a - 1) + j) * padded + t] = shape(j, a);
      }
    }
  }

  void load_shapes(int t, Vec* shape) const {
    for (int c = 0; c < 9; ++c) shape[c] = load(shapes.data() + c * padded + t);
  }

  /// h[9], displacement gradients of kWidth tets from t on. @param v  3n
  void gradients(const double* v, int t, const Vec* shape, Vec* h) const {
    double edges[9][kWidth];  // 3 (a - 1) + axis
    for (int lane = 0; lane < kWidth; ++lane) {
      const double* origin = v + corners[t + lane];
      for (int a = 1; a < 4; ++a) {
        const double* end = v + corners[a * padded + t + lane];
        for (int i = 0; i < 3; ++i) edges[3 * (a - 1) + i][lane] = end[i] - origin[i];
      }
    }
    for (int i = 0; i < 3; ++i) {
      const Vec e1 = load(edges[i]), e2 = load(edges[3 + i]), e3 = load(edges[6 + i]);
      for (int j = 0; j < 3; ++j)
        h[3 * j + i] = e1 * shape[j] + e2 * shape[3 + j] + e3 * shape[6 + j];
    }
  }

  /// f += G^T (pulled), for kWidth tets from t on. @param f  3n
  void scatter(const Vec* pulled, int t, const Vec* shape, double* f) const {
    double forces[9][kWidth];
    for (int a = 0; a < 3; ++a) {
      for (int i = 0; i < 3; ++i) {
        const Vec force = pulled[i] * shape[3 * a] + pulled[3 + i] * shape[3 * a + 1] +
                          pulled[6 + i] * shape[3 * a + 2];
        force.copy_to(forces[3 * a + i], stdx::element_aligned);
      }
    }
    for (int lane = 0; lane < kWidth; ++lane) {
      double* origin = f + corners[t + lane];
      for (int a = 0; a < 3; ++a) {
        double* end = f + corners[(a + 1) * padded + t + lane];
        for (int i = 0; i < 3; ++i) {
          end[i] += forces[3 * a + i][lane];
          origin[i] -= forces[3 * a + i][lane];
        }
      }
    }
  }
};

/// h[9] of q[9] = d / d y: the adjoint of rs_of_gradient_entries.
template <class V>
[[gnu::always_inline]] inline void pull_to_gradient(const V* q, V* h) {
  const V half(0.5);
  h[0] = q[3];
  h[4] = q[4];
  h[8] = q[5];
  h[5] = half * (q[6] + q[0]);
  h[7] = half * (q[6] - q[0]);
  h[6] = half * (q[7] + q[1]);
  h[2] = half * (q[7] - q[1]);
  h[1] = half * (q[8] + q[2]);
  h[3] = half * (q[8] - q[2]);
}

/// g and what its derivatives need, of kWidth tets.
struct TetPose {
  Vec g[9], rotation[9], spin[3][9];

  TetPose(const Vec* y, bool derivatives) {
    const auto k = rs_gradient_entries(y, rotation, g);
    if (!derivatives) return;
    for (int e = 0; e < 9; e += 4) rotation[e] += 1.0;
    rs_rotation_column<0>(k, y, spin[0]);
    rs_rotation_column<1>(k, y, spin[1]);
    rs_rotation_column<2>(k, y, spin[2]);
  }

  /// q[9] = d (sum_j p_j g(axis, j)) / d y.
  void pull(const Vec* p, int axis, Vec* q) const {
    for (int c = 0; c < 3; ++c)
      q[c] = p[0] * spin[c][axis] + p[1] * spin[c][3 + axis] + p[2] * spin[c][6 + axis];
    // Entry (i, j) of the strain puts column i of the rotation into column j of g.
    const Vec &r0 = rotation[axis], &r1 = rotation[3 + axis], &r2 = rotation[6 + axis];
    q[3] = p[0] * r0;
    q[4] = p[1] * r1;
    q[5] = p[2] * r2;
    q[6] = p[2] * r1 + p[1] * r2;
    q[7] = p[2] * r0 + p[0] * r2;
    q[8] = p[1] * r0 + p[0] * r1;
  }
};

/// What a site needs.
struct FullSite {
  std::vector<double> row;  // p, 3 x padded, component by component
  bool moves = true;

  FullSite(const Eigen::Matrix3Xd& per_tet, int padded, bool free)
      : row(static_cast<std::size_t>(3 * padded), 0.0), moves(free) {
    for (Eigen::Index t = 0; t < per_tet.cols(); ++t) {
      for (int j = 0; j < 3; ++j) row[j * padded + t] = per_tet(j, t);
    }
  }
};

/// Scratch of a thread: no allocation once it has grown.
struct FullWorkspace {
  Eigen::VectorXd v;       // 3n
  Eigen::VectorXd base;    // 9 padded
  Eigen::MatrixXd forces;  // 3n x 3 kQueriesAtOnce
  Eigen::VectorXd y, p;    // 9 padded
  CurvatureWorkspace second;
  Eigen::MatrixXd pulled;  // padded modes x 3n
};

}  // namespace

class FullKinematics::Impl {
 public:
  Impl(const bodies::ElasticBody& body, std::shared_ptr<const ReducedModel> model,
       std::shared_ptr<const FullReconstruction> reconstruction, Eigen::MatrixXd base)
      : model_(std::move(model)),
        full_(std::move(reconstruction)),
        lanes_(full_->gradient()),
        list_(body.mesh.node_count()),
        is_fixed_(static_cast<std::size_t>(body.mesh.node_count()), false) {
    LIMBER_DEMAND(model_->node_count == body.mesh.node_count());
    LIMBER_DEMAND(full_->gradient().tet_count() == body.mesh.tet_count());
    for (const int node : body.fixed_nodes) is_fixed_[static_cast<std::size_t>(node)] = true;
    const Eigen::Index size = model_->coordinate_count();
    modes_by_node_.setZero(whole_registers(static_cast<int>(size)), model_->modes.rows());
    modes_by_node_.topRows(size) = model_->modes.transpose();
    mean_ = mean_of(model_->modes);
    if (base.size() == 0) return;
    base_mean_ = mean_of(base);
    lift_ = full_->lift(base, body.fixed_nodes);
    base_ = std::make_unique<BaseCoordinates>(body, full_->gradient(), std::move(base));
  }

  SiteId add_site(const Site& site) {
    heeded_.throw_if_cancelled();
    const SiteList::Added added = list_.add(site);
    if (!added.is_new) return added.id;
    const Site& own = list_.site(added.id);
    const bool moves = full_->mass_share().size() > 0 ||
                       std::any_of(own.nodes.begin(), own.nodes.end(),
                                   [&](int n) { return !is_fixed_[static_cast<std::size_t>(n)]; });
    sites_.emplace_back(full_->row_of(own), lanes_.padded, moves);
    return added.id;
  }

  [[nodiscard]] bool moves(SiteId site) const {
    list_.check(site);
    return sites_[static_cast<std::size_t>(site)].moves;
  }

  [[nodiscard]] const ReducedModel& model() const { return *model_; }

  void set_added(std::shared_ptr<const AddedPoses> added) { added_ = std::move(added); }

  void heed(Cancellation cancellation) { heeded_.cancellation = std::move(cancellation); }

  void evaluate(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
                std::span<const SiteQuery> queries, Eigen::Matrix3Xd& u,
                Eigen::MatrixXd* jacobian) const {
    check(frames, z, queries);
    const auto count = static_cast<Eigen::Index>(queries.size());
    u.resize(3, count);
    if (jacobian != nullptr) jacobian->resize(3 * count, model_->coordinate_count());
    const std::vector<Pass> passes = passes_of(z.cols(), queries);
    parallel_for(
        static_cast<std::int64_t>(passes.size()), 1, [&](std::int64_t begin, std::int64_t end) {
          thread_local FullWorkspace work;
          for (std::int64_t i = begin; i < end; ++i)
            run(passes[static_cast<std::size_t>(i)], frames, z, queries, work, u, jacobian);
        });
  }

  void curvature(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
                 std::span<const SiteQuery> queries,
                 const Eigen::Ref<const Eigen::Matrix3Xd>& multipliers,
                 Eigen::MatrixXd& out) const {
    check(frames, z, queries);
    const Eigen::Index size = model_->coordinate_count();
    out.setZero(size, size * z.cols());
    std::vector<int> columns;
    for (const SiteQuery& query : queries) columns.push_back(query.column);
    std::sort(columns.begin(), columns.end());
    columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
    parallel_for(static_cast<std::int64_t>(columns.size()), 1,
                 [&](std::int64_t begin, std::int64_t end) {
                   thread_local FullWorkspace work;
                   for (std::int64_t i = begin; i < end; ++i)
                     add_curvature(columns[static_cast<std::size_t>(i)], frames, z, queries,
                                   multipliers, work, out);
                 });
  }

 private:
  /// Queries of one column that share a pass over the tets.
  struct Pass {
    int column = 0;
    std::vector<Eigen::Index> queries;
  };

  /// Mass-weighted means of displacements (3n x k), 3 x k; empty for a held body.
  [[nodiscard]] Eigen::Matrix3Xd mean_of(const Eigen::MatrixXd& u) const {
    const Eigen::VectorXd& share = full_->mass_share();
    if (share.size() == 0) return {};
    Eigen::Matrix3Xd mean(3, u.cols());
    for (Eigen::Index k = 0; k < u.cols(); ++k)
      mean.col(k) = Eigen::Map<const Eigen::Matrix3Xd>(u.col(k).data(), 3, share.size()) * share;
    return mean;
  }

  void check(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
             std::span<const SiteQuery> queries) const {
    LIMBER_DEMAND(z.rows() == model_->coordinate_count());
    LIMBER_DEMAND((base_ == nullptr && added_ == nullptr) ||
                  static_cast<Eigen::Index>(frames.size()) == z.cols());
    list_.check(queries, z.cols());
    if (base_ == nullptr) return;
    for (const SiteQuery& query : queries) {
      const int frame = frames[static_cast<std::size_t>(query.column)];
      if (frame < 0 || frame >= base_->motion().cols()) {
        throw Error(ErrorCode::kOutOfRange, "frames",
                    fmt::format("frame {} is not in the base motion's [0, {})", frame,
                                base_->motion().cols()));
      }
    }
  }

  static std::vector<Pass> passes_of(Eigen::Index columns, std::span<const SiteQuery> queries) {
    std::vector<Pass> passes;
    std::vector<int> open(static_cast<std::size_t>(columns), -1);
    for (std::size_t i = 0; i < queries.size(); ++i) {
      int& pass = open[static_cast<std::size_t>(queries[i].column)];
      if (pass < 0 || passes[static_cast<std::size_t>(pass)].queries.size() == kQueriesAtOnce) {
        pass = static_cast<int>(passes.size());
        passes.push_back({queries[i].column, {}});
      }
      passes[static_cast<std::size_t>(pass)].queries.push_back(static_cast<Eigen::Index>(i));
    }
    return passes;
  }

  /// work.v <- W-hat z, work.base <- y of the base motion, of one column.
  void begin(int column, std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
             FullWorkspace& work) const {
    work.v.noalias() = model_->modes * z.col(column);
    work.base.resize(0);
    if (base_ == nullptr && added_ == nullptr) return;
    const int frame = frames[static_cast<std::size_t>(column)];
    const bool is_added = added_ != nullptr && added_->act_in(frame);
    if (base_ == nullptr && !is_added) return;
    thread_local Eigen::VectorXd y;
    if (base_ != nullptr) {
      const std::lock_guard lock(base_mutex_);
      y = base_->at(frame).cast<double>();
    } else {
      y.setZero(kRsSize * Eigen::Index{lanes_.count});
    }
    if (is_added) added_->add_to(frame, y);
    work.base.setZero(kRsSize * Eigen::Index{lanes_.padded});
    for (int t = 0; t < lanes_.count; ++t) {
      for (int c = 0; c < kRsSize; ++c) work.base[c * lanes_.padded + t] = y[kRsSize * t + c];
    }
  }

  void coordinates(const FullWorkspace& work, int t, const Vec* shape, Vec* y) const {
    Vec h[9];
    lanes_.gradients(work.v.data(), t, shape, h);
    rs_of_gradient_entries(h, y);
    if (work.base.size() == 0) return;
    for (int c = 0; c < kRsSize; ++c) y[c] += load(work.base.data() + c * lanes_.padded + t);
  }

  void run(const Pass& pass, std::span<const int> frames,
           const Eigen::Ref<const Eigen::MatrixXd>& z, std::span<const SiteQuery> queries,
           FullWorkspace& work, Eigen::Matrix3Xd& u, Eigen::MatrixXd* jacobian) const {
    begin(pass.column, frames, z, work);
    const auto count = static_cast<int>(pass.queries.size());
    const int padded = lanes_.padded;
    if (jacobian != nullptr) work.forces.setZero(model_->modes.rows(), 3 * count);
    const double* rows[kQueriesAtOnce];
    for (int q = 0; q < count; ++q) {
      const SiteId site = queries[static_cast<std::size_t>(pass.queries[q])].site;
      rows[q] = sites_[static_cast<std::size_t>(site)].row.data();
    }
    Vec sums[kQueriesAtOnce][3];
    for (auto& sum : sums) sum[0] = sum[1] = sum[2] = Vec(0.0);
    for (int t = 0; t < padded; t += kWidth) {
      if (t % kTetsUnheeded == 0) heeded_.throw_if_cancelled();
      Vec shape[9], y[9];
      lanes_.load_shapes(t, shape);
      coordinates(work, t, shape, y);
      const TetPose pose(y, jacobian != nullptr);
      for (int q = 0; q < count; ++q) {
        const Vec p[3] = {load(rows[q] + t), load(rows[q] + padded + t),
                          load(rows[q] + 2 * padded + t)};
        for (int i = 0; i < 3; ++i)
          sums[q][i] += pose.g[i] * p[0] + pose.g[3 + i] * p[1] + pose.g[6 + i] * p[2];
        if (jacobian == nullptr) continue;
        for (int i = 0; i < 3; ++i) {
          Vec pulled[9], gradient[9];
          pose.pull(p, i, pulled);
          pull_to_gradient(pulled, gradient);
          lanes_.scatter(gradient, t, shape, work.forces.col(3 * q + i).data());
        }
      }
    }
    for (int q = 0; q < count; ++q) {
      const Eigen::Index query = pass.queries[q];
      for (int i = 0; i < 3; ++i) u(i, query) = sum_of_lanes(sums[q][i]);
      if (lift_.size() > 0) {
        u.col(query) += mean_rows(lift_.col(frames[static_cast<std::size_t>(pass.column)]),
                                  list_.site(queries[static_cast<std::size_t>(query)].site));
      }
      if (added_ != nullptr) {
        u.col(query) += added_->beyond(frames[static_cast<std::size_t>(pass.column)],
                                       list_.site(queries[static_cast<std::size_t>(query)].site));
      }
      if (mean_.size() == 0) continue;
      u.col(query) += mean_ * z.col(pass.column);
      if (base_ != nullptr)
        u.col(query) += base_mean_.col(frames[static_cast<std::size_t>(pass.column)]);
    }
    if (jacobian == nullptr) return;
    const Eigen::MatrixXd rows_of_pass = work.forces.transpose() * model_->modes;
    for (int q = 0; q < count; ++q) {
      auto out = jacobian->middleRows<3>(3 * pass.queries[q]);
      out = rows_of_pass.middleRows<3>(3 * Eigen::Index{q});
      if (mean_.size() > 0) out += mean_;
    }
  }

  void add_curvature(int column, std::span<const int> frames,
                     const Eigen::Ref<const Eigen::MatrixXd>& z, std::span<const SiteQuery> queries,
                     const Eigen::Ref<const Eigen::Matrix3Xd>& multipliers, FullWorkspace& work,
                     Eigen::MatrixXd& out) const {
    begin(column, frames, z, work);
    const int padded = lanes_.padded;
    work.y.resize(kRsSize * Eigen::Index{padded});
    work.p.setZero(kRsSize * Eigen::Index{padded});
    for (int t = 0; t < padded; t += kWidth) {
      Vec shape[9], y[9];
      lanes_.load_shapes(t, shape);
      coordinates(work, t, shape, y);
      for (int c = 0; c < kRsSize; ++c)
        y[c].copy_to(work.y.data() + c * padded + t, stdx::element_aligned);
    }
    for (std::size_t i = 0; i < queries.size(); ++i) {
      if (queries[i].column != column) continue;
      const Eigen::Map<const Eigen::MatrixXd> row(
          sites_[static_cast<std::size_t>(queries[i].site)].row.data(), padded, 3);
      for (int j = 0; j < 3; ++j) {
        for (int axis = 0; axis < 3; ++axis) {
          work.p.segment(Eigen::Index{3 * j + axis} * padded, padded) +=
              multipliers(axis, static_cast<Eigen::Index>(i)) * row.col(j);
        }
      }
    }
    heeded_.throw_if_cancelled();
    work.second.add_tets(padded, work.y.data(), work.p.data());
    pull_second(work);
    heeded_.throw_if_cancelled();
    const Eigen::Index size = model_->coordinate_count();
    auto block = out.middleCols(size * column, size);
    block.triangularView<Eigen::Lower>() = work.pulled.topRows(size) * model_->modes;
    block.triangularView<Eigen::StrictlyUpper>() = block.transpose();
  }

  /// work.pulled <- G^T Q^T K Q G W-hat, transposed, K the second derivatives of the tets: one lane
  /// a mode.
  void pull_second(FullWorkspace& work) const {
    const int padded = lanes_.padded;
    const Eigen::Index modes = modes_by_node_.rows();
    work.pulled.setZero(modes, modes_by_node_.cols());
    for (int t = 0; t < lanes_.count; ++t) {
      if (t % kTetsUnheeded == 0) heeded_.throw_if_cancelled();
      double shape[9], second[27];
      for (int c = 0; c < 9; ++c) shape[c] = lanes_.shapes[c * padded + t];
      for (int c = 0; c < 27; ++c) second[c] = work.second.second[c * padded + t];
      Eigen::Index node[4];
      for (int a = 0; a < 4; ++a) node[a] = lanes_.corners[a * padded + t];
      for (Eigen::Index m = 0; m < modes; m += kWidth) {
        Vec h[9], y[9], q[9];
        for (int i = 0; i < 3; ++i) {
          const Vec origin = load(&modes_by_node_(m, node[0] + i));
          Vec edge[3];
          for (int a = 0; a < 3; ++a) edge[a] = load(&modes_by_node_(m, node[a + 1] + i)) - origin;
          for (int j = 0; j < 3; ++j)
            h[3 * j + i] = edge[0] * shape[j] + edge[1] * shape[3 + j] + edge[2] * shape[6 + j];
        }
        rs_of_gradient_entries(h, y);
        for (int c = 0; c < 9; ++c) q[c] = Vec(0.0);
        for (int axis = 0; axis < 3; ++axis) {
          for (int c = 0; c < 9; ++c) {
            const double entry = second[9 * axis + c];
            q[c] += entry * y[axis];
            if (c >= 3) q[axis] += entry * y[c];
          }
        }
        pull_to_gradient(q, h);
        for (int i = 0; i < 3; ++i) {
          Vec sum(0.0);
          for (int a = 0; a < 3; ++a) {
            const Vec force =
                h[i] * shape[3 * a] + h[3 + i] * shape[3 * a + 1] + h[6 + i] * shape[3 * a + 2];
            sum += force;
            double* to = &work.pulled(m, node[a + 1] + i);
            (load(to) + force).copy_to(to, stdx::element_aligned);
          }
          double* to = &work.pulled(m, node[0] + i);
          (load(to) - sum).copy_to(to, stdx::element_aligned);
        }
      }
    }
  }

  std::shared_ptr<const ReducedModel> model_;
  std::shared_ptr<const FullReconstruction> full_;
  TetLanes lanes_;
  SiteList list_;
  std::vector<bool> is_fixed_;
  Eigen::MatrixXd modes_by_node_;      // W-hat^T, padded with zero rows
  Eigen::Matrix3Xd mean_, base_mean_;  // of a free body
  std::vector<FullSite> sites_;
  mutable std::mutex base_mutex_;
  std::unique_ptr<BaseCoordinates> base_;    // null: no base motion
  Eigen::MatrixXd lift_;                     // of its pins, 3n x N; empty: they do not move
  std::shared_ptr<const AddedPoses> added_;  // null: none
  JobContext heeded_;
};

FullKinematics::FullKinematics(const bodies::ElasticBody& body,
                               std::shared_ptr<const ReducedModel> model,
                               std::shared_ptr<const FullReconstruction> reconstruction,
                               Eigen::MatrixXd base)
    : impl_(std::make_unique<Impl>(body, std::move(model), std::move(reconstruction),
                                   std::move(base))) {}
FullKinematics::~FullKinematics() = default;

SiteId FullKinematics::add_site(const Site& site) { return impl_->add_site(site); }

void FullKinematics::set_added(std::shared_ptr<const AddedPoses> added) {
  impl_->set_added(std::move(added));
}

void FullKinematics::heed(Cancellation cancellation) { impl_->heed(std::move(cancellation)); }

int FullKinematics::coordinate_count() const { return impl_->model().coordinate_count(); }

double FullKinematics::length() const { return impl_->model().length; }

bool FullKinematics::moves(SiteId site) const { return impl_->moves(site); }

void FullKinematics::evaluate(std::span<const int> frames,
                              const Eigen::Ref<const Eigen::MatrixXd>& z,
                              std::span<const SiteQuery> queries, Eigen::Matrix3Xd& u,
                              Eigen::MatrixXd* jacobian) const {
  impl_->evaluate(frames, z, queries, u, jacobian);
}

void FullKinematics::curvature(std::span<const int> frames,
                               const Eigen::Ref<const Eigen::MatrixXd>& z,
                               std::span<const SiteQuery> queries,
                               const Eigen::Ref<const Eigen::Matrix3Xd>& multipliers,
                               Eigen::MatrixXd& out) const {
  impl_->curvature(frames, z, queries, multipliers, out);
}

}  // namespace limber::reduced
