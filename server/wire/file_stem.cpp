#include "server/wire/file_stem.h"

#include <algorithm>
#include <cctype>

#include "server/wire/errors.h"

namespace limber::server {

std::string decode_file_stem(const std::string& stem, const std::string& fallback) {
  if (stem.empty()) return fallback;
  const bool good = stem.size() <= 128 && stem.front() != '.' &&
                    std::all_of(stem.begin(), stem.end(), [](unsigned char c) {
                      return (c < 0x80 && std::isalnum(c) != 0) || c == '.' || c == '_' || c == '-';
                    });
  if (!good)
    throw invalid("stem", "a file name of [A-Za-z0-9._-] that starts with no dot is expected");
  return stem;
}

}  // namespace limber::server
