#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>

namespace limber::scene::formats {

/// Writes JSON text from its beginning to its end. Numbers read back to the same value; those that
/// are not finite are null, as JSON has no other word for them.
class JsonWriter {
 public:
  void begin_object() { begin('{'); }
  void end_object() { end('}'); }
  void begin_array() { begin('['); }
  void end_array() { end(']'); }
  /// Key of the next value, in an object.
  void key(std::string_view name);

  void value(std::string_view text);
  void value(const char* text) { value(std::string_view(text)); }
  void value(bool truth);
  void value(int number);
  void value(std::uint64_t number);
  void value(float number);
  void value(double number);
  void null();
  /// An array of a vector's numbers, on one line.
  void numbers(const Eigen::Ref<const Eigen::VectorXf>& values) { write_numbers(values); }
  void numbers(const Eigen::Ref<const Eigen::VectorXd>& values) { write_numbers(values); }

  template <class Value>
  void member(std::string_view name, const Value& of) {
    key(name);
    value(of);
  }

  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  void begin(char bracket);
  void end(char bracket);
  void separate();
  void quote(std::string_view text);
  template <class Number>
  void append(Number number);
  template <class Vector>
  void write_numbers(const Vector& values);

  std::string text_;
  int depth_ = 0;
  bool first_ = true, after_key_ = false;
};

}  // namespace limber::scene::formats
