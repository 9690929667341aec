#pragma once

#include <Eigen/Core>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "engine/reduced/reduced_model.h"
#include "engine/session/edit_batch.h"
#include "engine/session/problem_mapping.h"
#include "engine/spacetime/solver.h"

namespace limber::session {

/// Sites are never forgotten by a model's kinematics. Past so many, and mostly unused, they are
/// made anew.
struct SiteLimits {
  int sites = 20000;
  std::size_t nodes = 16'000'000;  // that their groups name together
};

/// The warm solver of a session and the sites its constraints need. Driven by one thread.
class LiveProblem {
 public:
  LiveProblem(std::shared_ptr<const reduced::ReducedModel> model,
              std::shared_ptr<const reduced::BaseMotion> base, TargetFrame targets, int frame_count,
              spacetime::SolverOptions options, SiteLimits limits = {});

  /// A new, cold solver of what `whole` says.
  void start(const EditBatch& whole);
  /// Passes edits on; a mere move stays a mere move. If it throws, the solver and the document no
  /// longer agree: start().
  void apply(const EditBatch& batch);

  [[nodiscard]] bool started() const { return solver_.has_value(); }
  [[nodiscard]] spacetime::Solver& solver() { return *solver_; }
  [[nodiscard]] int site_count() const { return site_count_; }

  /// q of all frames at the solver's motion, h x N.
  void coordinates(const Eigen::MatrixXd& motion, Eigen::MatrixXf& q) const;

 private:
  struct Held {
    Eigen::Vector3d origin;  // taken off targets [scene units]
    std::vector<int> nodes;  // compact
  };

  void set(const scene::Constraint& constraint);
  void note_site(int site, std::size_t nodes);
  [[nodiscard]] bool mostly_unused_sites() const;
  void make_solver(const spacetime::ModeDynamics& dynamics, const spacetime::Timeline& timeline);
  void shed_sites();

  std::shared_ptr<const reduced::ReducedModel> model_;
  std::shared_ptr<const reduced::BaseMotion> base_;
  TargetFrame targets_;
  int frame_count_;
  spacetime::SolverOptions options_;
  std::shared_ptr<reduced::ReducedKinematics> kinematics_;
  SiteLimits limits_;
  int site_count_ = 0;
  std::size_t site_nodes_ = 0;
  std::map<std::uint64_t, Held> held_;
  std::optional<spacetime::Solver> solver_;
};

}  // namespace limber::session
