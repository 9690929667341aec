#include "engine/reduced/model_file.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>

#include "engine/base/error.h"
#include "engine/base/hash.h"

namespace limber::reduced {
namespace {

static_assert(std::endian::native == std::endian::little, "models are written little-endian");

constexpr std::string_view kMagic = "limberRS";  // first bytes of a file
constexpr std::size_t kHashSize = 16;            // bytes

[[noreturn]] void refuse(const std::string& what) {
  throw Error(ErrorCode::kInvalidArgument, "model_file", "reduced model file: " + what);
}

std::array<std::uint8_t, kHashSize> hash_of(std::string_view bytes) {
  return ContentHash().add(bytes).digest();
}

class Writer {
 public:
  template <class T>
  void number(T value) {
    raw(&value, sizeof value);
  }
  void text(const std::string& value) {
    number<std::uint64_t>(value.size());
    raw(value.data(), value.size());
  }
  void matrix(const Eigen::Ref<const Eigen::MatrixXd>& value) {
    number<std::uint64_t>(static_cast<std::uint64_t>(value.rows()));
    number<std::uint64_t>(static_cast<std::uint64_t>(value.cols()));
    for (Eigen::Index k = 0; k < value.cols(); ++k) {
      raw(value.col(k).data(), sizeof(double) * static_cast<std::size_t>(value.rows()));
    }
  }
  void raw(const void* data, std::size_t size) {
    bytes_.append(static_cast<const char*>(data), size);
  }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}

  template <class T>
  T number(const char* field) {
    T value;
    raw(&value, sizeof value, field);
    return value;
  }
  std::uint64_t count(const char* field, std::size_t item_size) {
    const auto value = number<std::uint64_t>(field);
    if (value > bytes_.size() / item_size) refuse(fmt::format("{} is longer than the file", field));
    return value;
  }
  std::string text(const char* field) {
    std::string value(count(field, 1), '\0');
    raw(value.data(), value.size(), field);
    return value;
  }
  Eigen::MatrixXd matrix(const char* field) {
    const auto rows = number<std::uint64_t>(field), cols = number<std::uint64_t>(field);
    const std::uint64_t room = bytes_.size() / sizeof(double);
    if (rows > room || cols > std::max<std::uint64_t>(room, 1) ||
        (cols > 0 && rows > room / cols)) {
      refuse(fmt::format("{} is longer than the file", field));
    }
    Eigen::MatrixXd value(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(cols));
    raw(value.data(), sizeof(double) * static_cast<std::size_t>(value.size()), field);
    if (!value.allFinite()) refuse(fmt::format("{} has a number that is not finite", field));
    return value;
  }
  void raw(void* data, std::size_t size, const char* field) {
    if (size > bytes_.size()) refuse(fmt::format("ends inside {}", field));
    if (size > 0) std::memcpy(data, bytes_.data(), size);
    bytes_.remove_prefix(size);
  }
  [[nodiscard]] bool at_end() const { return bytes_.empty(); }

 private:
  std::string_view bytes_;
};

void write_report(const ModelReport& report, Writer& out) {
  for (double value :
       {report.basis_error_mean, report.error_mean, report.error_max, report.small_error_mean,
        report.modes_s, report.poses_s, report.basis_s, report.cubature_s}) {
    out.number(value);
  }
  out.number<std::uint8_t>(report.met_tolerance ? 1 : 0);
  out.number<std::int32_t>(static_cast<std::int32_t>(report.basis));
  out.number<std::int32_t>(report.compared_size);
  for (const auto& error : {report.snapshot_basis_error, report.derivative_basis_error}) {
    out.number<std::uint8_t>(error ? 1 : 0);
    out.number(error.value_or(0));
  }
  out.text(report.message);
}

ModelReport read_report(Reader& in) {
  ModelReport report;
  for (double* value :
       {&report.basis_error_mean, &report.error_mean, &report.error_max, &report.small_error_mean,
        &report.modes_s, &report.poses_s, &report.basis_s, &report.cubature_s}) {
    *value = in.number<double>("report");
  }
  report.met_tolerance = in.number<std::uint8_t>("report") != 0;
  const auto basis = in.number<std::int32_t>("report");
  if (basis < 0 || basis > static_cast<std::int32_t>(BasisKind::kMapDerivatives))
    refuse("report has no such kind of basis");
  report.basis = static_cast<BasisKind>(basis);
  report.compared_size = in.number<std::int32_t>("report");
  for (auto* error : {&report.snapshot_basis_error, &report.derivative_basis_error}) {
    const bool there = in.number<std::uint8_t>("report") != 0;
    const auto value = in.number<double>("report");
    if (there) *error = value;
  }
  report.message = in.text("report.message");
  return report;
}

void check_shapes(const ReducedModel& m) {
  const Eigen::Index r = m.eigenvalues.size(), h = m.basis.cols();
  const auto t9 = static_cast<Eigen::Index>(9 * m.tets.size());
  const auto expect = [](const char* field, const Eigen::MatrixXd& matrix, Eigen::Index rows,
                         Eigen::Index cols) {
    if (matrix.rows() != rows || matrix.cols() != cols) {
      refuse(fmt::format("{} is {} x {}, expected {} x {}", field, matrix.rows(), matrix.cols(),
                         rows, cols));
    }
  };
  if (m.node_count <= 0 || !(m.length > 0) || (m.rigid_count != 0 && m.rigid_count != 6) ||
      r < m.rigid_count || m.mechanism_count < 0 || m.mechanism_count > r - m.rigid_count) {
    refuse("sizes are impossible");
  }
  expect("modes", m.modes, 3 * Eigen::Index{m.node_count}, r);
  expect("basis", m.basis, 3 * Eigen::Index{m.node_count}, h);
  expect("rs_modes", m.rs_modes, t9, r);
  expect("map", m.map, h, t9);
  expect("direct", m.direct, h, r);
  for (int tet : m.tets) {
    if (tet < 0) refuse("a cubature tet has a negative id");
  }
}

}  // namespace

