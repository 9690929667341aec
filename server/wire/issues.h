#pragma once

#include <string>
#include <vector>

#include "engine/scene/issue.h"
#include "limber/v1/common.pb.h"
#include "server/wire/faults.h"

namespace limber::server {

[[nodiscard]] proto::Issue encode_issue(const scene::Issue& issue, const std::string& prefix = "");
[[nodiscard]] proto::Issue encode_warning(const std::string& field, const std::string& message);
[[nodiscard]] proto::Issue encode_fault(const Faults::Fault& fault);

}  // namespace limber::server
