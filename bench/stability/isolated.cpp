#include "bench/stability/isolated.h"

#include <fmt/core.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "engine/base/error.h"

namespace limber::bench::stability {
namespace {

using Json = nlohmann::json;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Bits, since JSON has no numbers that are not finite.
std::uint64_t bits_of(double value) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}
double of_bits(std::uint64_t bits) {
  double value = 0;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

Json answer_of(const std::function<Finding()>& work) {
  Json answer;
  const auto start = Clock::now();
  try {
    const Finding finding = work();
    answer = {{"end", static_cast<int>(End::kAnswered)},
              {"converged", finding.claim == Claim::kConverged},
              {"error", bits_of(finding.error)},
              {"allowed", bits_of(finding.allowed)},
              {"is_finite", finding.is_finite},
              {"message", finding.message}};
  } catch (const Error& error) {
    const std::string field = error.field().empty() ? "" : error.field() + ": ";
    // A broken invariant of the engine is a fault of its own, not a refusal.
    const bool is_refusal = error.code() != ErrorCode::kInternal;
    answer = {{"end", static_cast<int>(is_refusal ? End::kRefused : End::kThrew)},
              {"message", *error.what() == '\0' ? "" : field + error.what()}};
  } catch (const std::exception& error) {
    answer = {{"end", static_cast<int>(End::kThrew)}, {"message", error.what()}};
  }
  answer["seconds"] = seconds_since(start);
  return answer;
}

[[noreturn]] void answer_and_exit(const std::function<Finding()>& work, int pipe) {
  const std::string text =
      answer_of(work).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  for (std::size_t written = 0; written < text.size();) {
    const ssize_t count = write(pipe, text.data() + written, text.size() - written);
    if (count <= 0) _exit(2);
    written += static_cast<std::size_t>(count);
  }
  _exit(0);  // threads of the engine and buffers of the parent go with the process
}

/// Output of the child until it closes its end.
/// @returns false at the limit
bool read_all(int pipe, double limit, std::string& text) {
  const auto start = Clock::now();
  for (;;) {
    const double left = limit - seconds_since(start);
    if (left <= 0) return false;
    pollfd waiting{pipe, POLLIN, 0};
    const int ready = poll(&waiting, 1, static_cast<int>(1e3 * left) + 1);
    if (ready < 0 && errno != EINTR) return true;
    if (ready <= 0) continue;
    char buffer[4096];
    const ssize_t count = read(pipe, buffer, sizeof buffer);
    if (count <= 0) return true;
    text.append(buffer, static_cast<std::size_t>(count));
  }
}

Ended ended_of(const Json& answer) {
  Ended ended;
  ended.end = static_cast<End>(answer.at("end").get<int>());
  ended.seconds = answer.at("seconds").get<double>();
  ended.message = answer.at("message").get<std::string>();
  if (ended.end != End::kAnswered) return ended;
  ended.finding.claim =
      answer.at("converged").get<bool>() ? Claim::kConverged : Claim::kNotConverged;
  ended.finding.error = of_bits(answer.at("error").get<std::uint64_t>());
  ended.finding.allowed = of_bits(answer.at("allowed").get<std::uint64_t>());
  ended.finding.is_finite = answer.at("is_finite").get<bool>();
  ended.finding.message = ended.message;
  return ended;
}

}  // namespace

Ended run_isolated(const std::function<Finding()>& work, double limit) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("cannot make a pipe for a row");
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("cannot make a process for a row");
  if (child == 0) {
    close(ends[0]);
    answer_and_exit(work, ends[1]);
  }
  close(ends[1]);
  const auto start = Clock::now();
  std::string text;
  const bool has_ended = read_all(ends[0], limit, text);
  const double seconds = seconds_since(start);
  close(ends[0]);
  if (!has_ended) kill(child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  Ended ended;
  ended.seconds = seconds;
  if (!has_ended) {
    ended.end = End::kHung;
    ended.message = fmt::format("no answer within {} s", limit);
    return ended;
  }
  const Json answer = Json::parse(text, nullptr, false);
  if (!answer.is_discarded()) return ended_of(answer);
  ended.end = End::kCrashed;
  ended.message = WIFSIGNALED(status) ? fmt::format("ended by signal {}", WTERMSIG(status))
                                      : fmt::format("ended with {} and no answer", status);
  return ended;
}

}  // namespace limber::bench::stability
