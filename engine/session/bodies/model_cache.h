#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "engine/reduced/reduced_model.h"

namespace limber::session {

/// Built models on disk, one file under the hash of all inputs and of the format version. Safe to
/// share between processes: files are written aside and renamed. A damaged or foreign file counts
/// as absent.
class ModelCache {
 public:
  /// @param folder  created if missing; empty path: no disk, every model is built
  explicit ModelCache(std::filesystem::path folder, std::uint64_t limit_bytes = 4ull << 30);

  [[nodiscard]] static std::string key(const bodies::ElasticBody& body,
                                       const reduced::ModelOptions& options,
                                       const Eigen::MatrixXd& animation = {});
  [[nodiscard]] std::shared_ptr<const reduced::ReducedModel> load(const std::string& key) const;
  /// Failure to write is not an error of the session: returns false.
  bool store(const std::string& key, const reduced::ReducedModel& model) const;

 private:
  std::filesystem::path folder_;
  std::uint64_t limit_bytes_;
};

}  // namespace limber::session
