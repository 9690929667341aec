#include "server/wire/indices.h"

#include <fmt/format.h>

#include <limits>

namespace limber::server {

int decode_index(std::uint32_t value, const std::string& field) {
  if (value > static_cast<std::uint32_t>(std::numeric_limits<int>::max())) {
    throw Refusal(proto::ERROR_CODE_OUT_OF_RANGE, field, fmt::format("{} is out of range", value));
  }
  return static_cast<int>(value);
}

}  // namespace limber::server
