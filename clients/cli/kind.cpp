#include "clients/cli/kind.h"

#include <fmt/format.h>

#include "clients/cli/print.h"

namespace limber::cli {

bool Kind::is_of(const v1::SessionStatus& status) const { return status.kind() == name(); }

std::string Kind::sizes(const v1::SessionStatus& status) const {
  return "of the kind " + status.kind();
}

std::string Kind::describe(const v1::ResultInfo& result) const {
  return fmt::format(
      "revision          {}\n"
      "status            {}{}\n"
      "energy            {:.6g}\n"
      "since the edit    {:.2f} ms\n",
      result.revision(), status_words(result), result.converged() ? ", final" : "",
      result.total_energy(), result.since_edit_ms());
}

std::string Kind::summary(const v1::GetSessionResponse& session) const {
  const auto& status = session.status();
  return fmt::format("session {}, {}{}{}\n{}, revision {}\n", title(status), state_words(status),
                     status.message().empty() ? "" : ": ", status.message(), contents(session),
                     status.revision());
}

}  // namespace limber::cli
