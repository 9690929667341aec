// Files of the cache of models. An input is a whole file where it begins as one does; else it is
// what stands between head and hash, which are put around it: damage that the hash does not show.
#include <string>

#include "engine/base/hash.h"
#include "engine/reduced/model_file.h"
#include "tests/fuzz/input.h"

namespace {

using namespace limber;

constexpr std::string_view kMagic = "limberRS";

template <class Number>
void append(std::string& bytes, Number number) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

std::string file_of(std::string_view content) {
  std::string bytes(kMagic);
  append(bytes, reduced::kModelFormatVersion);
  append(bytes, std::uint64_t{content.size()});
  bytes += content;
  const auto hash = ContentHash().add(std::string_view(bytes)).digest();
  bytes.append(reinterpret_cast<const char*>(hash.data()), hash.size());
  return bytes;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes = fuzz::text_of(data, size);
  const std::string file = bytes.starts_with(kMagic) ? std::string(bytes) : file_of(bytes);
  fuzz::reads([&] {
    const std::string written = reduced::encode_model(reduced::decode_model(file));
    if (written != reduced::encode_model(reduced::decode_model(written)))
      fuzz::finding("a model that was written is not read as it was");
  });
  return 0;
}
