#include "clients/cli/limberd.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

#include "clients/cli/context.h"

namespace limber::cli {

void become_limberd(std::vector<std::string> arguments) {
  const std::string limberd = find_limberd();
  arguments.insert(arguments.begin(), "limber");
  std::vector<char*> argv;
  argv.reserve(arguments.size() + 1);
  for (auto& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  std::fflush(nullptr);
  execv(limberd.c_str(), argv.data());
  throw client::ClientError(v1::ERROR_CODE_NOT_FOUND, "limberd",
                            fmt::format("cannot run {}", limberd));
}

}  // namespace limber::cli
