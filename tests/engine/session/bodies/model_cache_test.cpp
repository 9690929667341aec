#include "engine/session/bodies/model_cache.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <thread>

#include "engine/reduced/model_file.h"
#include "engine/session/bodies/problem_mapping.h"
#include "tests/engine/session/bodies/harness.h"
#include "tests/engine/session/bodies/scenes.h"

namespace limber::session {
namespace {

namespace fs = std::filesystem;

reduced::ReducedModel filled_model(int nodes, double value) {
  reduced::ReducedModel model;
  model.node_count = nodes;
  model.length = 1;
  model.eigenvalues = Eigen::VectorXd::Constant(2, 4);
  model.modes = Eigen::MatrixXd::Constant(3 * nodes, 2, value);
  model.basis = Eigen::MatrixXd::Identity(3 * nodes, 3);
  model.tets = {0};
  model.rs_modes = Eigen::MatrixXd::Constant(9, 2, value);
  model.map = Eigen::MatrixXd::Constant(3, 9, value);
  model.direct = Eigen::MatrixXd::Zero(3, 2);
  return model;
}

std::vector<fs::path> files(const fs::path& folder) {
  std::vector<fs::path> list;
  for (const auto& entry : fs::directory_iterator(folder)) list.push_back(entry.path());
  return list;
}

std::string inline_key(const scene::Scene& scene) {
  const MappedBody mapped = map_body(scene);
  return ModelCache::key(mapped.body, map_model(scene, mapped.body));
}

TEST(ModelCache, WhatWasStoredIsLoaded) {
  const TemporaryFolder folder;
  const ModelCache cache(folder.path() / "made" / "on demand");
  EXPECT_FALSE(cache.load("abc"));
  ASSERT_TRUE(cache.store("abc", filled_model(4, 0.1)));
  const auto loaded = cache.load("abc");
  ASSERT_TRUE(loaded);
  EXPECT_EQ(reduced::encode_model(*loaded), reduced::encode_model(filled_model(4, 0.1)));
  EXPECT_FALSE(cache.load("abd"));
  ASSERT_TRUE(cache.store("abc", filled_model(4, 0.2)));
  EXPECT_EQ(cache.load("abc")->map(0, 0), 0.2);
  EXPECT_EQ(files(folder.path() / "made" / "on demand").size(), 1u);
}

TEST(ModelCache, WithoutAFolderItIsAlwaysEmpty) {
  const ModelCache cache("");
  EXPECT_FALSE(cache.store("abc", filled_model(4, 0.1)));
  EXPECT_FALSE(cache.load("abc"));
}

TEST(ModelCache, AFileInPlaceOfTheFolder) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "file") << "x";
  EXPECT_THROW(ModelCache(folder.path() / "file"), Error);
}

TEST(ModelCache, DamagedAndForeignFilesCountAsAbsent) {
  const TemporaryFolder folder;
  const ModelCache cache(folder.path());
  ASSERT_TRUE(cache.store("abc", filled_model(4, 0.1)));
  const fs::path path = files(folder.path()).front();
  std::string bytes(fs::file_size(path), '\0');
  std::ifstream(path, std::ios::binary)
      .read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  const auto write = [&](const std::string& content) {
    std::ofstream(path, std::ios::binary) << content;
  };
  for (std::size_t at = 0; at < bytes.size(); at += 1 + bytes.size() / 60) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    write(damaged);
    EXPECT_FALSE(cache.load("abc")) << "byte " << at;
    write(bytes.substr(0, at));
    EXPECT_FALSE(cache.load("abc")) << "cut at " << at;
  }
  write("not a model");
  EXPECT_FALSE(cache.load("abc"));
  write(bytes);
  EXPECT_TRUE(cache.load("abc"));
  ASSERT_TRUE(cache.store("abc", filled_model(4, 0.3)));
  EXPECT_TRUE(cache.load("abc"));
}

TEST(ModelCache, TheOldestGoFirst) {
  const TemporaryFolder folder;
  const std::uint64_t size = reduced::encode_model(filled_model(40, 0.1)).size();
  const ModelCache cache(folder.path(), 3 * size + size / 2);
  const auto now = fs::file_time_type::clock::now();
  for (int i = 0; i < 3; ++i) {
    const std::string key = "key" + std::to_string(i);
    ASSERT_TRUE(cache.store(key, filled_model(40, 0.1)));
    fs::last_write_time(folder.path() / (key + ".model"), now - std::chrono::hours(10 - i));
  }
  ASSERT_TRUE(cache.load("key0"));  // used now: no longer the oldest
  ASSERT_TRUE(cache.store("key3", filled_model(40, 0.1)));
  EXPECT_TRUE(cache.load("key0"));
  EXPECT_FALSE(cache.load("key1"));
  EXPECT_TRUE(cache.load("key2"));
  EXPECT_TRUE(cache.load("key3"));
  EXPECT_FALSE(cache.store("large", filled_model(400, 0.1)));
  EXPECT_TRUE(cache.load("key3"));
}

