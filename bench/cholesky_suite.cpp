#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>

#include "bench/suite.h"
#include "engine/base/numerics/multifrontal_cholesky.h"
#include "engine/base/numerics/sparse_cholesky.h"
#include "engine/bodies/stiffness.h"

namespace limber::bench {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

/// Stiffness of a body with a little mass, so that it is positive definite without supports.
Matrix stiffness_of(const NamedBody& named) {
  Matrix a = bodies::stiffness_matrix(named.body.mesh);
  const double shift = 1e-3 * a.diagonal().mean();
  for (int k = 0; k < a.rows(); ++k) a.coeffRef(k, k) += shift;
  a.makeCompressed();
  return a;
}

Case compare(const std::string& name, const Matrix& a, int repeats) {
  Case result;
  result["body"] = name;
  result["rows"] = a.rows();
  result["library"] = cholesky_library() == CholeskyLibrary::kCholmodSupernodal
                          ? "CHOLMOD, supernodal"
                          : "own, multifrontal";
  const Eigen::MatrixXd b = Eigen::MatrixXd::Ones(a.rows(), 16);
  SparseCholesky library;
  result["analysis_ms"] = milliseconds([&] { library.analyse(a); });
  detail::MultifrontalCholesky own;
  result["own_analysis_ms"] = milliseconds([&] { own.analyse(a); });
  SparseCholesky::Workspace library_scratch;
  detail::MultifrontalCholesky::Workspace own_scratch;
  Eigen::MatrixXd x = b, y = b;
  std::vector<double> factor, own_factor, solve, own_solve, one, own_one;
  for (int k = 0; k < repeats; ++k) {
    factor.push_back(milliseconds([&] { library.refactor(a); }));
    own_factor.push_back(milliseconds([&] { (void)own.factor(a); }));
    x = y = b;
    solve.push_back(milliseconds([&] { library.solve_in_place(x, library_scratch); }));
    own_solve.push_back(
        milliseconds([&] { own.solve_in_place(y.data(), y.cols(), y.rows(), own_scratch); }));
    Eigen::VectorXd single = b.col(0), own_single = b.col(0);
    one.push_back(milliseconds([&] { library.solve_in_place(single, library_scratch); }));
    own_one.push_back(milliseconds(
        [&] { own.solve_in_place(own_single.data(), 1, own_single.rows(), own_scratch); }));
  }
  result["factor_ms"] = quantile(factor, 0.5);
  result["own_factor_ms"] = quantile(own_factor, 0.5);
  result["solve_ms"] = quantile(one, 0.5);
  result["own_solve_ms"] = quantile(own_one, 0.5);
  result["solve_16_ms"] = quantile(solve, 0.5);
  result["own_solve_16_ms"] = quantile(own_solve, 0.5);
  result["factor_nonzeros"] = library.factor_nonzeros();
  result["own_factor_nonzeros"] = own.factor_nonzeros();
  result["difference"] = (x - y).norm() / x.norm();
  return result;
}

}  // namespace

void cholesky_suite(const SuiteOptions& options, Recorder& recorder) {
  for (const char* name : {"beam", "flower", "dino", "bunny", "tyrannosaurus", "Armadillo13K"}) {
    if (options.quick && std::string(name) == "Armadillo13K") continue;
    if (const auto body = load_body(name, options)) {
      recorder.add(compare(name, stiffness_of(*body), options.quick ? 3 : options.repeats));
    } else {
      recorder.note(fmt::format("{} left out: its file is not there", name));
    }
  }
}

}  // namespace limber::bench
