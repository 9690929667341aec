#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace limber::server {

/// The envelope of a request, read before anything of it is parsed.
struct RequestPeek {
  std::uint64_t id = 0;  // 0 where none could be read
  std::uint32_t version = 0;
  std::uint64_t most_reply_bytes = 0;
  int body = 0;                  // field number of the body; 0: none
  std::string instance, client;  // as given
  std::string fault;             // why the bytes are no protobuf message; empty: they may be one
};

/// Reads only the first few outermost fields, in a time that does not depend on their length; never
/// throws, for any bytes.
[[nodiscard]] RequestPeek peek_request(std::string_view bytes);

/// The session that the body of a request names, without a uid behind it ("NAME@UID"). Empty where
/// it names none, or only behind more fields than a request may have; never throws.
/// @param body  as peeked
[[nodiscard]] std::string peek_session(std::string_view bytes, int body);

}  // namespace limber::server
