#pragma once

#include <string>

namespace limber::server {

/// While a socket is bound to ipc://PATH: libzmq replaces anything at the path.
/// Refused where a server listens there, or where there is something else than a socket; what a
/// killed server left is taken over. Starting servers take turns, by a lock of the folder that is
/// waited for one second: no two take the same path. For other endpoints nothing is done.
class IpcClaim {
 public:
  /// @throws Error{kIo, option}
  IpcClaim(const std::string& endpoint, const char* option);
  ~IpcClaim();
  IpcClaim(const IpcClaim&) = delete;
  IpcClaim& operator=(const IpcClaim&) = delete;

 private:
  int folder_ = -1;  // locked
};

}  // namespace limber::server
