#pragma once

#include <google/protobuf/io/coded_stream.h>

#include <cstdint>
#include <string_view>

namespace limber::server {

/// The bytes must outlive the stream.
[[nodiscard]] inline google::protobuf::io::CodedInputStream stream_of(std::string_view bytes) {
  return google::protobuf::io::CodedInputStream(reinterpret_cast<const std::uint8_t*>(bytes.data()),
                                                static_cast<int>(bytes.size()));
}

}  // namespace limber::server
