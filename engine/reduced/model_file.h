#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "engine/reduced/reduced_model.h"

namespace limber::reduced {

/// Raised whenever build_model would give another model for the same inputs, or the bytes change
/// meaning. Part of the key of any cache.
inline constexpr std::uint32_t kModelFormatVersion = 8;

/// A model as bytes: magic, version, length, fields (little-endian, doubles by their bits), and a
/// 128-bit hash of all that precedes.
[[nodiscard]] std::string encode_model(const ReducedModel& model);

/// The model whose bytes these are.
/// @throws Error{kInvalidArgument} for bytes that are damaged, cut or not a model;
/// Error{kUnsupported} for another
///   version. Never reads past the end, never allocates more than a few times the size of the
///   bytes.
[[nodiscard]] ReducedModel decode_model(std::string_view bytes);

}  // namespace limber::reduced
