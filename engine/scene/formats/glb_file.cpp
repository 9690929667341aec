#include "engine/scene/formats/glb_file.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "engine/base/checked_number.h"
#include "engine/scene/formats/byte_reader.h"

namespace limber::scene::formats {
namespace {

constexpr std::size_t kHeaderBytes = 12, kChunkHeaderBytes = 8;
constexpr std::uint32_t kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;
// The parsed document takes several times the bytes of its text.
constexpr std::size_t kMaxJsonBytes = std::size_t{64} << 20;

template <class T>
double read_as(const char* bytes) {
  return static_cast<double>(decode<T>(bytes, ByteOrder::kLittle));
}

std::optional<GlbAccessor::Component> component_of(std::uint64_t type) {
  using Component = GlbAccessor::Component;
  switch (type) {
    case 5120:
      return Component{1, read_as<std::int8_t>, 127};
    case 5121:
      return Component{1, read_as<std::uint8_t>, 255};
    case 5122:
      return Component{2, read_as<std::int16_t>, 32767};
    case 5123:
      return Component{2, read_as<std::uint16_t>, 65535};
    case 5125:
      return Component{4, read_as<std::uint32_t>, 4294967295.0};
    case 5126:
      return Component{4, read_as<float>, 1};
    default:
      return std::nullopt;
  }
}

/// Extensions that change how surfaces look, not where they are.
bool is_of_looks(std::string_view name) {
  return name.starts_with("KHR_materials_") || name.starts_with("KHR_texture_") ||
         name.starts_with("EXT_texture_") || name.starts_with("KHR_lights_");
}

}  // namespace

double GlbAccessor::value(std::int64_t element, std::int64_t component) const {
  const char* from = elements_.count > 0 ? elements_.at(element) : nullptr;
  std::int64_t low = 0, high = places_.count;
  while (low < high) {
    const std::int64_t middle = (low + high) / 2;
    if (index_.read(places_.at(middle)) < static_cast<double>(element))
      low = middle + 1;
    else
      high = middle;
  }
  if (low < places_.count && index_.read(places_.at(low)) == static_cast<double>(element))
    from = replaced_by_.at(low);
  if (from == nullptr) return 0;
  const double value = component_.read(from + component * component_.bytes);
  return is_normalised_ ? std::max(value / component_.greatest, -1.0) : value;
}

GlbFile::GlbFile(const TextCursor& file, std::string_view content) : file_(file) {
  if (content.size() < kHeaderBytes || content.substr(0, 4) != "glTF")
    file_.fail("no binary glTF file: it does not begin with 'glTF'");
  const auto version = decode<std::uint32_t>(content.data() + 4, ByteOrder::kLittle);
  if (version != 2) {
    file_.fail_at(1, "glTF of version " + std::to_string(version) + "; version 2 is read",
                  ErrorCode::kUnsupported);
  }
  const std::size_t length = decode<std::uint32_t>(content.data() + 8, ByteOrder::kLittle);
  if (length < kHeaderBytes || length > content.size()) {
    file_.fail("the file has " + std::to_string(content.size()) + " bytes, its header says " +
               std::to_string(length));
  }
  size_ = static_cast<std::int64_t>(length);
  std::string_view rest = content.substr(kHeaderBytes, length - kHeaderBytes);
  const std::string_view json = take_chunk(rest, kJsonChunk, "JSON");
  if (json.size() > kMaxJsonBytes) {
    file_.fail_at(1,
                  "the JSON has " + std::to_string(json.size()) + " bytes (limit " +
                      std::to_string(kMaxJsonBytes) + ")",
                  ErrorCode::kLimitExceeded);
  }
  document_ = std::make_unique<const Json>(
      parse_object(json, [&](const std::string& why) { file_.fail("the JSON " + why); }));
  if (!rest.empty()) binary_ = take_chunk(rest, kBinaryChunk, "BIN");
  check_extensions();
}

GlbFile::~GlbFile() = default;

std::string_view GlbFile::take_chunk(std::string_view& rest, std::uint32_t type,
                                     const char* name) const {
  if (rest.size() < kChunkHeaderBytes) file_.fail(std::string("there is no chunk ") + name);
  const std::size_t size = decode<std::uint32_t>(rest.data(), ByteOrder::kLittle);
  if (decode<std::uint32_t>(rest.data() + 4, ByteOrder::kLittle) != type)
    file_.fail(std::string("the chunk ") + name + " is not where it belongs");
  rest.remove_prefix(kChunkHeaderBytes);
  if (size > rest.size()) file_.fail(std::string("the file ends inside the chunk ") + name);
  const std::string_view chunk = rest.substr(0, size);
  rest.remove_prefix(size);
  return chunk;
}

void GlbFile::check_extensions() const {
  for (const Json& required : list(*document_, "extensionsRequired")) {
    if (!required.is_string()) file_.fail("extensionsRequired has an entry that is no text");
    const auto& name = required.get_ref<const std::string&>();
    if (is_of_looks(name) || name == "KHR_mesh_quantization") continue;
    const bool is_compressed =
        name == "KHR_draco_mesh_compression" || name == "EXT_meshopt_compression";
    file_.fail_at(1,
                  "the file requires the extension " + in_quotes(name) + ", which is not read" +
                      (is_compressed ? ": export it without compression of meshes" : ""),
                  ErrorCode::kUnsupported);
  }
}

const Json& GlbFile::list(const Json& object, const char* name) const {
  static const Json kNone = Json::array();
  const auto found = object.find(name);
  if (found == object.end()) return kNone;
  if (!found->is_array()) file_.fail(std::string(name) + " is no list");
  return *found;
}

const Json& GlbFile::entry(const Json& list, std::int64_t number, const char* what) const {
  const auto at = to_whole<std::size_t>(number);
  if (!at || *at >= list.size()) {
    file_.fail(std::string(what) + " " + std::to_string(number) + " (from 0) of " +
               std::to_string(list.size()));
  }
  if (!list[*at].is_object()) file_.fail(std::string("an entry of ") + what + " is no object");
  return list[*at];
}

const Json& GlbFile::entry_of(const char* lists, const Json& object, const char* name) const {
  return entry(list(*document_, lists), member(object, name), name);
}

std::int64_t GlbFile::whole(const Json& value, const char* name) const {
  std::optional<std::int64_t> number;
  if (const auto* integer = value.get_ptr<const Json::number_unsigned_t*>())
    number = to_whole<std::int64_t>(*integer);
  else if (const auto* real = value.get_ptr<const Json::number_float_t*>())
    number = to_whole<std::int64_t>(*real);
  if (!number || *number < 0 || *number > size_)
    file_.fail(std::string(name) + " is no number that this file can have");
  return *number;
}

std::int64_t GlbFile::member(const Json& object, const char* name,
                             std::optional<std::int64_t> absent) const {
  const auto found = object.find(name);
  if (found != object.end()) return whole(*found, name);
  if (!absent) file_.fail(std::string(name) + " is missing");
  return *absent;
}

GlbAccessor::Component GlbFile::component(const Json& object) const {
  const auto found = object.find("componentType");
  const auto* const type =
      found == object.end() ? nullptr : found->get_ptr<const Json::number_unsigned_t*>();
  const auto component = type == nullptr ? std::nullopt : component_of(*type);
  if (!component) file_.fail("a componentType is none of glTF");
  return *component;
}

/// @param object  names a buffer view and where elements of `bytes` begin in it
GlbAccessor::Elements GlbFile::elements(const Json& object, std::int64_t count,
                                        std::int64_t bytes) const {
  const Json& view = entry_of("bufferViews", object, "bufferView");
  const Json& buffer = entry_of("buffers", view, "buffer");
  if (buffer.contains("uri") || &buffer != &list(*document_, "buffers")[0]) {
    file_.fail_at(1, "a buffer is not in this file: export with all data in one .glb",
                  ErrorCode::kUnsupported);
  }
  const std::int64_t begin = member(view, "byteOffset", 0), size = member(view, "byteLength");
  if (std::cmp_greater(begin + size, binary_.size()))
    file_.fail("a buffer view reaches beyond the bytes of the file");
  const std::int64_t offset = member(object, "byteOffset", 0);
  const std::int64_t stride = member(view, "byteStride", bytes);
  if (stride < bytes) file_.fail("a byteStride is less than an element");
  if (count == 0) return {{}, 0, stride};
  if (offset + bytes > size || count - 1 > (size - offset - bytes) / stride)
    file_.fail("an accessor reaches beyond its buffer view");
  return {binary_.substr(static_cast<std::size_t>(begin + offset)), count, stride};
}

GlbAccessor GlbFile::accessor(const Json& object, const char* name, const char* type,
                              std::int64_t width) const {
  const Json& given = entry_of("accessors", object, name);
  const auto found_type = given.find("type");
  if (found_type == given.end() || *found_type != type)
    file_.fail(std::string("the accessor ") + name + " is not of the type " + type);
  GlbAccessor result;
  result.count_ = member(given, "count");
  result.component_ = component(given);
  result.is_normalised_ = given.contains("normalized") && given["normalized"] == true;
  const std::int64_t bytes = width * result.component_.bytes;
  if (given.contains("bufferView")) result.elements_ = elements(given, result.count_, bytes);
  const auto sparse = given.find("sparse");
  if (sparse == given.end()) return result;
  const auto part_of = [&](const char* part) -> const Json& {
    const auto found = sparse->find(part);
    if (found == sparse->end()) file_.fail(std::string("a sparse accessor has no ") + part);
    return *found;
  };
  const std::int64_t replaced = member(*sparse, "count");
  result.index_ = component(part_of("indices"));
  result.places_ = elements(part_of("indices"), replaced, result.index_.bytes);
  result.replaced_by_ = elements(part_of("values"), replaced, bytes);
  return result;
}

}  // namespace limber::scene::formats
