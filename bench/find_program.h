#pragma once

#include <string>

namespace limber::bench {

/// A program that is built with this one: the given path, if any; else in the folder of this
/// program, else on PATH.
/// @throws std::runtime_error that says where was looked
[[nodiscard]] std::string find_program(const std::string& name, const std::string& given);

}  // namespace limber::bench
