#pragma once

#include <string>
#include <vector>

#include "clients/cli/context.h"
#include "limber/v1/service.pb.h"

namespace limber::cli {

/// Of three numbers: x, y, z.
[[nodiscard]] v1::Vector3 vector(const std::vector<double>& values);
/// Edits of one request: one revision. @throws ClientError
[[nodiscard]] v1::EditResponse send(Context& context, const std::string& session,
                                    const std::vector<v1::Edit>& edits);
/// The revision and what was touched; warnings go to stderr.
void print_receipt(const Context& context, const v1::EditResponse& response);

}  // namespace limber::cli
