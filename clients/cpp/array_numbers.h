#pragma once

#include <bit>
#include <cstddef>
#include <cstring>
#include <string>
#include <vector>

#include "clients/cpp/error.h"
#include "limber/v1/common.pb.h"

namespace limber::client {

static_assert(std::endian::native == std::endian::little,
              "the wire's numbers are used as they are");

/// The numbers of an array, row by row. @throws ClientError MALFORMED where it is of another type
/// or dimension, or its length does not fit its shape
template <class Number>
std::vector<Number> numbers(const v1::Array& array, v1::DataType type, int dimensions,
                            const std::string& what) {
  const auto malformed = [&](const char* how) {
    return ClientError(v1::ERROR_CODE_MALFORMED, "", what + how);
  };
  if (array.type() != type || array.shape_size() != dimensions)
    throw malformed(" are not of the type and dimension expected");
  // Without rows it does not matter how long they would be.
  const bool is_empty = dimensions > 0 && array.shape(0) == 0;
  std::size_t count = is_empty ? 0 : 1;
  for (int i = 0; !is_empty && i < dimensions; ++i) {
    const auto extent = array.shape(i);
    // Lengths come from bytes received, so no count beyond their number makes sense.
    if (extent > array.data().size()) throw malformed(" are shorter than their shape says");
    count *= extent;
    if (count > array.data().size()) throw malformed(" are shorter than their shape says");
  }
  if (count * sizeof(Number) != array.data().size())
    throw malformed(" do not have the length of their shape");
  std::vector<Number> values(count);
  if (count > 0) std::memcpy(values.data(), array.data().data(), array.data().size());
  return values;
}

/// The same of float32 or float64, which positions far from the origin are.
[[nodiscard]] inline std::vector<double> real_numbers(const v1::Array& array, int dimensions,
                                                      const std::string& what) {
  if (array.type() == v1::DATA_TYPE_FLOAT64)
    return numbers<double>(array, v1::DATA_TYPE_FLOAT64, dimensions, what);
  const auto single = numbers<float>(array, v1::DATA_TYPE_FLOAT32, dimensions, what);
  return {single.begin(), single.end()};
}

}  // namespace limber::client