std::string encode_model(const ReducedModel& model) {
  Writer body;
  body.number<std::int32_t>(model.node_count);
  body.number(model.length);
  body.number<std::int32_t>(model.rigid_count);
  body.number<std::int32_t>(model.mechanism_count);
  body.matrix(model.eigenvalues);
  body.matrix(model.modes);
  body.matrix(model.basis);
  body.number<std::uint64_t>(model.tets.size());
  for (int tet : model.tets) body.number<std::int32_t>(tet);
  body.matrix(model.rs_modes);
  body.matrix(model.map);
  body.matrix(model.direct);
  write_report(model.report, body);
  const std::string content = body.take();

  Writer file;
  file.raw(kMagic.data(), kMagic.size());
  file.number(kModelFormatVersion);
  file.number<std::uint64_t>(content.size());
  file.raw(content.data(), content.size());
  std::string bytes = file.take();
  const auto hash = hash_of(bytes);
  bytes.append(reinterpret_cast<const char*>(hash.data()), hash.size());
  return bytes;
}

ReducedModel decode_model(std::string_view bytes) {
  if (bytes.size() < kMagic.size() || bytes.substr(0, kMagic.size()) != kMagic)
    refuse("not a reduced model");
  Reader in(bytes.substr(kMagic.size()));
  const auto version = in.number<std::uint32_t>("version");
  if (version != kModelFormatVersion) {
    throw Error(ErrorCode::kUnsupported, "model_file",
                fmt::format("reduced model file: version {}, this build reads {}", version,
                            kModelFormatVersion));
  }
  const auto size = in.number<std::uint64_t>("length");
  const std::size_t header = kMagic.size() + sizeof version + sizeof size;
  if (bytes.size() < header + kHashSize || size != bytes.size() - header - kHashSize)
    refuse("cut or padded");
  const auto hash = hash_of(bytes.substr(0, bytes.size() - kHashSize));
  if (std::memcmp(hash.data(), bytes.data() + bytes.size() - kHashSize, kHashSize) != 0)
    refuse("damaged (hash differs)");

  in = Reader(bytes.substr(header, size));
  ReducedModel model;
  model.node_count = in.number<std::int32_t>("node_count");
  model.length = in.number<double>("length");
  model.rigid_count = in.number<std::int32_t>("rigid_count");
  model.mechanism_count = in.number<std::int32_t>("mechanism_count");
  const Eigen::MatrixXd eigenvalues = in.matrix("eigenvalues");
  if (eigenvalues.cols() != 1) refuse("eigenvalues is not a vector");
  model.eigenvalues = eigenvalues;
  model.modes = in.matrix("modes");
  model.basis = in.matrix("basis");
  model.tets.resize(in.count("tets", sizeof(std::int32_t)));
  for (int& tet : model.tets) tet = in.number<std::int32_t>("tets");
  model.rs_modes = in.matrix("rs_modes");
  model.map = in.matrix("map");
  model.direct = in.matrix("direct");
  model.report = read_report(in);
  if (!in.at_end()) refuse("has bytes after its end");
  check_shapes(model);
  return model;
}

}  // namespace limber::reduced
