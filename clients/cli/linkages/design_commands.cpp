// design: rest lengths, and sections, of a rod linkage for a surface or for targets, searched live.

#include <fmt/format.h>

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <utility>

#include "clients/cli/linkages/commands.h"
#include "clients/cli/linkages/design_report.h"
#include "clients/cli/receipt.h"
#include "clients/cpp/files.h"
#include "clients/cpp/linkages/design.h"
#include "clients/cpp/linkages/on_surface.h"
#include "clients/cpp/server.h"
#include "clients/cpp/stream.h"
#include "engine/base/checked_number.h"

namespace limber::cli::linkages {
namespace {

using client::ClientError;
using client::LinkageDesign;

constexpr client::Milliseconds kEndTimeout{600000};  // until a design that is stopped has ended

struct DesignOptions {
  std::string session, action = "start", surface;
  std::vector<double> targets;  // joint x y z, one after the other
  std::vector<double> translation, rotation;
  std::optional<double> scale, flat_share, distance_weight, surface_weight;
  std::optional<double> shortest, longest, flat_height, smallest_angle;
  std::optional<unsigned> iterations;
  std::string lengths, sections, guard;
  std::optional<double> thinnest, thickest, least_cover;
  bool detach = false;
  // For a linkage that begins with the surface alone:
  std::string grid, section;  // COLUMNSxROWS, WIDTHxHEIGHT
  bool same_place = false;
  std::optional<double> flat_angle, length_unit, youngs_modulus;
  std::optional<unsigned> edges;
};

template <class List>
void put_targets(const std::vector<double>& values, List& targets) {
  for (std::size_t i = 0; i + 3 < values.size(); i += 4) {
    const auto joint = to_whole<std::uint32_t>(values[i]);
    if (!joint) {
      throw ClientError(v1::ERROR_CODE_INVALID_ARGUMENT, "target",
                        fmt::format("a target is a joint and x y z, {:g} is no joint", values[i]));
    }
    auto& target = *targets.Add();
    target.set_joint(*joint);
    *target.mutable_position() = client::message({values[i + 1], values[i + 2], values[i + 3]});
  }
}

std::optional<v1::SurfacePlacement> placement(const DesignOptions& options) {
  if (options.translation.empty() && options.rotation.empty() && !options.scale) return {};
  v1::SurfacePlacement placement;
  if (!options.translation.empty())
    *placement.mutable_translation() = client::message(vector(options.translation));
  if (!options.rotation.empty())
    *placement.mutable_rotation_degrees() = client::message(vector(options.rotation));
  if (options.scale) placement.set_scale(*options.scale);
  return placement;
}

/// Common part of a goal and of its change.
template <class Message>
void put_goal(const DesignOptions& options, Message& message) {
  if (options.flat_share) message.set_flat_share(*options.flat_share);
  if (options.distance_weight) message.set_distance_weight(*options.distance_weight);
  if (options.surface_weight) message.set_surface_weight(*options.surface_weight);
  if (!options.surface.empty())
    *message.mutable_surface()->mutable_file() = client::mesh_file(options.surface, "surface");
  if (const auto placed = placement(options)) *message.mutable_placement() = *placed;
}

const std::map<std::string, v1::DesignLengths> kLengths{{"segments", v1::DESIGN_LENGTHS_SEGMENTS},
                                                        {"edges", v1::DESIGN_LENGTHS_EDGES},
                                                        {"kept", v1::DESIGN_LENGTHS_KEPT}};
const std::map<std::string, v1::DesignSections> kSections{
    {"kept", v1::DESIGN_SECTIONS_KEPT}, {"segments", v1::DESIGN_SECTIONS_SEGMENTS}};
const std::map<std::string, v1::DesignGuard> kGuards{{"when-needed", v1::DESIGN_GUARD_WHEN_NEEDED},
                                                     {"from-start", v1::DESIGN_GUARD_FROM_START},
                                                     {"never", v1::DESIGN_GUARD_NEVER}};

/// "8x6".
std::pair<double, double> pair_of(const std::string& text, const char* field) {
  std::istringstream stream(text);
  double a = 0, b = 0;
  char cross = 0;
  if (stream >> a >> cross >> b && cross == 'x' && stream.peek() == EOF && a > 0 && b > 0)
    return {a, b};
  throw ClientError(v1::ERROR_CODE_INVALID_ARGUMENT, field,
                    fmt::format("two positive numbers with an x between, not {}", text));
}

std::uint32_t count_of(double number, const char* field) {
  if (const auto count = to_whole<std::uint32_t>(number)) return *count;
  throw ClientError(v1::ERROR_CODE_INVALID_ARGUMENT, field, "whole numbers of joints");
}

/// A session of its own for a surface that there is no linkage for yet. @returns its design
v1::StartDesignRequest open_grid(Context& context, const DesignOptions& options) {
  if (options.surface.empty())
    throw ClientError(v1::ERROR_CODE_INVALID_ARGUMENT, "surface", "a grid is laid on a surface");
  for (const auto& [given, field] : {std::pair{!options.translation.empty(), "translation"},
                                     {!options.rotation.empty(), "rotation"}}) {
    if (given) {
      throw ClientError(v1::ERROR_CODE_INVALID_ARGUMENT, field,
                        "a grid begins on its surface, which is moved to where the grid is opened");
    }
  }
  v1::MakeStartingGridRequest grid;
  *grid.mutable_surface()->mutable_file() = client::mesh_file(options.surface, "surface");
  if (options.scale) grid.mutable_placement()->set_scale(*options.scale);
  const auto [columns, rows] = pair_of(options.grid, "grid");
  grid.set_columns(count_of(columns, "grid"));
  grid.set_rows(count_of(rows, "grid"));
  if (options.flat_angle) grid.set_flat_angle_degrees(*options.flat_angle);
  v1::Scene scene;
  scene.set_name(options.session);
  if (options.length_unit) scene.set_length_unit_in_metres(*options.length_unit);
  auto& linkage = *scene.mutable_linkage();
  const auto [width, height] = pair_of(options.section, "section");
  linkage.mutable_section()->mutable_rectangle()->set_width(width);
  linkage.mutable_section()->mutable_rectangle()->set_height(height);
  linkage.set_edges_per_segment(options.edges.value_or(6));
  if (options.youngs_modulus)
    linkage.mutable_material()->set_youngs_modulus(*options.youngs_modulus);
  client::SurfaceLinkage opened =
      client::open_on_surface(context.client(), std::move(grid), std::move(scene), options.session);
  if (!context.json) {
    fmt::print("session {}: a grid of {}, which lies flat\n", opened.session.id(), options.grid);
    if (!opened.remark.empty()) fmt::print("note: {}\n", opened.remark);
  }
  return std::move(opened.design);
}

/// Placement of the surface in the session's newest design.
v1::SurfacePlacement newest_place(LinkageDesign& design) {
  if (const auto newest = design.info()) return newest->placement();
  throw ClientError(v1::ERROR_CODE_FAILED_PRECONDITION, "same-place",
                    "the session has no design yet whose place could be taken");
}

/// @returns the job
std::uint64_t begin(LinkageDesign& design, const DesignOptions& options,
                    v1::StartDesignRequest request) {
  if (!options.lengths.empty()) request.set_lengths(kLengths.at(options.lengths));
  if (!options.sections.empty()) request.set_sections(kSections.at(options.sections));
  if (!options.guard.empty()) request.set_guard(kGuards.at(options.guard));
  if (options.thinnest) request.set_thinnest(*options.thinnest);
  if (options.thickest) request.set_thickest(*options.thickest);
  if (options.least_cover) request.set_least_cover(*options.least_cover);
  auto& goal = *request.mutable_goal();
  put_goal(options, goal);
  put_targets(options.targets, *goal.mutable_targets());
  if (options.shortest) request.set_shortest(*options.shortest);
  if (options.longest) request.set_longest(*options.longest);
  if (options.flat_height) request.set_flat_height(*options.flat_height);
  if (options.same_place) *goal.mutable_placement() = newest_place(design);
  if (options.flat_angle) request.set_flat_angle_degrees(*options.flat_angle);
  if (options.smallest_angle) request.set_smallest_angle_degrees(*options.smallest_angle);
  if (options.iterations) request.set_max_iterations(*options.iterations);
  return design.start(std::move(request));
}

void start_design(Context& context, const DesignOptions& options) {
  const bool is_new = !options.grid.empty();
  v1::StartDesignRequest request;
  if (is_new) request = open_grid(context, options);
  auto design = context.session<LinkageDesign>(options.session);
  const auto info = client::server_info(context.client());
  client::Subscription stream(context.client(), info);
  stream.subscribe(client::design_topic(options.session));
  v1::StartDesignResponse started;
  try {
    started.set_job(begin(design, options, std::move(request)));
  } catch (...) {  // no grid is left behind by a refused command
    if (is_new) context.session<client::OpenSession>(options.session).close();
    throw;
  }
  if (!options.detach) return follow_design(context, stream, design, started.job());
  if (context.json) return print_json(started);
  fmt::print("job {}\n", started.job());
}

void watch_design(Context& context, const DesignOptions& options) {
  auto design = context.session<LinkageDesign>(options.session);
  const auto info = client::server_info(context.client());
  client::Subscription stream(context.client(), info);
  stream.subscribe(client::design_topic(options.session));
  follow_design(context, stream, design, 0);
}

v1::ChangeDesignResponse change_design(LinkageDesign& design, const DesignOptions& options) {
  v1::ChangeDesignRequest request;
  put_goal(options, request);
  if (!options.targets.empty())
    put_targets(options.targets, *request.mutable_targets()->mutable_targets());
  return design.change(std::move(request));
}

void show_design(const Context& context, const v1::GetDesignResponse& newest) {
  if (context.json) return print_json(newest);
  if (!newest.has_design()) return fmt::print("no design\n");
  print_design(context, newest.design());
}

void print_done(const Context& context, const google::protobuf::Message& response,
                const std::string& done) {
  if (context.json) return print_json(response);
  fmt::print("{}\n", done);
}

void run(Context& context, const DesignOptions& options) {
  if (options.action == "start") return start_design(context, options);
  if (options.action == "watch") return watch_design(context, options);
  auto design = context.session<LinkageDesign>(options.session);
  if (options.action == "change")
    return print_done(context, change_design(design, options), "changed");
  if (options.action == "pause") return print_done(context, design.pause(), "paused");
  if (options.action == "resume") return print_done(context, design.resume(), "resumed");
  if (options.action == "stop") return print_done(context, design.stop(kEndTimeout), "stopped");
  if (options.action == "show") return show_design(context, design.newest());
  v1::TakeDesignResponse taken;
  taken.set_revision(design.take({}, kEndTimeout));
  print_done(context, taken, fmt::format("revision {}", taken.revision()));
}

void add_goal(CLI::App& command, DesignOptions& options) {
  command
      .add_option(
          "--surface", options.surface,
          "Triangles to deploy towards, .obj, .ply, .stl, .off or .glb, in the scene's length unit")
      ->check(CLI::ExistingFile);
  command.add_option("--translation", options.translation, "Move the surface by x y z")
      ->expected(3);
  command
      .add_option("--rotation", options.rotation,
                  "Turn it about an axis; x y z are its direction, their length the degrees")
      ->expected(3);
  command.add_option("--scale", options.scale, "Scale it (before it is moved)");
  command
      .add_option("--target", options.targets,
                  "A joint, from 0, and where it is wanted: JOINT X Y Z (may be repeated)")
      ->type_size(4)
      ->expected(1, 65536);
  command.add_option("--flat-share", options.flat_share,
                     "Weight of the flat shape's energy against the deployed one's, 0 to 1 "
                     "(default: 0.9)");
  command.add_option("--distance-weight", options.distance_weight,
                     "Weight of distances against energies (default: 1e5)");
  command.add_option("--surface-weight", options.surface_weight,
                     "Weight of the surface against targets (default: 1)");
}

void add_limits(CLI::App& command, DesignOptions& options) {
  command.add_option("--shortest", options.shortest,
                     "Bound of rest lengths, as a share of the start (default: 0.5)");
  command.add_option("--longest", options.longest, "The same (default: 2)");
  command.add_option("--flat-height", options.flat_height,
                     "Allowed rms height of the flat shape, as a share of its size (default: "
                     "a fifth more than at the start)");
  command.add_option("--flat-angle", options.flat_angle,
                     "Mean opening angle that the flat shape is held at, in degrees (default: "
                     "nothing holds it; of a --grid 25)");
  command.add_option(
      "--smallest-angle", options.smallest_angle,
      "Bound on the flat shape's opening angles in degrees (default: a tenth of the "
      "start's smallest where that lies open, else none; of a --grid half its flat angle)");
  command.add_option("--least-cover", options.least_cover,
                     "Share of the area of the start's cells (at most the surface's) that the "
                     "design keeps, 0 to 1 (default: 0.9)");
  command
      .add_option("--lengths", options.lengths,
                  "Rest lengths that are varied: segments (default), edges or kept")
      ->check(CLI::IsMember(kLengths));
  command
      .add_option("--sections", options.sections,
                  "kept (default), or segments: each gets a scale of its section")
      ->check(CLI::IsMember(kSections));
  command.add_option("--thinnest", options.thinnest,
                     "Bound of scales of sections, as a share of the start (default: 0.5)");
  command.add_option("--thickest", options.thickest, "The same (default: 2)");
  command
      .add_option("--guard", options.guard,
                  "Against buckling of the flat shape: when-needed (default), from-start or never")
      ->check(CLI::IsMember(kGuards));
  command.add_flag("--same-place", options.same_place,
                   "The surface stays where the session's newest design has it, as after --grid");
  command.add_option("--iterations", options.iterations, "Most steps (default: 200)");
  command.add_flag("--detach", options.detach, "Do not wait for the end");
}

void add_grid(CLI::App& command, DesignOptions& options) {
  auto* section =
      command.add_option("--section", options.section,
                         "WIDTHxHEIGHT of the grid's rods, in the surface's length unit");
  auto* grid = command
                   .add_option("--grid", options.grid,
                               "COLUMNSxROWS: opens SESSION as a grid of rods over the surface, "
                               "laid flat; so many joints along its longer sides, and across")
                   ->needs(section);
  section->needs(grid);
  command.add_option("--edges", options.edges, "Edges of each of its segments (default: 6)")
      ->needs(grid);
  command
      .add_option("--length-unit", options.length_unit, "Metres in one length unit (default: 1)")
      ->needs(grid);
  command.add_option("--youngs-modulus", options.youngs_modulus, "In Pa (default: 10e9)")
      ->needs(grid);
}

}  // namespace

void add_design_commands(CLI::App& app, Context& context) {
  auto options = std::make_shared<DesignOptions>();
  auto* command = subcommand(
      app, "design",
      "Search rest lengths with which a rod linkage lies flat and deploys towards a surface",
      "limber design shelter --surface hill.ply --translation 0 0 0.4\n"
      "  limber design new --surface hill.ply --grid 8x6 --section 0.02x0.004\n"
      "  limber design shelter --target 12 0 0 1.2 --target 40 1 0 0.8 --detach\n"
      "  limber design shelter watch        (from anywhere)\n"
      "  limber design shelter change --distance-weight 1e6\n"
      "  limber design shelter pause | resume | stop | take | show\n"
      "  limber undo shelter                (takes one that was taken back again)");
  command
      ->add_option("session", options->session, "Session of a rod linkage; with --grid a new one")
      ->required();
  command
      ->add_option("action", options->action,
                   "start (default), watch, change, pause, resume, stop, take or show")
      ->check(
          CLI::IsMember({"start", "watch", "change", "pause", "resume", "stop", "take", "show"}));
  add_goal(*command, *options);
  add_limits(*command, *options);
  add_grid(*command, *options);
  command->callback([&context, options] { run(context, *options); });
}

}  // namespace limber::cli::linkages
