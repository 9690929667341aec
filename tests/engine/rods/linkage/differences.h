#pragma once

namespace limber::rods::testing {

/// Fourth-order difference at 0 of a function of one number.
template <class Function>
auto derivative(const Function& function, double h) -> decltype(function(h)) {
  return ((function(h) - function(-h)) * 8.0 - (function(2 * h) - function(-2 * h))) / (12 * h);
}

}  // namespace limber::rods::testing
