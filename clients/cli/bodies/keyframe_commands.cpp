// keyframe, keyframes: whole poses that the motion goes through.

#include <fmt/format.h>

#include "clients/cli/bodies/commands.h"
#include "clients/cli/print.h"
#include "clients/cli/receipt.h"
#include "clients/cpp/bodies/session.h"
#include "clients/cpp/files.h"

namespace limber::cli::bodies {
namespace {

struct KeyframeOptions {
  std::string session, pose;
  std::optional<unsigned> frame;
  std::optional<double> weight;
  bool exact = false;
  std::optional<std::uint64_t> move;
  std::vector<std::uint64_t> remove;
};

v1::Keyframe keyframe_of(const KeyframeOptions& options) {
  if (!options.frame)
    throw client::ClientError(v1::ERROR_CODE_INVALID_ARGUMENT, "--frame",
                              "in which frame the pose is to be is missing");
  v1::Keyframe keyframe;
  keyframe.set_frame(*options.frame);
  *keyframe.mutable_file() = client::mesh_file(options.pose, "--pose");
  if (options.exact) keyframe.set_exact(true);
  if (options.weight) keyframe.set_weight(*options.weight);
  return keyframe;
}

v1::EditResponse edit_keyframes(Context& context, const KeyframeOptions& options) {
  const bool is_new = !options.pose.empty();
  const v1::Keyframe keyframe = is_new ? keyframe_of(options) : v1::Keyframe{};
  auto session = context.session<client::BodySession>(options.session);
  if (is_new) return session.add_keyframe(keyframe);
  if (!options.remove.empty()) return session.remove_keyframes(options.remove);
  return session.move_keyframe(*options.move, {options.frame, options.weight, options.exact});
}

void keyframe_command(CLI::App& app, Context& context) {
  auto options = std::make_shared<KeyframeOptions>();
  auto* command = subcommand(
      app, "keyframe", "Add, move or remove a keyframe: in this frame, the body has this pose",
      "limber keyframe bird --frame 20 --pose wings_up.vtu --exact\n"
      "  limber keyframe bird --move 2 --frame 25 --weight 10\n"
      "  limber keyframe bird --remove 1 2");
  command->add_option("session", options->session, "Session")->required();
  auto* what = command->add_option_group("what", "One of");
  what->add_option("--pose", options->pose,
                   "Add one: a mesh file with the nodes of the scene's mesh, moved, such as a "
                   "frame of `limber export`");
  what->add_option("--move", options->move,
                   "Give a keyframe another --frame, --weight or --exact; the pose stays");
  auto* remove = what->add_option("--remove", options->remove, "Remove keyframes");
  what->require_option(1);
  command->add_option("--frame", options->frame, "Frame, from 0")->excludes(remove);
  auto* weight = command->add_option("--weight", options->weight,
                                     "gamma > 0 of the distance in modal coordinates (default: "
                                     "100)");
  weight->excludes(remove);
  command->add_flag("--exact", options->exact, "Hold exactly, as far as the modes can")
      ->excludes(weight)
      ->excludes(remove);
  command->callback(
      [&context, options] { print_receipt(context, edit_keyframes(context, *options)); });
}

void keyframes_command(CLI::App& app, Context& context) {
  auto session = std::make_shared<std::string>();
  auto* command =
      subcommand(app, "keyframes", "Keyframes of a session, and how far they are missed",
                 "limber keyframes bird");
  command->add_option("session", *session, "Session")->required();
  command->callback([&context, session] {
    v1::GetSessionRequest request;
    request.set_session(*session);
    request.set_with_scene(true);
    const auto response = context.client().call(request);
    if (context.json) {
      v1::Scene only;
      *only.mutable_keyframes() = response.scene().keyframes();
      return print_json(only);
    }
    Table table({"id", "frame", "weight"});
    for (const auto& keyframe : response.scene().keyframes()) {
      table.add({std::to_string(keyframe.id()), std::to_string(keyframe.frame()),
                 keyframe.exact() ? "exact" : fmt::format("{:g}", keyframe.weight())});
    }
    fmt::print("{}", table.text());
    const auto& result = response.status().result();
    if (result.converged() && !response.scene().keyframes().empty())
      fmt::print("missed by {:.3g} at most\n", result.max_keyframe_error());
  });
}

}  // namespace

void add_keyframe_commands(CLI::App& app, Context& context) {
  keyframe_command(app, context);
  keyframes_command(app, context);
}

}  // namespace limber::cli::bodies
