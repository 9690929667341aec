#include "server/store/options.h"

#include <fmt/format.h>

#include "engine/base/error.h"

namespace limber::server::store {

void StoreOptions::validate() const {
  if (folder.empty()) throw Error(ErrorCode::kInvalidArgument, "--data", "a folder is expected");
  if (bytes > 0 && bytes < kLeastBytes)
    throw Error(ErrorCode::kInvalidArgument, "--data-bytes",
                fmt::format("{} bytes hold no session: {} at least, or 0 for what the disk holds",
                            bytes, kLeastBytes));
  if (retain.count() < 0)
    throw Error(ErrorCode::kInvalidArgument, "--retain", "a time >= 0 is expected");
  if (retry.count() <= 0)
    throw Error(ErrorCode::kInvalidArgument, "retry", "a time > 0 is expected");
}

}  // namespace limber::server::store
