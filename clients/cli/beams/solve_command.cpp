// beams: structures of beams, solved in one go.

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>
#include <vector>

#include "clients/cli/beams/commands.h"
#include "clients/cli/beams/words.h"
#include "clients/cli/jobs.h"
#include "clients/cli/print.h"
#include "clients/cpp/array_numbers.h"
#include "clients/cpp/beams/files.h"
#include "clients/cpp/error.h"
#include "clients/cpp/files.h"
#include "clients/cpp/server.h"

namespace limber::cli::beams {
namespace {

namespace fs = std::filesystem;
using client::ClientError;

const std::map<std::string, v1::BeamMethod> kMethods = {
    {"choose", v1::BEAM_METHOD_UNSPECIFIED},
    {"newton", v1::BEAM_METHOD_NEWTON},
    {"relaxation", v1::BEAM_METHOD_RELAXATION},
    {"relaxation-then-newton", v1::BEAM_METHOD_RELAXATION_THEN_NEWTON}};

const std::map<std::string, v1::BeamFileFormat> kFormats = {{".vtu", v1::BEAM_FILE_FORMAT_VTU},
                                                            {".csv", v1::BEAM_FILE_FORMAT_CSV},
                                                            {".json", v1::BEAM_FILE_FORMAT_JSON}};

struct BeamOptions {
  std::string file, method = "choose";
  std::vector<std::string> exports;
  double wait_s = 3600;
  bool follow = false, without_estimate = false;
};

ClientError bad_file(const fs::path& path, const std::string& field, const std::string& why) {
  return {v1::ERROR_CODE_INVALID_ARGUMENT, field, path.string() + ": " + why};
}

void read_source(const std::string& path, v1::SolveBeamsRequest& request) {
  v1::BeamScene scene = client::load_beams(path);
  if (scene.has_lines())
    throw bad_file(path, "beams.lines",
                   "its nodes come from a file of lines, which sessions read: limber open " + path);
  if (scene.has_job()) {
    *request.mutable_job() = std::move(*scene.mutable_job());
  } else {
    *request.mutable_structure() = std::move(*scene.mutable_structure());
  }
}

/// Asks for the formats of the files; names are given when they are written.
void ask_for_files(const BeamOptions& options, v1::SolveBeamsRequest& request) {
  for (const auto& path : options.exports) {
    const auto format = kFormats.find(fs::path(path).extension().string());
    if (format == kFormats.end())
      throw bad_file(path, "export", "a .vtu, .csv or .json is expected");
    const fs::path folder = fs::path(path).parent_path();
    if (!folder.empty() && !fs::is_directory(folder))
      throw ClientError(v1::ERROR_CODE_IO, "export", "there is no folder " + folder.string());
    request.add_files(format->second);
  }
}

/// @returns what was written: FILE.vtu, FILE.json; of FILE.csv three tables, FILE_nodes.csv and so
/// on
std::vector<std::string> write_files(const BeamOptions& options, const v1::GetJobResponse& job) {
  std::vector<std::string> written;
  for (const auto& path : options.exports) {
    const fs::path wanted(path);
    const std::string stem = (wanted.parent_path() / wanted.stem()).string();
    for (const auto& file : job.files()) {
      if (fs::path(file.name()).extension() != wanted.extension()) continue;
      written.push_back(stem + file.name().substr(std::strlen("beams")));
      client::write_bytes(written.back(), file.content());
    }
  }
  return written;
}

/// "in element 3 at 0.500 of its length"
std::string place_words(std::size_t element, double place) {
  return fmt::format("in element {} at {:.3f} of its length", element, place);
}

/// The largest bending moment of all elements, within them too.
void print_moment(const v1::BeamSolution& answer) {
  constexpr std::size_t kComponents = 6, kValues = 4, kMoment2 = 4;
  const auto extremes =
      client::numbers<double>(answer.element_extremes(), v1::DATA_TYPE_FLOAT64, 3, "extremes");
  double largest = 0;
  std::string text;
  for (std::size_t e = 0; kComponents * kValues * e < extremes.size(); ++e) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double* const of = &extremes[kValues * (kComponents * e + kMoment2 + axis)];
      for (const std::size_t i : {0, 2}) {
        if (std::abs(of[i]) <= largest) continue;
        largest = std::abs(of[i]);
        text = fmt::format("{:.3g} N m about axis {}, {}", largest, axis + 2,
                           place_words(e, of[i + 1]));
      }
    }
  }
  if (!text.empty()) fmt::print("moment       {}\n", text);
}

