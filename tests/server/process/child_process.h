#pragma once

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

namespace limber::server::testing {

inline std::string read_text(const std::filesystem::path& path) {
  std::ifstream in(path);
  return (std::ostringstream() << in.rdbuf()).str();
}

/// limberd as another process; its output goes to files of the folder.
class ChildProcess {
 public:
  ChildProcess(const std::filesystem::path& folder, std::vector<std::string> arguments)
      : out_(folder / "stdout"), err_(folder / "stderr") {
    arguments.insert(arguments.begin(), LIMBERD_BINARY);
    std::vector<char*> argv;
    for (auto& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    pid_ = ::fork();
    if (pid_ == 0) {
      if (std::freopen(out_.c_str(), "w", stdout) == nullptr) std::_Exit(126);
      if (std::freopen(err_.c_str(), "w", stderr) == nullptr) std::_Exit(126);
      ::execv(LIMBERD_BINARY, argv.data());
      std::_Exit(127);
    }
  }
  ~ChildProcess() {
    if (pid_ > 0 && !status_) {
      ::kill(pid_, SIGKILL);
      ::waitpid(pid_, nullptr, 0);
    }
  }
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  void signal(int number) const { ::kill(pid_, number); }
  /// Its exit code, 128 + signal if one ended it; nothing if it still runs after that time.
  std::optional<int> wait(std::chrono::milliseconds time = std::chrono::seconds(60)) {
    const auto deadline = std::chrono::steady_clock::now() + time;
    while (!status_) {
      int status = 0;
      if (::waitpid(pid_, &status, WNOHANG) == pid_) {
        status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
      } else if (std::chrono::steady_clock::now() > deadline) {
        return std::nullopt;
      } else {
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
      }
    }
    return status_;
  }
  [[nodiscard]] std::string out() const { return read_text(out_); }
  [[nodiscard]] std::string err() const { return read_text(err_); }

 private:
  std::filesystem::path out_, err_;
  pid_t pid_ = -1;
  std::optional<int> status_;
};

/// limberd on free ports, ready.
class Daemon {
 public:
  explicit Daemon(const std::filesystem::path& folder, std::vector<std::string> more = {})
      : ready_(folder / "ready.json"), process_(folder, arguments(ready_, std::move(more))) {
    for (int i = 0; i < 3000 && !std::filesystem::exists(ready_); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    const auto json = nlohmann::json::parse(read_text(ready_), nullptr, false);
    if (json.is_discarded()) {
      ADD_FAILURE() << "limberd did not start: " << process_.err();
      return;
    }
    requests = json.at("requests").get<std::string>();
    stream = json.at("stream").get<std::string>();
  }
  ChildProcess& process() { return process_; }
  [[nodiscard]] const std::filesystem::path& ready_file() const { return ready_; }
  std::string requests, stream;

 private:
  static std::vector<std::string> arguments(const std::filesystem::path& ready,
                                            std::vector<std::string> more) {
    std::vector<std::string> all{
        "--bind",       "tcp://127.0.0.1:0", "--stream",  "tcp://127.0.0.1:0",
        "--ready-file", ready.string(),      "--no-cache"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  std::filesystem::path ready_;
  ChildProcess process_;
};

}  // namespace limber::server::testing
