#include "engine/scene/formats/vtu_arrays.h"

#include <pugixml.hpp>

#include <zlib.h>

#include <limits>
#include <type_traits>

#include "engine/base/checked_number.h"
#include "engine/scene/formats/base64.h"

namespace limber::scene::formats {
namespace {

/// No array of a mesh we can compute with comes near; keeps sums of claims from overflowing.
constexpr std::size_t kMaxArrayBytes = std::size_t{1} << 30;

class VtuArray {
 public:
  VtuArray(const pugi::xml_node& node, const VtuEncoding& encoding, const TextCursor& file,
           ArrayBudget& budget)
      : node_(node),
        encoding_(encoding),
        file_(file),
        budget_(budget),
        format_(node.attribute("format").as_string("ascii")),
        type_(node.attribute("type").as_string()) {}

  template <typename Number>
  std::vector<Number> read() const {
    if (format_ == "ascii") return read_ascii<Number>();
    if (type_ == "Float32") return read_stored<float, Number>();
    if (type_ == "Float64") return read_stored<double, Number>();
    if (type_ == "Int8") return read_stored<std::int8_t, Number>();
    if (type_ == "UInt8") return read_stored<std::uint8_t, Number>();
    if (type_ == "Int16") return read_stored<std::int16_t, Number>();
    if (type_ == "UInt16") return read_stored<std::uint16_t, Number>();
    if (type_ == "Int32") return read_stored<std::int32_t, Number>();
    if (type_ == "UInt32") return read_stored<std::uint32_t, Number>();
    if (type_ == "Int64") return read_stored<std::int64_t, Number>();
    if (type_ == "UInt64") return read_stored<std::uint64_t, Number>();
    fail("has the unknown type " + in_quotes(type_), ErrorCode::kUnsupported);
  }

 private:
  [[noreturn]] void fail(const std::string& what,
                         ErrorCode code = ErrorCode::kInvalidArgument) const {
    const std::string name = node_.attribute("Name").as_string(node_.parent().name());
    file_.fail_at(file_.line(), "the data array " + in_quotes(name) + " " + what, code);
  }

  template <typename Number>
  std::vector<Number> read_ascii() const {
    TextCursor text(file_.name() + ", data array " + in_quotes(node_.attribute("Name").as_string()),
                    node_.text().get());
    std::vector<Number> result;
    while (text.skip_blanks()) {
      if constexpr (std::is_same_v<Number, double>) {
        result.push_back(text.real("a number"));
      } else {
        result.push_back(text.integer("a whole number"));
      }
    }
    budget_.take(result.size() * sizeof(Number), file_);  // a few times its text at most
    return result;
  }

  template <typename Stored, typename Number>
  std::vector<Number> read_stored() const {
    // Decoded bytes and the numbers made of them are there at the same time.
    const auto take = [this](std::uint64_t bytes) {
      budget_.take(bytes + bytes / sizeof(Stored) * sizeof(Number), file_);
    };
    return convert<Stored, Number>(encoding_.zlib ? compressed_bytes(take) : plain_bytes(take));
  }

  template <typename Stored, typename Number>
  std::vector<Number> convert(const std::string& bytes) const {
    if (bytes.size() % sizeof(Stored) != 0) fail("is cut off in the middle of a number");
    std::vector<Number> result(bytes.size() / sizeof(Stored));
    for (std::size_t i = 0; i < result.size(); ++i) {
      const Stored value = decode<Stored>(bytes.data() + i * sizeof(Stored), encoding_.order);
      if constexpr (std::is_floating_point_v<Number>) {
        result[i] = static_cast<Number>(value);
      } else {
        // Ids as floating-point numbers: some writers do it.
        const auto id = to_whole<Number>(value);
        if (!id) fail("holds a value that is no id");
        result[i] = *id;
      }
    }
    return result;
  }

  /// The first `size` bytes of the array as stored (before decompression), or fewer if the file
  /// ends.
  std::string stored_bytes(std::size_t size) const {
    if (format_ == "binary") return from_base64(node_.text().get(), size);
    if (format_ != "appended")
      fail("has the unknown format " + in_quotes(format_), ErrorCode::kUnsupported);
    const auto offset = parse_number<std::size_t>(trim(node_.attribute("offset").as_string()));
    if (!offset || *offset > encoding_.appended.size()) fail("begins outside of the appended data");
    const std::string_view data = encoding_.appended.substr(*offset);
    if (!encoding_.appended_base64) return std::string(data.substr(0, size));
    return from_base64(data.substr(0, data.find('<')), size);
  }

  std::string from_base64(std::string_view text, std::size_t size) const {
    std::optional<std::string> bytes = decode_base64(text, size);
    if (!bytes) fail("is not valid base64");
    return std::move(*bytes);
  }

