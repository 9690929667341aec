#pragma once

#include <vector>

#include "clients/cli/context.h"
#include "clients/cpp/open_session.h"
#include "limber/v1/service.pb.h"

namespace limber::cli {

/// Vector of three numbers; of none: zeros.
[[nodiscard]] client::Vector vector(const std::vector<double>& values);
/// Prints the revision and the edited items; warnings go to stderr.
void print_receipt(const Context& context, const v1::EditResponse& response);

}  // namespace limber::cli
