#include "server/runtime/export_parts.h"

#include <fmt/format.h>

#include <algorithm>

namespace limber::server {

void add_file(proto::ExportResponse& response, std::string name, std::string content, bool append) {
  auto* file = response.add_files();
  file->set_name(std::move(name));
  file->set_content(std::move(content));
  file->set_append(append);
}

void refuse_part(std::uint32_t part, std::uint32_t parts) {
  throw Refusal(proto::ERROR_CODE_OUT_OF_RANGE, "part", fmt::format("part {} of {}", part, parts));
}

proto::ExportResponse cut_into_parts(const std::vector<TextFile>& files, std::uint32_t part) {
  proto::ExportResponse response;
  std::uint32_t parts = 0;
  std::size_t room = 0;
  for (const TextFile& file : files) {
    std::size_t from = 0;
    do {
      if (room == 0) {
        room = kPartBytes;
        ++parts;
      }
      const std::size_t count = std::min(room, file.content.size() - from);
      if (parts == part + 1)
        add_file(response, file.name, file.content.substr(from, count), from > 0);
      from += count;
      room -= count;
    } while (from < file.content.size());
  }
  if (part >= parts) refuse_part(part, parts);
  response.set_part(part);
  response.set_part_count(parts);
  return response;
}

}  // namespace limber::server