  std::uint64_t header_entry(const std::string& bytes, std::size_t index) const {
    const char* const at = bytes.data() + index * encoding_.header_bytes;
    return encoding_.header_bytes == 8 ? decode<std::uint64_t>(at, encoding_.order)
                                       : decode<std::uint32_t>(at, encoding_.order);
  }

  /// @param take  called with the decoded size
  template <class Take>
  std::string plain_bytes(const Take& take) const {
    const std::size_t header = encoding_.header_bytes;
    const std::string first = stored_bytes(header);
    if (first.size() < header) fail("ends inside its header");
    const std::uint64_t size = header_entry(first, 0);
    if (size > kMaxArrayBytes)
      fail("claims " + std::to_string(size) + " bytes", ErrorCode::kLimitExceeded);
    take(size);
    std::string bytes = stored_bytes(header + static_cast<std::size_t>(size));
    if (bytes.size() != header + size) fail("is cut off");
    return bytes.substr(header);
  }

  /// Header: number of blocks, size of a block, size of the last block if shorter (else 0),
  /// compressed sizes.
  template <class Take>
  std::string compressed_bytes(const Take& take) const {
    const std::size_t entry = encoding_.header_bytes;
    const std::string first = stored_bytes(3 * entry);
    if (first.size() < 3 * entry) fail("ends inside its header");
    const std::uint64_t blocks = header_entry(first, 0);
    const std::uint64_t block_size = header_entry(first, 1);
    const std::uint64_t last_size = header_entry(first, 2);
    if (blocks == 0) return {};
    if (blocks > file_.remaining() + encoding_.appended.size() || block_size > kMaxArrayBytes ||
        last_size > block_size ||
        blocks > kMaxArrayBytes / std::max<std::uint64_t>(block_size, 1) + 1) {
      fail("claims " + std::to_string(blocks) + " blocks of " + std::to_string(block_size) +
               " bytes",
           ErrorCode::kLimitExceeded);
    }
    take((blocks - 1) * block_size + (last_size != 0 ? last_size : block_size));
    const std::size_t header = static_cast<std::size_t>(3 + blocks) * entry;
    const std::string sizes = stored_bytes(header);
    if (sizes.size() < header) fail("ends inside its header");
    std::uint64_t total = header;
    for (std::uint64_t i = 0; i < blocks; ++i) {
      const std::uint64_t size = header_entry(sizes, static_cast<std::size_t>(3 + i));
      if (size > kMaxArrayBytes || (total += size) > kMaxArrayBytes)
        fail("claims too many bytes", ErrorCode::kLimitExceeded);
    }
    const std::string bytes = stored_bytes(static_cast<std::size_t>(total));
    if (bytes.size() != total) fail("is cut off");
    std::string result;
    std::size_t position = header;
    for (std::uint64_t i = 0; i < blocks; ++i) {
      const bool shorter = i + 1 == blocks && last_size != 0;
      const std::size_t size =
          static_cast<std::size_t>(header_entry(sizes, static_cast<std::size_t>(3 + i)));
      append_inflated(std::string_view(bytes).substr(position, size),
                      shorter ? last_size : block_size, result);
      position += size;
    }
    return result;
  }

  void append_inflated(std::string_view packed, std::uint64_t size, std::string& result) const {
    // zlib cannot expand by more than 1032: a claim beyond it need not be allocated to be refused.
    if (size > 1032 * static_cast<std::uint64_t>(packed.size()) + 64)
      fail("has a block of impossible size");
    const std::size_t begin = result.size();
    result.resize(begin + static_cast<std::size_t>(size));
    uLongf written = static_cast<uLongf>(size);
    const int status = uncompress(reinterpret_cast<Bytef*>(result.data() + begin), &written,
                                  reinterpret_cast<const Bytef*>(packed.data()),
                                  static_cast<uLong>(packed.size()));
    if (status != Z_OK || written != size) fail("has a block that zlib cannot decompress");
  }

  pugi::xml_node node_;
  const VtuEncoding& encoding_;
  const TextCursor& file_;
  ArrayBudget& budget_;
  std::string format_;
  std::string type_;
};

}  // namespace

void ArrayBudget::take(std::uint64_t bytes, const TextCursor& file) {
  if (bytes > left_) {
    file.fail_at(file.line(),
                 "the data arrays take more than " + std::to_string(bytes_ >> 20) +
                     " MiB once decoded, which is the limit of one file",
                 ErrorCode::kLimitExceeded);
  }
  left_ -= static_cast<std::size_t>(bytes);
}

std::vector<double> read_real_array(const pugi::xml_node& array, const VtuEncoding& encoding,
                                    const TextCursor& file, ArrayBudget& budget) {
  return VtuArray(array, encoding, file, budget).read<double>();
}

std::vector<std::int64_t> read_integer_array(const pugi::xml_node& array,
                                             const VtuEncoding& encoding, const TextCursor& file,
                                             ArrayBudget& budget) {
  return VtuArray(array, encoding, file, budget).read<std::int64_t>();
}

}  // namespace limber::scene::formats
