#include "server/wire/explanation.h"

#include <fmt/format.h>

namespace limber::server {

void Explanation::choose(const std::string& name, const std::string& value, ChosenBy by,
                         const std::string& reason, const std::string& cost) {
  proto::ModelChoice* choice = response_.add_choices();
  choice->set_name(name);
  choice->set_value(value);
  choice->set_asked_for(by == ChosenBy::kScene);
  choice->set_reason(reason);
  choice->set_cost(cost);
}

void Explanation::choose(const std::string& name, double number, ChosenBy by,
                         const std::string& reason, const std::string& cost) {
  choose(name, fmt::format("{:g}", number), by, reason, cost);
  response_.mutable_choices()->rbegin()->set_number(number);
}

void Explanation::expect(const std::string& quantity, std::optional<double> value,
                         const std::string& unit, const std::string& method,
                         std::optional<double> tolerance) {
  proto::ExpectedError* error = response_.add_errors();
  error->set_quantity(quantity);
  if (value) error->set_value(*value);
  error->set_unit(unit);
  error->set_method(method);
  if (tolerance) error->set_tolerance(*tolerance);
}

void Explanation::advise(const std::string& goal, const std::string& change) {
  proto::Advice* advice = response_.add_advice();
  advice->set_goal(goal);
  advice->set_change(change);
}

std::string time_since_edit(const proto::ResultInfo& result) {
  return fmt::format("{:.3g} ms from the newest edit to this result", result.since_edit_ms());
}

}  // namespace limber::server
