#include "tests/support/charted_structure.h"

#include <Eigen/Geometry>

#include "engine/base/error.h"
#include "engine/base/index.h"
#include "tests/support/normal_chart.h"

namespace limber::testing {

using namespace beams;
using Eigen::Vector3d;

namespace {

using Kind = ChartedReference::Kind;

constexpr double kRim = 1e-5;  // of the public code

void demand(bool holds, const char* field, const char* message) {
  if (!holds) throw Error(ErrorCode::kUnsupported, field, message);
}

bool turns(const PrescribedMotion& motion) {
  return motion.rotates_any() && !motion.rotation.isZero(0);
}
// n_x turns about y, n_y about x.
constexpr std::array<int, 6> kRow = {0, 1, 2, 4, 3, 5};

void demand_supported(const BeamModel& model) {
  demand(model.distributed_loads.empty(), "distributed_loads", "the chart knows nodal loads only");
  demand(model.gravity.isZero(0), "gravity", "the chart knows nodal loads only");
  for (const BeamElement& e : model.elements) {
    demand(e.kind == BeamKind::kBeam, "elements.kind", "the chart knows beams only");
    demand(e.start_release == EndRelease{} && e.finish_release == EndRelease{}, "elements.release",
           "the chart knows no releases");
    demand(e.normal.isZero(0) && e.rest_curvature.isZero(0), "elements",
           "the chart knows no normals and curvatures of elements");
  }
  for (const BeamSupport& s : model.supports)
    demand(s.axes.isIdentity(0), "supports.axes", "the chart's unknowns have global axes");
  for (const auto* loads : {&model.loads, &model.temporary_loads})
    for (const NodalLoad& load : *loads)
      demand(load.direction == LoadDirection::kFixed, "loads.direction", "no load follows");
  for (const PrescribedMotion& m : model.motions) {
    demand(m.axes.isIdentity(0), "motions.axes", "the chart's unknowns have global axes");
    demand(!turns(m), "motions.rotation", "the chart's normals are not brought anywhere");
  }
}

}  // namespace

ChartedStructure::ChartedStructure(const BeamModel& model)
    : loads_(model.loads), temporary_(model.temporary_loads), motions_(model.motions) {
  demand_supported(model);
  rest_.setZero(6, static_cast<Eigen::Index>(model.nodes.size()));
  for (int i = 0; i < nodes(); ++i) {
    const Vector3d normal = model.nodes[index(i)].normal.normalized();
    demand(normal.z() > 0, "nodes.normal", "the chart has no lower hemisphere");
    rest_.col(i) << model.nodes[index(i)].position, normal.head<2>(), 0;
  }
  hold(model);
  add_elements(model);
  choose_references();
}

void ChartedStructure::hold(const BeamModel& model) {
  held_.setConstant(6, nodes(), false);
  for (const BeamSupport& s : model.supports) {
    for (std::size_t k = 0; k < 6; ++k)
      if (s.fixed[k]) held_(kRow[k], s.node) = true;
  }
  for (const PrescribedMotion& m : motions_) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (m.translates[k]) held_(kRow[k], m.node) = true;
      if (m.rotates[k]) held_(kRow[3 + k], m.node) = true;
    }
  }
}

void ChartedStructure::add_elements(const BeamModel& model) {
  for (const BeamElement& e : model.elements) {
    const BeamSection& section = model.sections[index(e.section)];
    Element added;
    added.ends[0].node = e.start;
    added.ends[1].node = e.finish;
    added.constants.length = e.rest_length > 0 ? e.rest_length : along(rest_, added).norm();
    added.constants.stretching = section.stretching;
    added.constants.torsion = section.torsion;
    added.constants.bending_2 = section.bending_2;
    added.constants.bending_3 = section.bending_3;
    added.constants.rim = kRim;
    elements_.push_back(added);
  }
}

