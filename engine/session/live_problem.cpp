#include "engine/session/live_problem.h"

#include <algorithm>
#include <utility>

namespace limber::session {

LiveProblem::LiveProblem(std::shared_ptr<const reduced::ReducedModel> model,
                         std::shared_ptr<const reduced::BaseMotion> base, TargetFrame targets,
                         int frame_count, spacetime::SolverOptions options, SiteLimits limits)
    : model_(std::move(model)),
      base_(std::move(base)),
      targets_(std::move(targets)),
      frame_count_(frame_count),
      options_(options),
      limits_(limits) {}

void LiveProblem::start(const EditBatch& whole) {
  LIMBER_DEMAND(whole.ends && whole.dynamics && whole.moved.empty() && whole.removed.empty());
  solver_.reset();
  held_.clear();
  make_solver(map_dynamics(*whole.dynamics, model_->eigenvalues, model_->rigid_count,
                           model_->mechanism_count),
              {frame_count_, map_end(whole.ends->first), map_end(whole.ends->last)});
  for (const scene::Constraint& constraint : whole.set) set(constraint);
}

void LiveProblem::apply(const EditBatch& batch) {
  for (const std::uint64_t id : batch.removed) {
    if (held_.erase(id) > 0) solver_->remove(id);
  }
  for (const scene::Constraint& constraint : batch.set) set(constraint);
  for (const TargetChange& move : batch.moved) {
    solver_->move(move.id, targets_.displacement(move.target, held_.at(move.id).origin));
  }
  if (batch.ends) solver_->set_timeline(map_end(batch.ends->first), map_end(batch.ends->last));
  if (batch.dynamics)
    solver_->set_dynamics(map_dynamics(*batch.dynamics, model_->eigenvalues, model_->rigid_count,
                                       model_->mechanism_count));
  if (mostly_unused_sites()) shed_sites();
}

void LiveProblem::coordinates(const Eigen::MatrixXd& motion, Eigen::MatrixXf& q) const {
  kinematics_->coordinates(0, motion, q);
}

void LiveProblem::set(const scene::Constraint& constraint) {
  Held held;
  held.nodes = targets_.compact_nodes(constraint.nodes);
  held.origin = targets_.origin(constraint.kind, held.nodes);
  spacetime::PositionConstraint mapped;
  mapped.id = constraint.id;
  mapped.frame = constraint.frame;
  mapped.site = kinematics_->add_site(held.nodes);
  mapped.axes = constraint.axes;
  mapped.target = targets_.displacement(constraint.target, held.origin);
  mapped.weight = constraint.weight;  // infinity is kExact
  note_site(mapped.site, held.nodes.size());
  if (held_.contains(constraint.id)) {
    solver_->replace(mapped);
  } else {
    solver_->add(mapped);
  }
  held_[constraint.id] = std::move(held);
}

void LiveProblem::make_solver(const spacetime::ModeDynamics& dynamics,
                              const spacetime::Timeline& timeline) {
  kinematics_ = std::make_shared<reduced::ReducedKinematics>(model_, base_);
  site_count_ = 0;
  site_nodes_ = 0;
  solver_.emplace(kinematics_, dynamics, timeline, options_);
}

void LiveProblem::note_site(int site, std::size_t nodes) {
  if (site < site_count_) return;
  site_count_ = site + 1;
  site_nodes_ += nodes;
}

bool LiveProblem::mostly_unused_sites() const {
  if (site_count_ <= limits_.sites && site_nodes_ <= limits_.nodes) return false;
  std::size_t used = 0;
  for (const auto& [id, held] : held_) used += held.nodes.size();
  return held_.size() < static_cast<std::size_t>(limits_.sites) / 4 && used <= limits_.nodes / 4;
}

void LiveProblem::shed_sites() {
  std::vector<spacetime::PositionConstraint> constraints = solver_->constraints();
  make_solver(spacetime::ModeDynamics(solver_->dynamics()),
              spacetime::Timeline(solver_->timeline()));
  for (spacetime::PositionConstraint& constraint : constraints) {
    const std::vector<int>& nodes = held_.at(constraint.id).nodes;
    constraint.site = kinematics_->add_site(nodes);
    note_site(constraint.site, nodes.size());
    solver_->add(constraint);
  }
}

}  // namespace limber::session
