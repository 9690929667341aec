#pragma once

#include <memory>
#include <optional>
#include <string_view>

#include "engine/scene/formats/json_reader.h"
#include "engine/scene/formats/text_cursor.h"

namespace limber::scene::formats {

/// Numbers that a glTF file has for each of its vertices or corners, decoded on request: the sizes
/// that a file claims allocate no memory.
class GlbAccessor {
 public:
  /// A component of an element: its size, the number that bytes are, and its greatest value.
  struct Component {
    std::int64_t bytes = 0;
    double (*read)(const char*) = nullptr;
    double greatest = 1;
  };
  /// Elements at equal distances.
  struct Elements {
    std::string_view bytes;
    std::int64_t count = 0, stride = 0;

    [[nodiscard]] const char* at(std::int64_t element) const {
      return bytes.data() + element * stride;
    }
  };

  [[nodiscard]] std::int64_t count() const { return count_; }
  /// @param element  in [0, count)
  [[nodiscard]] double value(std::int64_t element, std::int64_t component = 0) const;

 private:
  friend class GlbFile;

  Component component_, index_;
  bool is_normalised_ = false;
  std::int64_t count_ = 0;
  Elements elements_;              // none: 0, but for replacements
  Elements places_, replaced_by_;  // of a sparse accessor: elements in rising order, and values
};

/// A binary glTF 2.0 file: its chunks, and checked access to what its JSON says.
class GlbFile {
 public:
  /// @param file, content  outlive this
  /// @throws Error through `file`, as all that follows: also for extensions that the file requires
  /// and that change its numbers
  GlbFile(const TextCursor& file, std::string_view content);
  GlbFile(const GlbFile&) = delete;
  GlbFile& operator=(const GlbFile&) = delete;
  ~GlbFile();

  [[nodiscard]] const Json& document() const { return *document_; }
  [[nodiscard]] std::int64_t size() const { return size_; }
  /// An array of an object; an empty one where it is absent.
  [[nodiscard]] const Json& list(const Json& object, const char* name) const;
  /// The object of this number in a list. @param what  an entry, for messages
  [[nodiscard]] const Json& entry(const Json& list, std::int64_t number, const char* what) const;
  /// The entry of a list of the document whose number is the member `name` of an object.
  [[nodiscard]] const Json& entry_of(const char* lists, const Json& object, const char* name) const;
  /// A whole number from 0 to the bytes of the file: sums of two do not overflow.
  [[nodiscard]] std::int64_t whole(const Json& value, const char* name) const;
  [[nodiscard]] std::int64_t member(const Json& object, const char* name,
                                    std::optional<std::int64_t> absent = {}) const;
  /// The accessor whose number is the member `name`.
  /// @param type, width  that it must have: "VEC3", 3
  [[nodiscard]] GlbAccessor accessor(const Json& object, const char* name, const char* type,
                                     std::int64_t width) const;

 private:
  [[nodiscard]] std::string_view take_chunk(std::string_view& rest, std::uint32_t type,
                                            const char* name) const;
  void check_extensions() const;
  [[nodiscard]] GlbAccessor::Component component(const Json& object) const;
  [[nodiscard]] GlbAccessor::Elements elements(const Json& object, std::int64_t count,
                                               std::int64_t bytes) const;

  const TextCursor& file_;
  std::int64_t size_ = 0;
  std::unique_ptr<const Json> document_;
  std::string_view binary_;
};

}  // namespace limber::scene::formats
