#include "engine/session/beams/job_mapping.h"

namespace limber::session {

beams::BeamModel model_of(const scene::BeamJobFiles& files) {
  const scene::BeamJob& job = files.job;
  beams::BeamModel model;
  model.sections.push_back(beams::make_section(
      beams::rectangle(job.section_width, job.section_height), {job.young, job.poisson, 0, 0}));
  for (Eigen::Index i = 0; i < files.mesh.vertices.cols(); ++i)
    model.nodes.push_back({files.mesh.vertices.col(i), files.mesh.normals.col(i)});
  for (const auto& [start, finish] : files.mesh.edges) {
    beams::BeamElement element;
    element.start = start;
    element.finish = finish;
    model.elements.push_back(element);
  }
  for (const auto& fixed : job.fixed) {
    beams::BeamSupport support;
    support.node = fixed.vertex;
    const auto& d = fixed.directions;
    const bool turns = d[3] || d[4] || d[5];
    support.fixed = {d[0], d[1], d[2], turns, turns, turns};
    model.supports.push_back(support);
  }
  for (const auto& force : job.forces)
    model.loads.push_back({force.vertex, force.force, force.moment});
  for (const auto& displacement : job.displacements) {
    beams::PrescribedMotion motion;
    motion.node = displacement.vertex;
    motion.translates = {true, true, true};
    motion.translation = displacement.displacement;
    model.motions.push_back(motion);
  }
  give_motions_precedence(model);
  if (job.initial_force.isZero(0) && job.initial_moment.isZero(0)) return model;
  const std::vector<char> used = used_nodes(model);
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i] != 0)
      model.temporary_loads.push_back({static_cast<int>(i), job.initial_force, job.initial_moment});
  }
  return model;
}

}  // namespace limber::session
