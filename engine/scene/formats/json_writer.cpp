#include "engine/scene/formats/json_writer.h"

#include <charconv>
#include <cmath>
#include <cstdint>

namespace limber::scene::formats {

void JsonWriter::separate() {
  if (after_key_) {
    after_key_ = false;
    return;
  }
  if (!first_) text_ += ',';
  if (depth_ > 0) {
    text_ += '\n';
    text_.append(static_cast<std::size_t>(depth_), ' ');
  }
  first_ = false;
}

void JsonWriter::begin(char bracket) {
  separate();
  text_ += bracket;
  ++depth_;
  first_ = true;
}

void JsonWriter::end(char bracket) {
  --depth_;
  if (!first_) {
    text_ += '\n';
    text_.append(static_cast<std::size_t>(depth_), ' ');
  }
  text_ += bracket;
  first_ = false;
  if (depth_ == 0) text_ += '\n';
}

void JsonWriter::quote(std::string_view text) {
  constexpr char kHex[] = "0123456789abcdef";
  text_ += '"';
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      text_ += '\\';
      text_ += c;
    } else if (code < 0x20) {
      text_ += "\\u00";
      text_ += kHex[code >> 4U];
      text_ += kHex[code & 15U];
    } else {
      text_ += c;
    }
  }
  text_ += '"';
}

template <class Number>
void JsonWriter::append(Number number) {
  char digits[32];
  text_.append(digits, std::to_chars(digits, digits + sizeof digits, number).ptr);
}

void JsonWriter::key(std::string_view name) {
  separate();
  quote(name);
  text_ += ": ";
  after_key_ = true;
}

void JsonWriter::value(std::string_view text) {
  separate();
  quote(text);
}
void JsonWriter::value(bool truth) {
  separate();
  text_ += truth ? "true" : "false";
}
void JsonWriter::value(int number) {
  separate();
  append(number);
}
void JsonWriter::value(std::uint64_t number) {
  separate();
  append(number);
}
void JsonWriter::value(float number) {
  if (!std::isfinite(number)) return null();
  separate();
  append(number);
}
void JsonWriter::value(double number) {
  if (!std::isfinite(number)) return null();
  separate();
  append(number);
}
void JsonWriter::null() {
  separate();
  text_ += "null";
}

template <class Vector>
void JsonWriter::write_numbers(const Vector& values) {
  separate();
  text_ += '[';
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    if (i > 0) text_ += ", ";
    if (std::isfinite(values[i])) {
      append(values[i]);
    } else {
      text_ += "null";
    }
  }
  text_ += ']';
}

template void JsonWriter::write_numbers(const Eigen::Ref<const Eigen::VectorXf>&);
template void JsonWriter::write_numbers(const Eigen::Ref<const Eigen::VectorXd>&);

}  // namespace limber::scene::formats