TEST(ModelCache, ForgottenTemporaryFilesAreRemoved) {
  const TemporaryFolder folder;
  const ModelCache cache(folder.path());
  const fs::path old = folder.path() / "abc.123456.aside",
                 fresh = folder.path() / "abc.654321.aside";
  std::ofstream(old) << "x";
  std::ofstream(fresh) << "x";
  fs::last_write_time(old, fs::file_time_type::clock::now() - std::chrono::hours(5));
  ASSERT_TRUE(cache.store("abc", filled_model(4, 0.1)));
  EXPECT_FALSE(fs::exists(old));
  EXPECT_TRUE(fs::exists(fresh));  // someone may be writing it
}

TEST(ModelCache, ReadersSeeWholeFilesWhileWritersReplaceThem) {
  const TemporaryFolder folder;
  const ModelCache cache(folder.path());
  ASSERT_TRUE(cache.store("abc", filled_model(50, 0)));
  std::vector<std::thread> threads;
  for (int t = 0; t < 2; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; i < 50; ++i)
        EXPECT_TRUE(ModelCache(folder.path()).store("abc", filled_model(50, t + 0.01 * i)));
    });
    threads.emplace_back([&] {
      for (int i = 0; i < 50; ++i) EXPECT_TRUE(ModelCache(folder.path()).load("abc"));
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(files(folder.path()).size(), 1u);
}

TEST(ModelCache, EveryInputIsInTheKey) {
  const scene::Scene scene = test::bar(3, 10);
  std::vector<std::string> keys = {inline_key(scene)};
  EXPECT_EQ(inline_key(scene), keys[0]);
  const auto changed = [&](const std::function<void(scene::Scene&)>& change) {
    scene::Scene other = scene;
    change(other);
    keys.push_back(inline_key(other));
  };
  changed([](scene::Scene& s) { s.mesh.nodes(0, 9) += 1e-12; });
  changed([](scene::Scene& s) { s.mesh.tets.col(0).swap(s.mesh.tets.col(1)); });
  changed([](scene::Scene& s) { s.material.youngs_modulus *= 2; });
  changed([](scene::Scene& s) { s.material.poissons_ratio = 0.3; });
  changed([](scene::Scene& s) { s.material.density = 999; });
  changed([](scene::Scene& s) { s.fixed_nodes.pop_back(); });
  changed([](scene::Scene& s) { s.model.mode_count = 9; });
  changed([](scene::Scene& s) { s.model.tolerance = 0.02; });
  changed([](scene::Scene& s) { s.model.basis_size = 21; });
  changed([](scene::Scene& s) { s.model.cubature_size = 11; });
  changed([](scene::Scene& s) { s.model.cubature = scene::Cubature::kWeights; });
  changed([](scene::Scene& s) { s.length_unit_in_metres = 0.01; });
  std::sort(keys.begin(), keys.end());
  EXPECT_EQ(std::adjacent_find(keys.begin(), keys.end()), keys.end());
  // What the model does not depend on is not.
  scene::Scene other = scene;
  other.frame_count = 99;
  other.name = "other";
  other.constraints = {test::held(3, 5)};
  other.dynamics.period_frames = 7;
  EXPECT_EQ(inline_key(other), inline_key(scene));
}

TEST(ModelCacheSession, AHitSkipsTheBuildAndDamageRebuilds) {
  const TemporaryFolder folder;
  const auto cache = std::make_shared<ModelCache>(folder.path());
  const auto inline_executor = [](const std::function<void()>& task) { task(); };
  scene::Scene scene = test::bar(3, 12);
  scene.constraints = {test::held(6, test::bar_node(3, 3, 0, 0), {0, 0.03, 0})};
  const BodySession first("first", scene, {}, cache, inline_executor, nullptr);
  EXPECT_FALSE(first.model_from_cache());
  ASSERT_EQ(files(folder.path()).size(), 1u);
  const BodySession second("second", scene, {}, cache, inline_executor, nullptr);
  EXPECT_TRUE(second.model_from_cache());
  EXPECT_EQ(first.final_result()->modal, second.final_result()->modal);
  EXPECT_EQ(first.geometry()->basis_hash, second.geometry()->basis_hash);

  fs::resize_file(files(folder.path()).front(), 1000);
  const BodySession third("third", scene, {}, cache, inline_executor, nullptr);
  EXPECT_FALSE(third.model_from_cache());
  EXPECT_EQ(first.final_result()->modal, third.final_result()->modal);
  const BodySession fourth("fourth", scene, {}, cache, inline_executor, nullptr);
  EXPECT_TRUE(fourth.model_from_cache());
}

}  // namespace
}  // namespace limber::session
