#pragma once

namespace limber::bench {

/// Nanoseconds per interior vertex of many rods of ten edges, on one thread.
struct RodKernelTimes {
  double element_gradient_scalar = 0;  // moment of a vertex and gradient of an edge, from frames
  double element_gradient_pack = 0;
  double element_hessian_scalar = 0;  // moment, stiffness, blocks of an edge and with the next
  double element_hessian_pack = 0;
  double state = 0;     // frames and twists from unknowns
  double gradient = 0;  // energies and gradient of a state
  double rebase = 0;    // source frames moved to a state
  double hessian = 0;   // of a state at its source
  double hessian_vector_product = 0;
  double third_derivatives = 0;
};
[[nodiscard]] RodKernelTimes time_rod_kernels(int rods, int repeats);

}  // namespace limber::bench
