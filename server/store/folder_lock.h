#pragma once

#include "server/store/options.h"

namespace limber::server::store {

/// Makes the store's folder and file, readable by their owner alone, where they are not there, and
/// holds the folder: two servers would write different sessions of one name.
class FolderLock {
 public:
  /// @throws Error{kIo, "--data"}; {kFailedPrecondition, "--data"} where another server has it
  explicit FolderLock(const StoreOptions& options);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_ = -1;
};

}  // namespace limber::server::store
