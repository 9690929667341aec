#include "bench/stability/verdict.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace limber::bench::stability {
namespace {

constexpr double kLeastError = 1e-16;  // errors of exact zeros have a margin, too

Verdict verdict_of_finding(const Finding& finding) {
  Verdict verdict;
  verdict.reason = finding.message;
  if (std::isfinite(finding.error)) verdict.error = finding.error;
  if (!finding.is_finite || !verdict.error) {
    verdict.reason = fmt::format("numbers of the answer are not finite; {}", finding.message);
    return verdict;
  }
  if (finding.claim == Claim::kNotConverged) {
    if (finding.message.empty()) {
      verdict.reason = "not converged, and nothing says why";
    } else {
      verdict.outcome = Outcome::kSaidSo;
    }
    return verdict;
  }
  if (finding.error <= finding.allowed) {
    verdict.outcome = Outcome::kCertified;
    verdict.margin = finding.allowed / std::max(finding.error, kLeastError);
  } else {
    verdict.reason = fmt::format("claims convergence with an error of {:.3g} (limit {:.3g}); {}",
                                 finding.error, finding.allowed, finding.message);
  }
  return verdict;
}

}  // namespace

const char* to_string(Outcome outcome) noexcept {
  switch (outcome) {
    case Outcome::kCertified:
      return "certified";
    case Outcome::kSaidSo:
      return "not certified, said so";
    case Outcome::kRefused:
      return "refused with reason";
    case Outcome::kWrong:
      return "wrong";
    case Outcome::kHung:
      return "hang";
    case Outcome::kCrashed:
      return "crash";
  }
  return "";
}

bool is_fault(Outcome outcome) noexcept {
  return outcome == Outcome::kWrong || outcome == Outcome::kHung || outcome == Outcome::kCrashed;
}

Verdict verdict_of(const Ended& ended) {
  Verdict verdict;
  verdict.reason = ended.message;
  switch (ended.end) {
    case End::kAnswered:
      return verdict_of_finding(ended.finding);
    case End::kRefused:
      if (ended.message.empty()) {
        verdict.reason = "refused without a reason";
      } else {
        verdict.outcome = Outcome::kRefused;
      }
      return verdict;
    case End::kThrew:
      verdict.reason = "threw what is no Error: " + ended.message;
      return verdict;
    case End::kHung:
      verdict.outcome = Outcome::kHung;
      return verdict;
    case End::kCrashed:
      verdict.outcome = Outcome::kCrashed;
      return verdict;
  }
  return verdict;
}

}  // namespace limber::bench::stability
