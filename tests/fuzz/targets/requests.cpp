// The bytes of a request, as they come from a socket, up to the values that a session is made of.
#include "server/wire/errors.h"
#include "server/wire/peek.h"
#include "server/wire/wire_check.h"
#include "tests/fuzz/decoding.h"
#include "tests/fuzz/input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace limber;
  namespace proto = limber::v1;
  const std::string_view bytes = fuzz::text_of(data, size);
  const server::RequestPeek peek = server::peek_request(bytes);
  (void)server::peek_session(bytes, peek.body);
  proto::Request request;
  const bool is_request = fuzz::answers([&] {
    server::check_wire(bytes, *proto::Request::descriptor());
    if (!request.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
      throw server::malformed("no request");
  });
  if (!is_request) return 0;
  // What is read in full is what was peeked.
  if (peek.fault.empty() && static_cast<int>(request.body_case()) != peek.body &&
      request.body_case() != proto::Request::BODY_NOT_SET)
    fuzz::finding("the body that was peeked is not the one that is read");
  fuzz::decode_request(request);
  return 0;
}
