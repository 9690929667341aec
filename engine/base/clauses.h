#pragma once

#include <string>

namespace limber {

/// Adds a clause to a message, behind "; " in place of a full stop that the message ends with.
/// Nothing is added where the clause is empty.
void append_clause(std::string& message, const std::string& clause);

/// Adds a sentence to a message, behind a full stop and a space. Nothing is added where the
/// sentence is empty.
void add_sentence(std::string& message, const std::string& sentence);

}  // namespace limber
