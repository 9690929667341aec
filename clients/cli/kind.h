#pragma once

#include <string>

#include "limber/v1/service.pb.h"

namespace limber::cli {

namespace v1 = limber::v1;

/// Texts of the command line about sessions of one kind. The base class has those of sessions of
/// all kinds, for a kind that limber.v1 does not know.
class Kind {
 public:
  Kind() = default;
  Kind(const Kind&) = delete;
  Kind& operator=(const Kind&) = delete;
  virtual ~Kind() = default;

  /// As in SessionStatus.kind.
  [[nodiscard]] virtual const char* name() const { return ""; }
  [[nodiscard]] virtual bool is_of(const v1::SessionStatus& status) const;

  /// "384 tets, 100 nodes, 60 frames".
  [[nodiscard]] virtual std::string sizes(const v1::SessionStatus& status) const;
  /// A result that is a solution, as lines "name  value".
  [[nodiscard]] virtual std::string describe(const v1::ResultInfo& result) const;
  /// End of a line about a result: ", motion error 2 %".
  [[nodiscard]] virtual std::string remark(const v1::ResultInfo& /*result*/) const { return ""; }

  // `limber show`: lines in front of the newest result, and behind it.
  [[nodiscard]] virtual std::string summary(const v1::GetSessionResponse& session) const;
  [[nodiscard]] virtual std::string conditions(const v1::GetSessionResponse& /*session*/) const {
    return "";
  }

  // Cells of `limber list`.
  [[nodiscard]] virtual std::string listed_sizes(const v1::SessionStatus& status) const {
    return sizes(status);
  }
  [[nodiscard]] virtual std::string listed_conditions(const v1::SessionStatus& /*status*/) const {
    return "-";
  }
  [[nodiscard]] virtual std::string listed_angle(const v1::SessionStatus& /*status*/) const {
    return "-";
  }
  /// "J"; empty: it has none.
  [[nodiscard]] virtual std::string energy_unit() const { return ""; }

  // `limber watch`: a column of the kind's own.
  [[nodiscard]] virtual std::string watched_heading() const { return ""; }
  [[nodiscard]] virtual std::string watched_value(const v1::ResultInfo& /*result*/) const {
    return "-";
  }
  /// Whether the energy of a result is known before it is final.
  [[nodiscard]] virtual bool has_energy_of_iterates() const { return true; }

  /// Assumptions, in words, of a scene that was made of a file of its shape alone.
  [[nodiscard]] virtual std::string assumptions(const v1::Scene& /*scene*/) const { return ""; }

 protected:
  /// "384 tets, 100 nodes, 2 constraints", for `limber show`.
  [[nodiscard]] virtual std::string contents(const v1::GetSessionResponse& session) const {
    return sizes(session.status());
  }
};

}  // namespace limber::cli
