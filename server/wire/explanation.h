#pragma once

#include <optional>
#include <string>

#include "limber/v1/service.pb.h"

namespace limber::server {

namespace proto = limber::v1;

/// The source of a choice of size or method.
enum class ChosenBy { kScene, kLimber };

/// Puts together what ExplainRequest is answered with.
class Explanation {
 public:
  explicit Explanation(std::uint64_t revision) { response_.set_revision(revision); }

  /// @param value  in words  @param cost  with units; empty: none worth a word
  void choose(const std::string& name, const std::string& value, ChosenBy by,
              const std::string& reason, const std::string& cost = "");
  void choose(const std::string& name, double number, ChosenBy by, const std::string& reason,
              const std::string& cost = "");
  /// @param value  nothing: not known, and `method` says how it will be
  /// @param unit  empty: relative
  void expect(const std::string& quantity, std::optional<double> value, const std::string& unit,
              const std::string& method, std::optional<double> tolerance = {});
  void advise(const std::string& goal, const std::string& change);

  [[nodiscard]] const proto::ExplainResponse& response() const { return response_; }

 private:
  proto::ExplainResponse response_;
};

/// The time of the newest result, as the cost of a path of solves: "0.4 ms to the first answer".
[[nodiscard]] std::string time_since_edit(const proto::ResultInfo& result);

}  // namespace limber::server