void ChartedStructure::choose_references() {
  std::vector<int> first(index(nodes()), -1);
  for (int e = 0; e < static_cast<int>(elements_.size()); ++e) {
    const Vector3d t1 = along(rest_, elements_[index(e)]);
    for (End& end : elements_[index(e)].ends) {
      if (first[index(end.node)] < 0) first[index(end.node)] = e;
      end.element = first[index(end.node)];
      end.reference.vector = t1;
      if (held_(5, end.node)) {
        end.reference.kind = Kind::kAtRest;
      } else if (end.element != e) {
        const auto rest = rest_.col(end.node);
        end.reference.kind = Kind::kElement;
        end.reference.alpha = charted_alpha(normal_of_chart(rest[3], rest[4]).normal,
                                            along(rest_, elements_[index(end.element)]), t1);
      }
    }
  }
}

Vector3d ChartedStructure::along(const ChartedUnknowns& unknowns, const Element& e) const {
  return unknowns.col(e.ends[1].node).head<3>() - unknowns.col(e.ends[0].node).head<3>();
}

ChartedReferences ChartedStructure::references(const ChartedUnknowns& unknowns,
                                               const Element& e) const {
  ChartedReferences result;
  for (std::size_t i = 0; i < 2; ++i) {
    const End& end = e.ends[i];
    result[i] = end.reference;
    if (end.reference.kind == Kind::kElement)
      result[i].vector = along(unknowns, elements_[index(end.element)]);
  }
  return result;
}

ChartedVector ChartedStructure::gathered(const ChartedUnknowns& unknowns, const Element& e) const {
  ChartedVector result;
  result << unknowns.col(e.ends[0].node), unknowns.col(e.ends[1].node);
  return result;
}

double ChartedStructure::elastic_energy(const ChartedUnknowns& unknowns) const {
  double energy = 0;
  for (const Element& e : elements_)
    energy += charted_energy(e.constants, references(unknowns, e), gathered(unknowns, e));
  return energy;
}

void ChartedStructure::add_loads(const std::vector<NodalLoad>& loads,
                                 const ChartedUnknowns& unknowns, ChartedUnknowns& forces) const {
  for (const NodalLoad& load : loads) {
    auto force = forces.col(load.node);
    force.head<3>() += load.force;
    if (load.moment.isZero(0)) continue;
    const auto at = unknowns.col(load.node);
    force.segment<2>(3) += charted_moment(load.moment, at[3], at[4], kRim);
    force[5] += load.moment.dot(normal_of_chart(at[3], at[4]).normal);
  }
}

ChartedUnknowns ChartedStructure::unbalanced(const ChartedUnknowns& unknowns,
                                             Temporary loads) const {
  ChartedUnknowns forces = ChartedUnknowns::Zero(6, nodes());
  add_loads(loads_, unknowns, forces);
  if (loads == Temporary::kOn) add_loads(temporary_, unknowns, forces);
  for (const Element& e : elements_) {
    const ChartedGradient gradient =
        charted_gradient(e.constants, references(unknowns, e), gathered(unknowns, e));
    for (int i = 0; i < 2; ++i) {
      const End& end = e.ends[index(i)];
      forces.col(end.node) -= gradient.unknowns.segment<6>(6 * i);
      if (end.reference.kind != Kind::kElement) continue;
      const Element& reference = elements_[index(end.element)];
      forces.col(reference.ends[0].node).head<3>() += gradient.references[index(i)];
      forces.col(reference.ends[1].node).head<3>() -= gradient.references[index(i)];
    }
  }
  forces = held_.select(0.0, forces.array());
  return forces;
}

ChartedStructure::Masses ChartedStructure::masses(const ChartedUnknowns& unknowns) const {
  Masses masses{Eigen::ArrayXd::Zero(nodes()), Eigen::ArrayXd::Zero(nodes())};
  for (const Element& e : elements_) {
    const double length = along(unknowns, e).norm();
    const double bending = e.constants.bending_2 + e.constants.bending_3;
    for (const End& end : e.ends) {
      masses.translation[end.node] += 2 * e.constants.stretching / length;
      masses.rotation[end.node] += 8 * bending / (length * length * length);
    }
  }
  return masses;
}

void ChartedStructure::drive(ChartedUnknowns& unknowns, double share) const {
  for (const PrescribedMotion& m : motions_) {
    for (int k = 0; k < 3; ++k)
      if (m.translates[index(k)]) unknowns(k, m.node) = rest_(k, m.node) + share * m.translation[k];
  }
}

}  // namespace limber::testing
