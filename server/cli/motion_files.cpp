#include "server/cli/motion_files.h"

#include "engine/base/error.h"
#include "server/cli/local_files.h"
#include "server/kinds/bodies/export.h"
#include "server/wire/errors.h"

namespace limber::server {

namespace fs = std::filesystem;

proto::ExportFormat motion_format(const fs::path& output) {
  if (output.extension() == ".pc2") return proto::EXPORT_FORMAT_PC2;
  if (output.extension() == ".pvd" || output.extension() == ".vtu") return proto::EXPORT_FORMAT_PVD;
  throw invalid("output", "a file name ending in .pc2, .pvd or .vtu is expected");
}

void demand_folder(const fs::path& file, const char* field) {
  const fs::path folder = file.parent_path();
  if (!folder.empty() && !fs::is_directory(folder))
    throw Error(ErrorCode::kIo, field, "there is no folder " + folder.string());
}

void write_motion(const std::shared_ptr<const ComputedMotion>& motion, proto::ExportFormat format,
                  const fs::path& output) {
  for (std::uint32_t part = 0, count = 1; part < count; ++part) {
    const proto::ExportResponse response =
        export_computed(motion, format, output.stem().string(), part);
    count = response.part_count();
    for (const auto& file : response.files()) {
      write_file(output.parent_path() / file.name(), file.content(),
                 file.append() ? WriteMode::kAppend : WriteMode::kReplace);
    }
  }
}

}  // namespace limber::server
