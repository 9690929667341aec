#include "clients/cli/context.h"

#include <fmt/format.h>
#include <google/protobuf/any.pb.h>
#include <google/protobuf/util/json_util.h>
#include <pwd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <sstream>

#include "clients/cpp/curve_keys.h"
#include "clients/cpp/reach.h"

namespace limber::cli {
namespace {

namespace fs = std::filesystem;
volatile std::sig_atomic_t interrupt_flag = 0;
bool deferred = false;

bool is_program(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored) && access(path.c_str(), X_OK) == 0;
}

/// "limber-ana@host", as others in a session see this program.
std::string default_name() {
  std::array<char, 256> host{};
  if (gethostname(host.data(), host.size() - 1) != 0) host[0] = '\0';
  const struct passwd* user = getpwuid(geteuid());
  return fmt::format("limber-{}@{}", user != nullptr ? user->pw_name : std::to_string(geteuid()),
                     host.data())
      .substr(0, 64);
}

}  // namespace

client::ClientOptions Context::client_options() const {
  client::ClientOptions options;
  options.timeout = milliseconds(timeout_s);
  options.client_name = client_name.empty() ? default_name() : client_name;
  options.interrupted = [] { return interrupted(); };
  if (!server_key.empty() || !key_file.empty()) {
    if (server_key.empty() || key_file.empty())
      throw client::ClientError(v1::ERROR_CODE_INVALID_ARGUMENT, "key",
                                "--server-key and --key go together");
    options.keys = client::read_curve_keys(server_key, key_file);
  }
  return options;
}

client::ClientOptions Context::closing_options() const {
  client::ClientOptions options = client_options();
  options.interrupted = nullptr;
  options.timeout = client::Milliseconds{5000};
  return options;
}

namespace {

/// @param refusal  of a run that another one is to follow; set where this is it
bool is_greeted(client::Client& client, client::Milliseconds patience,
                std::optional<client::ServerStopped>& refusal) {
  try {
    (void)client::greet(client, patience);
    return true;
  } catch (const client::ServerStopped& stopped) {
    if (!client::is_for_next_run(stopped)) throw;
    refusal = stopped;
  } catch (const client::Unreachable&) {
    if (!refusal) throw;
  }
  return false;
}

/// @param patience  for one that is there. @param longest  for the run that is to follow one that
/// says that it ends
void greet_this_or_the_next(client::Client& client, client::Milliseconds patience,
                            client::Milliseconds longest) {
  const auto until = std::chrono::steady_clock::now() + longest;
  std::optional<client::ServerStopped> refusal;
  while (!is_greeted(client, patience, refusal)) {
    if (std::chrono::steady_clock::now() >= until) throw *refusal;
  }
}

}  // namespace

client::Client& Context::client() {
  if (!client_) {
    auto made = std::make_unique<client::Client>(endpoint, client_options());
    const double patience = std::min(connect_timeout_s, timeout_s);
    try {
      greet_this_or_the_next(*made, milliseconds(patience), milliseconds(timeout_s));
    } catch (const client::ServerStopped&) {
      throw;
    } catch (const client::Unreachable&) {
      const auto reach = client::probe(*made);
      throw client::Unreachable(
          fmt::format("no limberd answers at {} (asked for {:g} s): {}. {}--endpoint or "
                      "LIMBER_ENDPOINT names another; --connect-timeout waits longer",
                      endpoint, patience, client::advice(reach, *made),
                      reach == client::Reach::kNobody ? "`limber start` starts one; " : ""));
    }
    client_ = std::move(made);
  }
  return *client_;
}

