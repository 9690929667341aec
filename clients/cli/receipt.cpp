#include "clients/cli/receipt.h"

#include <fmt/format.h>

#include <string>

#include "clients/cli/print.h"

namespace limber::cli {

client::Vector vector(const std::vector<double>& values) {
  if (values.empty()) return {};
  return {values.at(0), values.at(1), values.at(2)};
}

void print_receipt(const Context& context, const v1::EditResponse& response) {
  for (const auto& issue : response.issues()) fmt::print(stderr, "{}\n", describe(issue));
  if (context.json) return print_json(response);
  std::string touched;
  for (const auto id : response.constraint_ids())
    if (id != 0) touched += fmt::format("{}{}", touched.empty() ? ", constraint " : ", ", id);
  for (const auto id : response.keyframe_ids())
    if (id != 0) touched += fmt::format(", keyframe {}", id);
  for (const auto id : response.target_ids())
    if (id != 0) touched += fmt::format(", target {}", id);
  fmt::print("revision {}{}\n", response.revision(), touched);
}

}  // namespace limber::cli
