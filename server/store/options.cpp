#include "server/store/options.h"

#include "engine/base/error.h"

namespace limber::server::store {

void StoreOptions::validate() const {
  if (folder.empty()) throw Error(ErrorCode::kInvalidArgument, "folder", "a folder is expected");
  if (retain.count() < 0)
    throw Error(ErrorCode::kInvalidArgument, "retain", "a time >= 0 is expected");
  if (retry.count() <= 0)
    throw Error(ErrorCode::kInvalidArgument, "retry", "a time > 0 is expected");
}

}  // namespace limber::server::store
