#pragma once

#include <string>
#include <vector>

namespace limber::cli {

/// The command line as a person means it, for a parser that is more literal.
///
/// A public key that begins with `-` (`limber allow -...`) is put behind `--`.
///
/// `-.5` becomes `-0.5`, since it would be read as an option. Options that take several values
/// (`--node 3 4 5`, `--format pvd pc2`) end at the first word that cannot be one of theirs. That
/// word and the words after it, up to the next option, are moved to the place of positional
/// arguments, after the command. Else `limber add --node 3 4 flower --frame 2 ...` would take the
/// session for a node.
[[nodiscard]] std::vector<std::string> as_meant(std::vector<std::string> arguments);

}  // namespace limber::cli
