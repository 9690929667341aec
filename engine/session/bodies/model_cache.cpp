#include "engine/session/bodies/model_cache.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <system_error>
#include <tuple>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/reduced/model_file.h"

namespace limber::session {
namespace {

namespace fs = std::filesystem;

constexpr const char* kEnding = ".model";
constexpr const char* kAside = ".aside";  // while being written: KEY.XXXXXX.aside
constexpr auto kForgottenAside = std::chrono::hours(1);

bool write_all(int file, const std::string& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t written = ::write(file, bytes.data() + done, bytes.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    done += static_cast<std::size_t>(written);
  }
  return true;
}

/// Oldest files out, until the rest is at most `limit`. Others may be pruning too: missing files
/// are fine.
void prune(const fs::path& folder, std::uint64_t limit) {
  struct File {
    fs::file_time_type time;
    std::uint64_t size;
    fs::path path;
  };
  std::vector<File> files;
  std::uint64_t total = 0;
  std::error_code error;
  const auto now = fs::file_time_type::clock::now();
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code gone;
    const File file{entry->last_write_time(gone), entry->file_size(gone), entry->path()};
    if (gone) continue;
    if (file.path.extension() == kAside && now - file.time > kForgottenAside)
      fs::remove(file.path, gone);
    if (file.path.extension() != kEnding) continue;
    total += file.size;
    files.push_back(file);
  }
  std::sort(files.begin(), files.end(), [](const File& a, const File& b) {
    return std::tie(a.time, a.path) < std::tie(b.time, b.path);
  });
  for (const File& file : files) {
    if (total <= limit) return;
    fs::remove(file.path, error);
    total -= file.size;
  }
}

}  // namespace

ModelCache::ModelCache(fs::path folder, std::uint64_t limit_bytes)
    : folder_(std::move(folder)), limit_bytes_(limit_bytes) {
  if (folder_.empty()) return;
  std::error_code error;
  fs::create_directories(folder_, error);
  if (!fs::is_directory(folder_, error)) {
    throw Error(ErrorCode::kIo, "cache",
                "the model cache cannot use the folder " + folder_.string());
  }
}

std::string ModelCache::key(const bodies::ElasticBody& body, const reduced::ModelOptions& options,
                            const Eigen::MatrixXd& animation) {
  ContentHash hash;
  hash.add("limber model").add(reduced::kModelFormatVersion);
  hash.add(body.mesh.nodes).add(body.mesh.tets);
  hash.add(static_cast<std::uint64_t>(body.mesh.materials.size()));
  for (const bodies::Material& material : body.mesh.materials) {
    hash.add(material.youngs_modulus).add(material.poissons_ratio).add(material.density);
  }
  hash.add_array(body.mesh.tet_material.data(), body.mesh.tet_material.size());
  hash.add_array(body.fixed_nodes.data(), body.fixed_nodes.size());
  hash.add(options.mode_count)
      .add(options.tolerance)
      .add(options.basis_size)
      .add(options.cubature_size);
  hash.add(options.cubature).add(options.basis).add(options.training_poses).add(options.test_poses);
  hash.add(options.amplitude).add(options.seed);
  hash.add(animation);
  return hash.hex();
}

std::shared_ptr<const reduced::ReducedModel> ModelCache::load(const std::string& key) const {
  if (folder_.empty()) return nullptr;
  try {
    const fs::path path = folder_ / (key + kEnding);
    std::ifstream stream(path, std::ios::binary | std::ios::ate);
    if (!stream) return nullptr;
    std::string bytes(static_cast<std::size_t>(stream.tellg()), '\0');
    if (!stream.seekg(0).read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
      return nullptr;
    auto model = std::make_shared<const reduced::ReducedModel>(reduced::decode_model(bytes));
    std::error_code unimportant;  // used now, so it is pruned late
    fs::last_write_time(path, fs::file_time_type::clock::now(), unimportant);
    return model;
  } catch (const std::exception&) {
    return nullptr;  // damaged, foreign, cut: as if it were not there, and store() will replace it
  }
}

ModelCache::Found ModelCache::find_or_build(const std::string& key, int nodes,
                                            const JobContext& job, const SharedBuilds::Make& build,
                                            const std::function<void()>& on_absent) const {
  const auto from_disk = [&] {
    auto model = load(key);
    return model && model->node_count == nodes ? model : nullptr;
  };
  if (auto model = from_disk()) return {std::move(model), true};
  if (on_absent) on_absent();
  bool is_from_disk = false;
  const auto make = [&](const JobContext& shared) {
    auto model = from_disk();  // another session may have built it a moment ago
    is_from_disk = model != nullptr;
    if (model) return model;
    model = build(shared);
    store(key, *model);
    return model;
  };
  auto model = builds_.get(key, job, make).model;
  return {std::move(model), is_from_disk};
}

bool ModelCache::store(const std::string& key, const reduced::ReducedModel& model) const {
  if (folder_.empty()) return false;
  try {
    const std::string bytes = reduced::encode_model(model);
    if (bytes.size() > limit_bytes_) return false;
    std::string aside = (folder_ / (key + ".XXXXXX" + kAside)).string();
    const int file =
        ::mkostemps(aside.data(), static_cast<int>(std::string_view(kAside).size()), O_CLOEXEC);
    if (file < 0) return false;
    const bool written = write_all(file, bytes);
    const bool closed = ::close(file) == 0;
    std::error_code error;
    if (written && closed) fs::rename(aside, folder_ / (key + kEnding), error);
    if (!written || !closed || error) {
      fs::remove(aside, error);
      return false;
    }
    prune(folder_, limit_bytes_);
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

}  // namespace limber::session
