#pragma once

#include <CLI/CLI.hpp>
#include <istream>
#include <map>
#include <string>
#include <vector>

namespace limber::server {

/// The file of `--config`: one `option = value` a line, of the options of the command line by their
/// long names. A part of TOML: strings, numbers, true and false, arrays of these, comments; no
/// tables. What is not that is refused with file and line.
class ConfigFile : public CLI::Config {
 public:
  /// @param app  whose options they are
  explicit ConfigFile(const CLI::App& app) : app_(app) {}

  /// @throws CLI::ConfigError
  std::vector<CLI::ConfigItem> from_config(std::istream& in) const override;
  /// All options that a file may have, with what they are for; those that are at their defaults as
  /// comments.
  std::string to_config(const CLI::App* app, bool, bool, std::string) const override;

  /// Of each such option the value in force, as the file would have it.
  [[nodiscard]] static std::map<std::string, std::string> values(const CLI::App& app);

 private:
  const CLI::App& app_;
};

}  // namespace limber::server
