#include "server/store/store_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <string>
#include <system_error>

#include "engine/base/error.h"
#include "server/log/log.h"

namespace limber::server::store {

namespace fs = std::filesystem;

std::uint64_t length_of(const fs::path& file) {
  std::error_code fault;
  const auto length = fs::file_size(file, fault);
  return fault ? 0 : length;
}

void prepare_store_file(const StoreOptions& options) {
  // SQLite reads a shorter file as an empty database, and refuses longer ones that are damaged.
  constexpr std::uint64_t kLeastRead = 2;
  const fs::path file = options.file();
  std::error_code fault;
  const bool is_there = fs::exists(file, fault), had_reserve = fs::exists(options.reserve(), fault);
  if (const std::uint64_t bytes = length_of(file); bytes < kLeastRead) {
    const std::string what = is_there ? fmt::format("has a length of {}", bytes) : "is missing";
    if (length_of(options.log()) > 0)
      throw Error(ErrorCode::kFailedPrecondition, "--data",
                  fmt::format("{} {}, but its log {} is there: bring the file back from a copy, or "
                              "move the log away to begin with an empty store",
                              file.string(), what, options.log().string()));
    if (bytes > 0 || (is_there && had_reserve))
      throw Error(ErrorCode::kFailedPrecondition, "--data",
                  fmt::format("{} {}, but was a store before: bring it back from a copy, or remove "
                              "it to begin with an empty store",
                              file.string(), what));
    if (had_reserve)
      log::warn("{} is missing and is made anew: sessions that were stored in it are gone",
                file.string());
  }
  const int made = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (made >= 0) ::close(made);  // else SQLite says why
}

}  // namespace limber::server::store
