#pragma once

#include <CLI/CLI.hpp>
#include <istream>
#include <map>
#include <string>
#include <vector>

namespace limber::server {

/// The file of `--config`: one `option = value` a line, of the options of the command line by their
/// long names. A part of TOML: strings, numbers, true and false, arrays of these, comments; no
/// tables. Anything else is refused with file and line.
class ConfigFile : public CLI::Config {
 public:
  /// @param app  the app with these options
  explicit ConfigFile(const CLI::App& app) : app_(app) {}

  /// @throws CLI::ConfigError
  std::vector<CLI::ConfigItem> from_config(std::istream& in) const override;
  /// All options that a file may have, with their descriptions; options at their defaults are
  /// comments.
  std::string to_config(const CLI::App* app, bool, bool, std::string) const override;

  /// The value in force of each such option, in the file's notation.
  [[nodiscard]] static std::map<std::string, std::string> values(const CLI::App& app);

 private:
  const CLI::App& app_;
};

}  // namespace limber::server
