#include "clients/cli/linkages/design_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "clients/cli/print.h"

namespace limber::cli::linkages {
namespace {

using client::Milliseconds;

std::string end_words(const v1::DesignInfo& info) {
  std::string text = words(v1::DesignEnd_Name(info.end()), "DESIGN_END_");
  if (info.has_taken_revision())
    text += fmt::format(", taken as revision {}", info.taken_revision());
  if (!info.message().empty()) text += ": " + info.message();
  return text;
}

void print_heading() {
  fmt::print(
      "rms in the scene's length unit\n{:>5}  {:>12}  {:>11}  {:>11}  {:>11}  {:>7}  {:>9}  "
      "{:>11}\n",
      "step", "objective", "target rms", "surface rms", "energy [J]", "cover", "flat",
      "angle [deg]");
}

void print_step(const Context& context, const v1::DesignInfo& info) {
  if (context.json) return print_json(info);
  const auto& now = info.now();
  const char* const mark = info.state() == v1::DESIGN_STATE_PAUSED    ? "paused"
                           : !now.holds()                             ? "constraints do not hold"
                           : !info.refusal().empty()                  ? "not believed"
                           : info.iteration() > 0 && !info.accepted() ? "refused"
                                                                      : "";
  fmt::print("{:>5}  {:>12.6g}  {:>11.4g}  {:>11.4g}  {:>11.4g}  {:>7}  {:>9.2e}  {:>11.2f}  {}\n",
             info.iteration(), now.objective(), now.target_rms(), now.surface_rms(),
             now.deployed_energy(),
             info.has_surface() ? fmt::format("{:.1f} %", 100 * now.cover()) : "-",
             now.flat_height(), now.smallest_angle_degrees(), mark);
}

void print_other(const v1::DesignInfo& info, const v1::OtherOptimum& other) {
  fmt::print(
      "another optimum: job {} ended with objective {:.6g}, here {:.6g}; target rms {:.4g}, "
      "surface "
      "rms {:.4g}; sizes differ by up to {:.2g} %, deployed shapes by {:.4g}\n",
      other.job(), other.terms().objective(), info.best().objective(), other.terms().target_rms(),
      other.terms().surface_rms(), 100 * other.size_difference(), other.deployed_distance());
}

/// Forces that a builder has to apply.
void print_erection(const v1::LinkageErection& erection) {
  fmt::print("opens from flat to {:.4g} degrees {}\n", erection.mean_angle_degrees(),
             erection.push_size() == 0
                 ? "by itself"
                 : "pushed out of its plane along the path, as deploy does it");
  if (erection.path_moments_size() > 0)
    fmt::print(
        "moment on every joint that holds it (positive opens; the last one without the push)\n"
        "{:>11}  {:>12}\n",
        "angle [deg]", "moment [N m]");
  for (int i = 0; i < std::min(erection.path_moments_size(), erection.path_degrees_size()); ++i)
    fmt::print("{:>11.2f}  {:>12.5g}\n", erection.path_degrees(i), erection.path_moments(i));
  if (!erection.has_support()) return;
  const auto &force = erection.support().force(), &moment = erection.support().moment();
  fmt::print(
      "joint {} is held meanwhile: it takes up to ({:.4g}, {:.4g}, {:.4g}) N and ({:.4g}, {:.4g}, "
      "{:.4g}) N m\n",
      erection.support().joint(), force.x(), force.y(), force.z(), moment.x(), moment.y(),
      moment.z());
}

void print_end(const Context& context, const v1::DesignInfo& info) {
  if (context.json) return print_json(info);
  fmt::print("{}\n", end_words(info));
  const auto &before = info.start(), &best = info.best();
  if (info.end() == v1::DESIGN_END_FAILED) return;
  if (info.flat_lost() > 0)
    fmt::print("refused: {} trials whose flat shape had buckled\n", info.flat_lost());
  for (const auto& other : info.other_optima()) print_other(info, other);
  if (info.has_surface()) {
    fmt::print(
        "cover: the linkage's cells have an area of {:.4g}, {:.1f} % of the start's {:.4g}\n",
        best.covered_area(), 100 * best.cover(), before.covered_area());
  }
  if (!info.erection().failure().empty()) {
    fmt::print("no way to open it from flat is known: {}\n", info.erection().failure());
  } else if (info.has_erection()) {
    print_erection(info.erection());
  }
  fmt::print("best: step {}, target rms {:.4g} (was {:.4g}), surface rms {:.4g} (was {:.4g})\n",
             info.best_iteration(), best.target_rms(), before.target_rms(), best.surface_rms(),
             before.surface_rms());
}

}  // namespace

void print_design(const Context& context, const v1::DesignInfo& info) {
  const bool ended = info.state() == v1::DESIGN_STATE_ENDED;
  fmt::print("{}\n",
             ended ? end_words(info) : words(v1::DesignState_Name(info.state()), "DESIGN_STATE_"));
  print_heading();
  print_step(context, info);
}

void follow_design(Context& context, client::Subscription& stream, client::LinkageDesign& design,
                   std::uint64_t job) {
  if (!context.json) print_heading();
  std::optional<v1::DesignInfo> last;
  const auto show_design = [&](const v1::DesignInfo& info) {
    if (job != 0 && info.job() != job) return false;
    const bool news = !last || info.iteration() != last->iteration() ||
                      info.state() != last->state() ||
                      info.distance_weight() != last->distance_weight();
    last = info;
    if (info.state() == v1::DESIGN_STATE_ENDED) return true;
    if (news && info.state() != v1::DESIGN_STATE_STARTING && info.has_now())
      print_step(context, info);
    return false;
  };
  while (true) {
    const auto event = stream.next(Milliseconds{500});
    if (event && event->message.has_design()) {
      if (!show_design(event->message.design())) continue;
    } else if (const auto newest = design.info(); !newest || !show_design(*newest)) {
      continue;
    }
    print_end(context, *last);
    if (last->end() == v1::DESIGN_END_FAILED) context.exit_code = kRefused;
    return;
  }
}

}  // namespace limber::cli::linkages
