#include "engine/beams/structure/elastic.h"

#include <algorithm>

#include "engine/base/index.h"
#include "engine/base/parallel.h"
#include "engine/beams/structure/element_unknowns.h"

namespace limber::beams {

namespace {

constexpr std::int64_t kGrain = 64;  // elements: some 100 microseconds of second derivatives

constexpr double kUnstrained = 1e-14;  // elastic energy over the stiffness of stretching

}  // namespace

BeamEnergies elastic_energies(const BeamStructure& structure, const BeamState& state) {
  BeamEnergies sum;
  for (int e = 0; e < structure.elements(); ++e) {
    const auto u = element_energies(structure.constants(e), structure.ends(state, e));
    sum.stretching += u.stretching;
    sum.torsion += u.torsion;
    sum.bending_2 += u.bending_2;
    sum.bending_3 += u.bending_3;
  }
  return sum;
}

bool carries_forces(const BeamStructure& structure, const BeamState& state) {
  double scale = 0;
  for (int e = 0; e < structure.elements(); ++e) {
    const auto& constants = structure.constants(e);
    scale += constants.stretching * constants.length * constants.length;
  }
  return elastic_energies(structure, state).total() > kUnstrained * scale;
}

Eigen::VectorXd elastic_gradient(const BeamStructure& structure, const BeamState& state) {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(structure.unknowns());
  for (int e = 0; e < structure.elements(); ++e) {
    const LocalVector local = local_gradient(structure, state, e);
    const ElementUnknowns unknowns = unknowns_of(structure, e);
    for (int k = 0; k < unknowns.count; ++k) result[unknowns.at[index(k)]] += local[k];
  }
  return result;
}

Stiffness::Stiffness(const BeamStructure& structure) : structure_(structure) {
  row_of_.assign(index(structure.unknowns()), -1);
  for (int u = 0; u < structure.unknowns(); ++u) {
    if (structure.held()[index(u)] != 0) continue;
    row_of_[index(u)] = size();
    free_.push_back(u);
  }
  const auto for_each_entry = [&](int e, auto&& visit) {
    const ElementUnknowns unknowns = unknowns_of(structure, e);
    for (int j = 0; j < unknowns.count; ++j) {
      for (int i = 0; i < unknowns.count; ++i) {
        const int row = row_of_[index(unknowns.at[index(i)])];
        const int column = row_of_[index(unknowns.at[index(j)])];
        if (row >= column && column >= 0) visit(i + j * unknowns.count, row, column);
      }
    }
  };
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < size(); ++i) entries.emplace_back(i, i, 0.0);
  for (int e = 0; e < structure.elements(); ++e)
    for_each_entry(e, [&](int, int row, int column) { entries.emplace_back(row, column, 0.0); });
  matrix_.resize(size(), size());
  matrix_.setFromTriplets(entries.begin(), entries.end());
  matrix_.makeCompressed();
  places_.resize(index(structure.elements()));
  local_.resize(index(structure.elements()));
  const int* const outer = matrix_.outerIndexPtr();
  const int* const inner = matrix_.innerIndexPtr();
  for (int e = 0; e < structure.elements(); ++e) {
    for_each_entry(e, [&](int entry, int row, int column) {
      const int* const found =
          std::lower_bound(inner + outer[column], inner + outer[column + 1], row);
      places_[index(e)].emplace_back(entry, static_cast<int>(found - inner));
    });
  }
}

void Stiffness::assemble(const BeamState& state, Compression compression) {
  parallel_for(structure_.elements(), kGrain, [&](std::int64_t begin, std::int64_t end) {
    for (auto e = static_cast<int>(begin); e < static_cast<int>(end); ++e)
      local_[index(e)] = local_hessian(structure_, state, e, compression);
  });
  add_up();
}

void Stiffness::assemble(const BeamState& state, const NodeLoads& loads, Compression compression) {
  if (!loads.loads_elements()) return assemble(state, compression);
  parallel_for(structure_.elements(), kGrain, [&](std::int64_t begin, std::int64_t end) {
    for (auto e = static_cast<int>(begin); e < static_cast<int>(end); ++e) {
      const LoadTransfer transfer = load_transfer(structure_, e);
      const ElementEnds ends = structure_.ends(state, e);
      const SpreadLoad all = load_over(structure_, loads, ends, e);
      const LocalLoad load{spread_forces(transfer, ends, all),
                           spread_hessian(transfer, ends, loads.element_forces.col(e))};
      local_[index(e)] = local_hessian(structure_, state, e, compression, &load);
    }
  });
  add_up();
}

void Stiffness::add_up() {
  double* const values = matrix_.valuePtr();
  std::fill(values, values + matrix_.nonZeros(), 0.0);
  for (std::size_t e = 0; e < places_.size(); ++e) {
    const double* const from = local_[e].data();
    for (const auto& [entry, place] : places_[e]) values[place] += from[entry];
  }
}

Eigen::VectorXd Stiffness::times(const Eigen::VectorXd& v) const {
  return matrix_.selfadjointView<Eigen::Lower>() * v;
}

Eigen::VectorXd Stiffness::from_held(const Eigen::VectorXd& increments) const {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(size());
  for (int e = 0; e < structure_.elements(); ++e) {
    const ElementUnknowns unknowns = unknowns_of(structure_, e);
    LocalVector moved = LocalVector::Zero(unknowns.count);
    bool any = false;
    for (int k = 0; k < unknowns.count; ++k) {
      const int u = unknowns.at[index(k)];
      if (row_of_[index(u)] < 0) moved[k] = increments[u];
      any = any || moved[k] != 0;
    }
    if (!any) continue;
    const Eigen::VectorXd change = local_[index(e)] * moved;
    for (int k = 0; k < unknowns.count; ++k) {
      const int row = row_of_[index(unknowns.at[index(k)])];
      if (row >= 0) result[row] += change[k];
    }
  }
  return result;
}

Eigen::VectorXd Stiffness::restricted(const Eigen::VectorXd& all) const {
  Eigen::VectorXd result(size());
  for (int i = 0; i < size(); ++i) result[i] = all[free_[index(i)]];
  return result;
}

Eigen::VectorXd Stiffness::extended(const Eigen::VectorXd& free) const {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(structure_.unknowns());
  for (int i = 0; i < size(); ++i) result[free_[index(i)]] = free[i];
  return result;
}

}  // namespace limber::beams
