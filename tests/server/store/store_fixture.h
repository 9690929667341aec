#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <exception>
#include <filesystem>
#include <future>
#include <string>
#include <utility>
#include <vector>

#include "server/store/sqlite.h"
#include "server/store/store.h"

namespace limber::server::store {

/// A folder for a store, empty before and gone behind each test.
class StoreTest : public ::testing::Test {
 protected:
  StoreTest() { std::filesystem::remove_all(options_.folder); }
  ~StoreTest() override { std::filesystem::remove_all(options_.folder); }

  static OpenedSession opened(std::uint64_t uid, const std::string& name) {
    proto::Scene scene;
    scene.set_name("scene of " + name);
    return {uid, name, "bodies", scene.SerializeAsString(), "status"};
  }
  static EditedSession edited(std::uint64_t uid, std::uint64_t revision) {
    proto::StoredEdit edit;
    edit.set_revision(revision);
    edit.add_edits()->mutable_undo();
    return {uid, revision, edit.SerializeAsString()};
  }
  /// Made up, of that revision.
  static SavedCheckpoint checkpoint_at(std::uint64_t uid, std::uint64_t revision) {
    proto::StoredCheckpoint checkpoint;
    checkpoint.set_revision(revision);
    return {uid, revision, checkpoint.SerializeAsString()};
  }
  /// Returns once it is written; throws why it is not.
  static void write(Store& store, std::vector<Change> changes) {
    std::promise<void> written;
    store.append(std::move(changes), [&](const std::exception_ptr& fault) {
      fault ? written.set_exception(fault) : written.set_value();
    });
    written.get_future().get();
  }
  std::uint64_t count_in(const char* table) const {
    Database database(options_.file(), Database::Access::kRead);
    auto rows = database.prepare((std::string("SELECT count(*) FROM ") + table).c_str());
    return rows.step() ? rows.number(0) : 0;
  }

  StoreOptions options_{std::filesystem::temp_directory_path() /
                        ("store_test_" + std::to_string(::getpid()))};
};

}  // namespace limber::server::store
