#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "engine/reduced/reduced_model.h"
#include "engine/session/bodies/shared_builds.h"

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
  struct Found {
    std::shared_ptr<const reduced::ReducedModel> model;
    bool is_from_disk = false;
  };
  /// From the disk, else from another session that builds it at this time, else built and stored.
  /// @param nodes  of the body: a file with another number counts as absent
  /// @param on_absent  called before the model is built or waited for, if it is
  /// @throws Error{kCancelled}, and what `build` throws
  [[nodiscard]] Found find_or_build(const std::string& key, int nodes, const JobContext& job,
                                    const SharedBuilds::Make& build,
                                    const std::function<void()>& on_absent = {}) const;
  /// First models, which are on no disk: built, or those of other sessions that still show them.
  [[nodiscard]] std::shared_ptr<const reduced::ReducedModel> first_model(
      const std::string& key, const JobContext& job, const SharedBuilds::Make& build) const {
    return first_models_.get(key, job, build).model;
  }
  [[nodiscard]] std::shared_ptr<const reduced::ReducedModel> load(const std::string& key) const;
  /// Failure to write is not an error of the session: returns false.
  bool store(const std::string& key, const reduced::ReducedModel& model) const;

 private:
  std::filesystem::path folder_;
  std::uint64_t limit_bytes_;
  mutable SharedBuilds builds_{SharedBuilds::Keep::kNone};
  mutable SharedBuilds first_models_{SharedBuilds::Keep::kWhileInUse};
};

}  // namespace limber::session
