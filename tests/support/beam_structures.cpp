#include "tests/support/beam_structures.h"

#include "engine/session/beams/job_mapping.h"

namespace limber::testing {

beams::BeamModel model_of(const scene::BeamJobFiles& files, JobTorsion torsion) {
  beams::BeamModel model = session::model_of(files);
  if (torsion == JobTorsion::kPolar) {
    beams::SectionShape shape = beams::rectangle(files.job.section_width, files.job.section_height);
    shape.torsion = shape.moment_2 + shape.moment_3;
    model.sections[0] = beams::make_section(shape, {files.job.young, files.job.poisson, 0, 0});
  }
  return model;
}

beams::BeamModel refined(const beams::BeamModel& model, int parts) {
  beams::BeamModel result = model;
  result.elements.clear();
  for (const beams::BeamElement& element : model.elements) {
    const beams::BeamNode a = model.nodes[static_cast<std::size_t>(element.start)];
    const beams::BeamNode b = model.nodes[static_cast<std::size_t>(element.finish)];
    beams::BeamElement part = element;
    for (int i = 1; i <= parts; ++i) {
      part.finish = element.finish;
      if (i < parts) {
        const double share = double(i) / parts;
        part.finish = static_cast<int>(result.nodes.size());
        result.nodes.push_back({(1 - share) * a.position + share * b.position,
                                (1 - share) * a.normal + share * b.normal});
      }
      result.elements.push_back(part);
      part.start = part.finish;
    }
  }
  return result;
}

double extent_of(const beams::BeamModel& model) {
  Eigen::Vector3d low = model.nodes[0].position, high = low;
  for (const beams::BeamNode& node : model.nodes) {
    low = low.cwiseMin(node.position);
    high = high.cwiseMax(node.position);
  }
  return (high - low).norm();
}

Eigen::Vector3d random_direction(Random& random) {
  Eigen::Vector3d v;
  for (double& x : v) x = random.normal();
  return v.normalized();
}

}  // namespace limber::testing