namespace {

/// Content that a kind unknown to limber.v1 has put into a message cannot be printed without its
/// .proto.
void leave_out_unknown(google::protobuf::Message& message) {
  using google::protobuf::FieldDescriptor;
  const auto& reflection = *message.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  for (const FieldDescriptor* field : fields) {
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE || field->is_map()) continue;
    if (field->is_repeated()) {
      for (int i = 0; i < reflection.FieldSize(message, field); ++i)
        leave_out_unknown(*reflection.MutableRepeatedMessage(&message, field, i));
      continue;
    }
    auto& part = *reflection.MutableMessage(&message, field);
    const auto* const any = dynamic_cast<const google::protobuf::Any*>(&part);
    std::string type;
    if (any == nullptr) {
      leave_out_unknown(part);
    } else if (!google::protobuf::Any::ParseAnyTypeUrl(any->type_url(), &type) ||
               google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName(type) ==
                   nullptr) {
      reflection.ClearField(&message, field);
    }
  }
}

}  // namespace

std::string to_json(const google::protobuf::Message& given) {
  const std::unique_ptr<google::protobuf::Message> copy(given.New());
  copy->CopyFrom(given);
  leave_out_unknown(*copy);
  const google::protobuf::Message& message = *copy;
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  options.always_print_primitive_fields = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  if (!status.ok())
    throw client::ClientError(v1::ERROR_CODE_INTERNAL, "", std::string(status.message()));
  return text;
}

void print_error(const Context& context, const client::ClientError& error) {
  if (context.json) {
    v1::Error message;
    message.set_code(error.code());
    message.set_message(error.what());
    message.set_field(error.field());
    message.mutable_details()->insert(error.details().begin(), error.details().end());
    fmt::print(stderr, "{}\n", to_json(message));
    return;
  }
  const std::string where = error.field().empty() ? "" : fmt::format(" (field {})", error.field());
  fmt::print(stderr, "limber: {}{} [{}]\n", error.what(), where, error.code_name());
}

void print_json(const google::protobuf::Message& message) { fmt::print("{}\n", to_json(message)); }

void catch_interrupts() {
  struct sigaction action = {};
  action.sa_handler = [](int) {
    if (interrupt_flag != 0) _exit(kInterrupted);
    interrupt_flag = 1;
  };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  signal(SIGPIPE, SIG_DFL);
}

bool interrupted() { return interrupt_flag != 0 && !deferred; }

DeferInterrupts::DeferInterrupts() { deferred = true; }

DeferInterrupts::~DeferInterrupts() { deferred = false; }

std::string own_folder() {
  std::error_code failed;
  const fs::path self = fs::read_symlink("/proc/self/exe", failed);
  return failed ? std::string(".") : self.parent_path().string();
}

std::string find_limberd() {
  const fs::path beside = fs::path(own_folder()) / "limberd";
  if (is_program(beside)) return beside.string();
  const char* path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const fs::path candidate = fs::path(folder.empty() ? "." : folder) / "limberd";
    if (is_program(candidate)) return candidate.string();
  }
  throw client::ClientError(
      v1::ERROR_CODE_NOT_FOUND, "limberd",
      fmt::format("no limberd beside this program ({}) or on PATH", own_folder()));
}

CLI::Validator seconds_in(double least, double most) {
  return {[least, most](const std::string& text) {
            double seconds = 0;
            const bool is_number = CLI::detail::lexical_cast(text, seconds);
            return is_number && seconds >= least && seconds <= most
                       ? std::string()
                       : fmt::format("{} is not within {:g} to {:g} seconds", text, least, most);
          },
          fmt::format("SECONDS in [{:g}, {:g}]", least, most)};
}

client::Milliseconds milliseconds(double seconds) {
  constexpr double kRounding = 1e-6;  // 0.56 s are 560 ms
  return client::Milliseconds{static_cast<std::int64_t>(std::ceil(seconds * 1000 - kRounding))};
}

CLI::App* subcommand(CLI::App& app, const std::string& name, const std::string& description,
                     const std::string& example) {
  CLI::App* command = app.add_subcommand(name, description);
  command->footer(
      "\nExample:\n  " + example +
      "\n\nBefore or behind the name of every command: --endpoint, --timeout, "
      "--connect-timeout, --json,\n--server-key, --key; `limber --help` explains them.");
  return command;
}

}  // namespace limber::cli
