#pragma once

#include <optional>
#include <string>
#include <vector>

#include "clients/cli/context.h"
#include "limber/v1/service.pb.h"

namespace limber::cli {

/// Options of `limber load`.
struct LoadOptions {
  std::string session;
  std::optional<unsigned> node, element, joint;
  std::vector<double> force, moment;  // none: zeros
  double torque = 0;
  bool follows = false;
};

/// The loaded element defines which kind of session it is for.
using SendLoad = v1::EditResponse (*)(Context&, const LoadOptions&);
struct LoadsOfKinds {
  SendLoad node, element, joint;
};

void add_load_command(CLI::App& app, Context& context, const LoadsOfKinds& loads);

}  // namespace limber::cli
