#pragma once

#include <vector>

#include "clients/cli/context.h"
#include "clients/cpp/open_session.h"
#include "limber/v1/service.pb.h"

namespace limber::cli {

/// Of three numbers; of none: zeros.
[[nodiscard]] client::Vector vector(const std::vector<double>& values);
/// The revision and what was touched; warnings go to stderr.
void print_receipt(const Context& context, const v1::EditResponse& response);

}  // namespace limber::cli
