#include "bench/table.h"

#include <fmt/format.h>

#include <numeric>

namespace limber::bench {
namespace {

constexpr std::size_t kTerminalWidth = 120;
constexpr std::size_t kGap = 2;

struct Cell {
  std::string text;
  bool number = false;  // aligned to the right
};
using Rows = std::vector<std::vector<Cell>>;

Cell cell_of(const Case& value) {
  if (value.is_string()) return {value.get<std::string>(), false};
  if (value.is_number_float()) return {fmt::format("{:.4g}", value.get<double>()), true};
  return {value.dump(), value.is_number()};
}

std::vector<std::string> keys_of(const Case& one) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : one.items()) keys.push_back(key);
  return keys;
}

/// The header in front; a header stands over its column's cells, so it is aligned as the first of
/// them.
Rows rows_of(const std::vector<Case>& cases) {
  Rows rows(1);
  for (const auto& [key, value] : cases.front().items())
    rows[0].push_back({key, cell_of(value).number});
  for (const Case& one : cases) {
    rows.emplace_back();
    for (const auto& [key, value] : one.items()) rows.back().push_back(cell_of(value));
  }
  return rows;
}

Rows turned(const Rows& rows) {
  Rows result(rows[0].size());
  for (const auto& row : rows) {
    for (std::size_t column = 0; column < result.size(); ++column) {
      const bool key = &row == &rows.front();
      result[column].push_back({row[column].text, !key});
    }
  }
  return result;
}

std::vector<std::size_t> widths_of(const Rows& rows) {
  std::vector<std::size_t> widths(rows[0].size(), 0);
  for (const auto& row : rows) {
    for (std::size_t column = 0; column < widths.size(); ++column)
      widths[column] = std::max(widths[column], row[column].text.size());
  }
  return widths;
}

std::size_t width_of(const Rows& rows) {
  const auto widths = widths_of(rows);
  return std::accumulate(widths.begin(), widths.end(), kGap * (widths.size() - 1));
}

std::string printed(const Rows& rows) {
  const auto widths = widths_of(rows);
  std::string text;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t column = 0; column < widths.size(); ++column) {
      if (column > 0) line.append(kGap, ' ');
      const auto& [cell, number] = row[column];
      line += number ? fmt::format("{:>{}}", cell, widths[column])
                     : fmt::format("{:<{}}", cell, widths[column]);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line;
    text += '\n';
  }
  return text;
}

}  // namespace

std::string table_of(const std::vector<Case>& cases) {
  std::string text;
  for (std::size_t begin = 0, end = 0; begin < cases.size(); begin = end) {
    const auto keys = keys_of(cases[begin]);
    while (end < cases.size() && keys_of(cases[end]) == keys) ++end;
    if (keys.empty()) continue;
    const Rows plain = rows_of({cases.begin() + static_cast<std::ptrdiff_t>(begin),
                                cases.begin() + static_cast<std::ptrdiff_t>(end)});
    const Rows other = turned(plain);
    const bool turn = width_of(plain) > kTerminalWidth && width_of(other) < width_of(plain);
    if (!text.empty()) text += '\n';
    text += printed(turn ? other : plain);
  }
  return text;
}

}  // namespace limber::bench
