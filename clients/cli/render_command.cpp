// render: pictures and films of a session, made by the Python client and a browser without a
// display.

#include <fmt/format.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "clients/cli/context.h"
#include "clients/cli/python.h"

namespace limber::cli {
namespace {

struct RenderLine {
  std::string session, output, size = "1280x720", up, surface;
  int frame = -1;
  double rate = 0;
  std::vector<double> view;
};

void render(const Context& context, const RenderLine& options) {
  demand_no_keys(context, "render");
  std::vector<std::string> words{options.session, "-o", options.output, "--size", options.size};
  words.push_back(fmt::format("--frame={}", options.frame));
  if (options.rate > 0) words.push_back(fmt::format("--rate={}", options.rate));
  if (!options.up.empty()) words.push_back("--up=" + options.up);
  if (!options.surface.empty()) words.push_back("--surface=" + options.surface);
  if (!options.view.empty()) {
    words.emplace_back("--view");
    for (const double angle : options.view) words.push_back(fmt::format("{}", angle));
  }
  run_python(context, "render", std::move(words));
}

}  // namespace

void add_render_command(CLI::App& app, Context& context) {
  auto options = std::make_shared<RenderLine>();
  auto* command =
      subcommand(app, "render",
                 "Draw a session as the page does, without a display: a picture of a frame, or a "
                 "film. Needs the Python client and Chromium, for films ffmpeg",
                 "limber render flower -o flower.mp4 --size 1280x720");
  command->add_option("session", options->session)->required();
  command->add_option("-o,--output", options->output, "File: .png, .jpg, .mp4, .webm, .gif")
      ->required();
  command->add_option("--frame", options->frame, "Of a picture; -1: the last one")
      ->capture_default_str();
  command->add_option("--size", options->size, "WIDTHxHEIGHT in pixels")->capture_default_str();
  command->add_option("--view", options->view, "Azimuth and elevation of the eye [degree]")
      ->expected(2);
  command->add_option("--up", options->up, "Of the scene: y (default of bodies) or z")
      ->check(CLI::IsMember({"y", "z"}));
  command
      ->add_option("--rate", options->rate,
                   "Frames a second (default: the scene's, of linkages and beams 24)")
      ->check(CLI::PositiveNumber);
  command->add_option("--surface", options->surface,
                      "An .obj drawn around the tets of a body, which follows them");
  command->callback([&context, options] { render(context, *options); });
}

}  // namespace limber::cli
