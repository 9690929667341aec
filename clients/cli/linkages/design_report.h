#pragma once

#include <cstdint>

#include "clients/cli/context.h"
#include "clients/cpp/linkages/design.h"
#include "clients/cpp/stream.h"
#include "limber/v1/design.pb.h"

namespace limber::cli::linkages {

/// How a design stands: its state, and its newest step.
void print_design(const Context& context, const v1::DesignInfo& info);

/// Prints the steps of the newest design, to its end.
/// @param stream  of the session's designs @param job  of the design; 0: whichever there is
void follow_design(Context& context, client::Subscription& stream, client::LinkageDesign& design,
                   std::uint64_t job);

}  // namespace limber::cli::linkages