void print_utilisation(const v1::BeamSolution& answer) {
  if (!(answer.largest_utilisation() > 0)) return;
  constexpr std::size_t kColumns = 5, kUtilisation = 4;
  const auto stresses =
      client::numbers<double>(answer.element_stresses(), v1::DATA_TYPE_FLOAT64, 2, "stresses");
  const auto places =
      client::numbers<double>(answer.governing_places(), v1::DATA_TYPE_FLOAT64, 1, "places");
  std::size_t worst = 0;
  for (std::size_t e = 0; e < places.size(); ++e) {
    if (stresses[kColumns * e + kUtilisation] > stresses[kColumns * worst + kUtilisation])
      worst = e;
  }
  fmt::print("utilisation  {:.3g}, {}{}\n", answer.largest_utilisation(),
             place_words(worst, places.at(worst)), overload_words(answer.largest_utilisation()));
}

void print_solution(const v1::GetJobResponse& response) {
  const v1::BeamSolution& answer = response.beams();
  const auto& energies = answer.energies();
  const double total =
      energies.stretching() + energies.torsion() + energies.bending_2() + energies.bending_3();
  fmt::print("status       {}{}, residual {:.2g}\n",
             words(v1::BeamStatus_Name(answer.status()), "BEAM_STATUS_"),
             inertia_words(answer.negative_eigenvalues()), answer.residual());
  fmt::print("method       {}: {} steps of relaxation, {} of Newton's\n",
             words(v1::BeamMethod_Name(answer.method()), "BEAM_METHOD_"), answer.relaxation_steps(),
             answer.newton_iterations());
  fmt::print("structure    {} nodes, {} elements\n", answer.positions().shape(0),
             answer.elements().shape(0));
  fmt::print("energy       {:.6g} J  (stretching {:.4g} + torsion {:.4g} + bending {:.4g})\n",
             total, energies.stretching(), energies.torsion(),
             energies.bending_2() + energies.bending_3());
  print_moment(answer);
  print_utilisation(answer);
  if (response.has_discretisation_error())
    fmt::print("elements     {}\n", discretisation_words(response.discretisation_error()));
  for (const auto& snap : answer.snaps()) fmt::print("snap         {}\n", snap_words(snap));
  for (const auto& direction : answer.neutral_directions())
    fmt::print("neutral      {}\n", neutral_words(direction));
  if (answer.unjudged_elements_size() > 0)
    fmt::print("not judged   {}\n", unjudged_words(answer.unjudged_elements()));
  if (!answer.message().empty()) fmt::print("{}\n", answer.message());
}

void solve(Context& context, const BeamOptions& options) {
  v1::SolveBeamsRequest request;
  read_source(options.file, request);
  request.set_method(kMethods.at(options.method));
  request.set_follow(options.follow);
  request.set_estimate(!options.without_estimate);
  ask_for_files(options, request);
  const std::uint64_t job = client::start_job(context.client(), request);
  v1::GetJobResponse response;
  try {
    response = follow_job(context, job, options.wait_s, "beams");
  } catch (const ClientError&) {
    cancel_quietly(context, job);
    throw;
  }
  for (const auto& issue : response.issues()) fmt::print(stderr, "{}\n", describe(issue));
  const auto written = write_files(options, response);
  if (response.beams().status() != v1::BEAM_STATUS_CONVERGED) context.exit_code = kRefused;
  if (context.json) return print_json(response.beams());
  print_solution(response);
  for (const auto& file : written) fmt::print("  {}\n", file);
}

}  // namespace

void add_solve_command(CLI::App& app, Context& context) {
  auto options = std::make_shared<BeamOptions>();
  auto* command = subcommand(
      app, "beams",
      "Find the equilibrium of a structure of beams that bend far; exit code 1 where there is none",
      "limber beams arch.json --export arch.vtu --export arch.csv\n  limber beams roof/");
  command
      ->add_option(
          "structure", options->file,
          "Structure (.json, see the guide), a scene file of one (solved as drawn; one whose nodes "
          "come from a file of lines is opened: limber open), or a job "
          "of the public relaxation code: its folder or SimulationJob.json")
      ->required();
  command
      ->add_option("--method", options->method,
                   "choose, newton, relaxation or relaxation-then-newton")
      ->check(CLI::IsMember({"choose", "newton", "relaxation", "relaxation-then-newton"}))
      ->capture_default_str();
  command
      ->add_option("--export", options->exports,
                   "FILE.vtu, FILE.json, or FILE.csv (FILE_nodes.csv, FILE_elements.csv, "
                   "FILE_stations.csv); "
                   "may be repeated")
      ->type_size(1)
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command->add_flag(
      "--follow", options->follow,
      "Stay on the branch of equilibria where temporary loads push, too (without them that is "
      "what choose does), and tell its snaps; Newton's method alone");
  command->add_flag("--no-estimate", options->without_estimate,
                    "Leave out the comparison with shorter elements, which takes several times as "
                    "long as the answer");
  command->add_option("--wait", options->wait_s, "Seconds to wait for it")
      ->check(seconds_in(0.1, 1e6))
      ->capture_default_str();
  command->callback([&context, options] { solve(context, *options); });
}

}  // namespace limber::cli::beams
