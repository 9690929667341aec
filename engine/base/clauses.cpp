#include "engine/base/clauses.h"

namespace limber {

void append_clause(std::string& message, const std::string& clause) {
  if (clause.empty()) return;
  if (message.ends_with('.')) message.pop_back();
  if (!message.empty()) message += "; ";
  message += clause;
}

void add_sentence(std::string& message, const std::string& sentence) {
  if (!message.empty() && !sentence.empty()) message += message.back() == '.' ? " " : ". ";
  message += sentence;
}

}  // namespace limber
