#include "engine/reduced/model_file.h"

#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/base/random.h"
#include "tests/engine/reduced/random_values.h"

namespace limber::reduced {
namespace {

using testing::random_matrix;

ReducedModel some_model() {
  Random random(5);
  ReducedModel model;
  model.node_count = 11;
  model.length = 2.5;
  model.rigid_count = 6;
  model.mechanism_count = 1;
  model.eigenvalues = random_matrix(9, 1, random).cwiseAbs();
  model.modes = random_matrix(33, 9, random);
  model.basis = random_matrix(33, 7, random);
  model.tets = {4, 0, 17};
  model.rs_modes = random_matrix(27, 9, random);
  model.map = random_matrix(7, 27, random);
  model.direct = random_matrix(7, 9, random);
  model.report.error_mean = 0.0123;
  model.report.met_tolerance = false;
  model.report.message = "0.0123 > 0.01";
  model.report.basis = BasisKind::kMapDerivatives;
  model.report.compared_size = 7;
  model.report.derivative_basis_error = 0.004;
  return model;
}

TEST(ModelFile, ComesBackBitForBit) {
  const ReducedModel model = some_model();
  const std::string bytes = encode_model(model);
  const ReducedModel back = decode_model(bytes);
  EXPECT_EQ(bytes, encode_model(back));
  EXPECT_EQ(model.node_count, back.node_count);
  EXPECT_EQ(model.rigid_count, back.rigid_count);
  EXPECT_EQ(model.mechanism_count, back.mechanism_count);
  EXPECT_EQ(model.modes, back.modes);
  EXPECT_EQ(model.basis, back.basis);
  EXPECT_EQ(model.tets, back.tets);
  EXPECT_EQ(model.rs_modes, back.rs_modes);
  EXPECT_EQ(model.map, back.map);
  EXPECT_EQ(model.direct, back.direct);
  EXPECT_EQ(model.eigenvalues, back.eigenvalues);
  EXPECT_EQ(model.report.message, back.report.message);
  EXPECT_FALSE(back.report.met_tolerance);
  EXPECT_EQ(model.report.basis, back.report.basis);
  EXPECT_EQ(7, back.report.compared_size);
  EXPECT_EQ(model.report.derivative_basis_error, back.report.derivative_basis_error);
  EXPECT_FALSE(back.report.snapshot_basis_error.has_value());
}

ErrorCode code_of(std::string_view bytes) {
  try {
    (void)decode_model(bytes);
  } catch (const Error& error) {
    EXPECT_EQ("model_file", error.field());
    return error.code();
  }
  ADD_FAILURE() << "damaged bytes were accepted";
  return ErrorCode::kInternal;
}

TEST(ModelFile, EveryCutIsRefused) {
  const std::string bytes = encode_model(some_model());
  for (std::size_t size = 0; size < bytes.size(); size += size < 200 ? 1 : 37) {
    EXPECT_EQ(ErrorCode::kInvalidArgument, code_of(std::string_view(bytes).substr(0, size)));
  }
  EXPECT_EQ(ErrorCode::kInvalidArgument, code_of(bytes + "x"));
}

TEST(ModelFile, EveryChangedByteIsRefused) {
  const std::string bytes = encode_model(some_model());
  for (std::size_t i = 0; i < bytes.size(); i += i < 100 ? 1 : 13) {
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x10);
    const bool in_version = i >= 8 && i < 12;
    EXPECT_EQ(in_version ? ErrorCode::kUnsupported : ErrorCode::kInvalidArgument, code_of(damaged))
        << i;
  }
}

TEST(ModelFile, TwoThousandRandomFlipsAreRefused) {
  const std::string bytes = encode_model(some_model());
  Random random(2000);
  for (int trial = 0; trial < 2000; ++trial) {
    std::string damaged = bytes;
    const auto flips = 1 + random.index(4);
    for (std::uint64_t k = 0; k < flips; ++k) {
      auto& byte = damaged[random.index(damaged.size())];
      byte = static_cast<char>(byte ^ static_cast<char>(1 + random.index(255)));
    }
    try {
      EXPECT_EQ(bytes, encode_model(decode_model(damaged))) << trial;  // flips may cancel
    } catch (const Error& error) {
      EXPECT_EQ("model_file", error.field()) << trial;
    }
  }
}

// A hash proves no good will: sizes are checked as well.
TEST(ModelFile, HostileSizesWithARightHashAreRefused) {
  const std::string good = encode_model(some_model());
  for (std::size_t at = 20; at + 16 + 8 < good.size(); at += 4) {
    for (std::uint64_t value :
         {~std::uint64_t{0}, std::uint64_t{1} << 61, std::uint64_t{1} << 33, std::uint64_t{12}}) {
      std::string bytes = good.substr(0, good.size() - 16);
      bytes.replace(at, 8, reinterpret_cast<const char*>(&value), 8);
      const auto hash = ContentHash().add(std::string_view(bytes)).digest();
      bytes.append(reinterpret_cast<const char*>(hash.data()), hash.size());
      try {
        (void)decode_model(bytes);  // a changed coefficient is a model again, but nothing may crash
      } catch (const Error& error) {
        EXPECT_EQ(ErrorCode::kInvalidArgument, error.code());
      }
    }
  }
}

}  // namespace
}  // namespace limber::reduced
