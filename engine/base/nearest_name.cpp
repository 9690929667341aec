#include "engine/base/nearest_name.h"

#include <algorithm>
#include <cctype>
#include <string>
#include <vector>

namespace limber {
namespace {

constexpr std::size_t kLongest = 100;  // letters; keys are no texts

std::string letters_of(std::string_view name) {
  std::string letters;
  for (const char c : name.substr(0, kLongest)) {
    if (c == ' ' || c == '_' || c == '-') continue;
    letters += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return letters;
}

/// Optimal string alignment distance.
std::size_t distance(const std::string& a, const std::string& b) {
  const std::size_t columns = b.size() + 1;
  std::vector<std::size_t> d((a.size() + 1) * columns);
  for (std::size_t i = 0; i <= a.size(); ++i) d[i * columns] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) d[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t j = 1; j <= b.size(); ++j) {
      std::size_t& here = d[i * columns + j];
      here = std::min({d[(i - 1) * columns + j] + 1, d[i * columns + j - 1] + 1,
                       d[(i - 1) * columns + j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        here = std::min(here, d[(i - 2) * columns + j - 2] + 1);
    }
  }
  return d.back();
}

}  // namespace

std::string_view nearest_name(std::string_view misspelt, std::span<const std::string_view> names) {
  const std::string letters = letters_of(misspelt);
  std::string_view nearest;
  std::size_t least = kLongest;
  for (const std::string_view name : names) {
    const std::string other = letters_of(name);
    const std::size_t away = distance(letters, other);
    if (3 * away > std::max(letters.size(), other.size()) || away >= least) continue;
    least = away;
    nearest = name;
  }
  return nearest;
}

}  // namespace limber
