#include "server/wire/indices.h"

#include <fmt/format.h>

#include "engine/base/checked_number.h"

namespace limber::server {

int decode_index(std::uint32_t value, const std::string& field) {
  const auto index = to_whole<int>(value);
  if (!index)
    throw Refusal(proto::ERROR_CODE_OUT_OF_RANGE, field, fmt::format("{} is out of range", value));
  return *index;
}

}  // namespace limber::server
