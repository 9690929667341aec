// frames, export, watch: commands for results.

#include <fmt/format.h>

#include <filesystem>
#include <set>

#include "clients/cli/context.h"
#include "clients/cli/export_formats.h"
#include "clients/cli/kinds.h"
#include "clients/cli/print.h"
#include "clients/cpp/files.h"
#include "clients/cpp/frames.h"
#include "clients/cpp/open_session.h"
#include "clients/cpp/reach.h"
#include "clients/cpp/server.h"
#include "clients/cpp/stream.h"
#include "clients/cpp/waiting.h"

namespace limber::cli {
namespace {

using client::ClientError;
using client::Milliseconds;
using client::OpenSession;

const std::map<std::string, v1::Encoding> kEncodings = {
    {"coordinates", v1::ENCODING_COORDINATES},
    {"positions", v1::ENCODING_POSITIONS},
    {"quantised", v1::ENCODING_POSITIONS_QUANTISED},
    {"surface", v1::ENCODING_SURFACE}};

struct FramesLine {
  std::string session, out, encoding = "coordinates";
  unsigned first = 0, count = 0;
  bool final_only = false;
};

std::string csv(const client::Positions& positions, unsigned first_frame) {
  fmt::memory_buffer text;
  fmt::format_to(std::back_inserter(text), "frame,node,x,y,z\n");
  const bool is_short = client::is_single(positions);
  const double* p = positions.values.data();
  for (std::size_t frame = 0; frame < positions.frames; ++frame) {
    for (std::size_t node = 0; node < positions.nodes; ++node, p += 3) {
      fmt::format_to(std::back_inserter(text), "{},{}", first_frame + frame, node);
      for (int axis = 0; axis < 3; ++axis) {
        if (is_short) {
          fmt::format_to(std::back_inserter(text), ",{}", static_cast<float>(p[axis]));
        } else {
          fmt::format_to(std::back_inserter(text), ",{}", p[axis]);
        }
      }
      text.push_back('\n');
    }
  }
  return fmt::to_string(text);
}

void frames(Context& context, const FramesLine& options) {
  const auto folder = std::filesystem::path(options.out).parent_path();
  if (!folder.empty() && !std::filesystem::is_directory(folder))
    throw ClientError(v1::ERROR_CODE_IO, "out", "there is no folder " + folder.string());
  auto session = context.session<OpenSession>(options.session);
  client::FrameOptions wanted;
  wanted.encoding = kEncodings.at(options.encoding);
  wanted.first = options.first;
  wanted.count = options.count;
  wanted.final_only = options.final_only;
  v1::Frames frames = session.frames(wanted);
  v1::GetGeometryResponse geometry;
  if (frames.encoding() == v1::ENCODING_COORDINATES) {
    geometry = session.geometry_message(frames.basis_hash());
    if (!geometry.has_basis()) {  // these coordinates are no mixture of shapes
      wanted.encoding = v1::ENCODING_POSITIONS;
      frames = session.frames(wanted);
    }
  }
  const auto positions = client::decode(frames, &geometry);
  const bool numpy = options.out.ends_with(".npy");
  client::write_bytes(options.out,
                      numpy ? client::npy(positions) : csv(positions, frames.first_frame()));
  if (context.json) return print_json(frames.result());
  fmt::print("{}: {} frames x {} nodes x 3, revision {}{}\n", options.out, positions.frames,
             positions.nodes, frames.result().revision(),
             frames.result().converged() ? "" : " (not final)");
}

struct ExportOptions {
  std::string session, out = ".", stem;
  std::vector<std::string> formats;
};

void export_files(Context& context, const ExportOptions& options) {
  std::set<std::string> written;
  {
    ProgressBar bar;
    auto session = context.session<OpenSession>(options.session);
    for (const auto& format : options.formats) {
      const auto show = [&](unsigned done, unsigned count) {
        bar.show("exporting " + format, count > 0 ? static_cast<double>(done) / count : 1.0);
      };
      written.merge(
          session.export_files(kExportFormats.at(format), options.out, options.stem, show));
    }
  }
  if (context.json) {
    for (const auto& file : written) {
      v1::ExportedFile message;  // quotes the name as JSON wants it
      message.set_name(file);
      print_json(message);
    }
    return;
  }
  fmt::print("{} files in {}\n", written.size(), options.out);
  for (const auto& file : written)
    if (!(file.ends_with(".vtu") || file.ends_with(".vtp")) || written.size() < 8)
      fmt::print("  {}\n", file);
}

struct WatchOptions {
  std::string session;
  std::uint64_t count = 0;
  double silence_s = 0;
};

void print_result(const Context& context, const Kind& kind, const v1::ResultInfo& result,
                  std::uint64_t missed) {
  if (context.json) {
    print_json(result);
  } else {
    const bool has_energy = result.converged() || kind.has_energy_of_iterates();
    const std::string energy = has_energy ? fmt::format("{:.6g}", result.total_energy()) : "-";
    fmt::print("{:>8}  {:>8}  {:<15}  {:>12}  {:>16}  {:>9.2f}{}{}\n", result.revision(),
               result.sequence(), status_words(result), energy, kind.watched_value(result),
               result.since_edit_ms(), kind.remark(result),
               missed > 0 ? fmt::format("  ({} missed)", missed) : "");
  }
  std::fflush(stdout);
}

/// limberd sends the status of a session every two seconds. Asked when nothing came for longer:
/// is it there, and has it this session?
void check_there(Context& context, OpenSession& session) {
  constexpr Milliseconds kPatience{1500};
  try {
    (void)client::greet(context.client(), kPatience);
  } catch (const client::ServerStopped&) {
    throw;
  } catch (const client::Unreachable&) {
    // It may have been restarted, or this client revoked.
    const auto reach = client::probe(context.client());
    throw client::Unreachable(fmt::format("limberd at {} has gone silent and does not answer: {}",
                                          context.endpoint,
                                          client::advice(reach, context.client())));
  }
  (void)session.status();
}

void watch(Context& context, const WatchOptions& options) {
  const auto info = client::server_info(context.client());
  client::Subscription stream(context.client(), info);
  const std::string frames = client::frames_topic(options.session, v1::ENCODING_COORDINATES);
  const std::string status = client::status_topic(options.session);
  stream.subscribe(frames);
  stream.subscribe(status);
  auto session = context.session<OpenSession>(options.session);
  const v1::SessionStatus snapshot = session.status();
  const Kind& kind = kind_of(snapshot);
  if (!context.json)
    fmt::print(
        "{:>8}  {:>8}  {:<15}  {:>12}  {:>16}  {:>9}\n", "revision", "result", "status",
        kind.energy_unit().empty() ? "energy" : fmt::format("energy [{}]", kind.energy_unit()),
        kind.watched_heading(), "ms");
  std::uint64_t shown = 0;
  std::uint64_t newest = 0;
  if (snapshot.has_result()) {
    newest = snapshot.result().sequence();
    print_result(context, kind, snapshot.result(), 0);
    ++shown;
  }
  using Clock = std::chrono::steady_clock;
  constexpr Milliseconds kSilence{3500};
  auto result_at = Clock::now();
  auto heard_at = result_at;
  while (options.count == 0 || shown < options.count) {
    const auto event = stream.next(Milliseconds{200});
    if (!event) {
      if (options.silence_s > 0 && Clock::now() - result_at > milliseconds(options.silence_s))
        throw ClientError(v1::ERROR_CODE_TIMEOUT, "",
                          fmt::format("no result for {} s", options.silence_s));
      if (Clock::now() - heard_at > kSilence) {
        check_there(context, session);
        heard_at = Clock::now();
      }
      continue;
    }
    heard_at = Clock::now();
    const bool is_of_another =  // that took its name
        event->message.session_uid() != 0 && event->message.session_uid() != snapshot.uid();
    const auto& news = event->message.status();
    const bool may_follow = news.has_next_run_follows() ? news.next_run_follows()
                                                        : news.server_stopped() && news.is_stored();
    if (event->topic == status && may_follow) {
      heard_at += client::kNextRun;  // where none comes, silence tells
      continue;
    }
    if (event->topic == status && news.server_stopped()) {
      throw client::ServerStopped(
          fmt::format("limberd was stopped, and session {} with it", options.session));
    }
    if (is_of_another || (event->topic == status && news.state() == v1::SESSION_STATE_CLOSED)) {
      if (!context.json) fmt::print("session {} is closed\n", options.session);
      return;
    }
    if (event->topic != frames || event->message.frames().result().sequence() <= newest) continue;
    result_at = Clock::now();
    newest = event->message.frames().result().sequence();
    print_result(context, kind, event->message.frames().result(), event->missed);
    ++shown;
  }
}

}  // namespace

void add_result_commands(CLI::App& app, Context& context) {
  auto frame_options = std::make_shared<FramesLine>();
  auto* command = subcommand(
      app, "frames", "Write positions of the newest result: .npy (frames x nodes x 3) or .csv",
      "limber frames flower --out motion.npy\n"
      "  limber frames flower --out part.csv --first 40 --count 10 --encoding quantised");
  command->add_option("session", frame_options->session, "Session")->required();
  command->add_option("-o,--out", frame_options->out, "File to write, .npy or .csv")
      ->required()
      ->check(CLI::Validator(
          [](const std::string& name) {
            return name.ends_with(".npy") || name.ends_with(".csv")
                       ? std::string()
                       : "a file ending in .npy or .csv";
          },
          "FILE"));
  command
      ->add_option("--encoding", frame_options->encoding,
                   "What the server sends: coordinates, positions or quantised (16 bit); "
                   "the file has positions in any case")
      ->check(CLI::IsMember(kEncodings))
      ->capture_default_str();
  command->add_option("--first", frame_options->first, "First frame")->capture_default_str();
  command->add_option("--count", frame_options->count, "Number of frames; 0: to the last")
      ->capture_default_str();
  command->add_flag("--final", frame_options->final_only, "Of the newest final result");
  command->callback([&context, frame_options] { frames(context, *frame_options); });

  auto export_options = std::make_shared<ExportOptions>();
  command = subcommand(
      app, "export",
      "Write files: of bodies for ParaView (pvd) or Blender (blender), of rod linkages with what "
      "they carry (vtp, json) or their shape (obj), of structures of beams with what they carry "
      "(vtu, csv, json), of all the scene as edited (scene)",
      "limber export flower --format pvd blender --out motion\n"
      "  limber export shelter --format vtp obj json --out shape");
  command->add_option("session", export_options->session, "Session")->required();
  command
      ->add_option(
          "--format", export_options->formats,
          "pvd: a .vtu per frame and a .pvd; blender: an .obj of the surface and a .pc2 of its "
          "vertices; surface: of a body that carries a surface (`surface` in its scene), that "
          "surface with its own vertices, texture coordinates and materials, and a .pc2; pc2: a "
          ".pc2 of all nodes; vtp: a .vtp per step "
          "with forces and stresses and a .pvd; obj: centrelines and swept surface; json: "
          "joints and segments with curvatures, forces, stresses; vtu, csv, json of beams: nodes "
          "and elements with reactions, forces, stresses; scene: the scene as edited; several are "
          "possible")
      ->required()
      ->check(CLI::IsMember(kExportFormats));
  command->add_option("-o,--out", export_options->out, "Folder")->capture_default_str();
  command->add_option("--stem", export_options->stem,
                      "File name without its ending (default: motion, of beams: beams)");
  command->callback([&context, export_options] { export_files(context, *export_options); });

  auto watch_options = std::make_shared<WatchOptions>();
  command = subcommand(app, "watch",
                       "Print results as they are published, until Ctrl-C or the session's end",
                       "limber watch flower");
  command->add_option("session", watch_options->session, "Session")->required();
  command->add_option("--count", watch_options->count, "End after so many results; 0: never")
      ->capture_default_str();
  command
      ->add_option("--silence", watch_options->silence_s,
                   "End with exit code 4 after so many seconds without one; 0: never")
      ->check(seconds_in(0, 1e6))
      ->capture_default_str();
  command->callback([&context, watch_options] { watch(context, *watch_options); });
}

}  // namespace limber::cli
