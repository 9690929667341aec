#pragma once

#include <string>

namespace limber::bench {

/// A program that is built with this one: the path that was given, if one was; else beside this
/// program, else on PATH.
/// @throws std::runtime_error that says where was looked
[[nodiscard]] std::string find_program(const std::string& name, const std::string& given);

}  // namespace limber::bench
