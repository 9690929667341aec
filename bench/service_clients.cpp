#include "bench/service_clients.h"

#include <fmt/core.h>

#include <chrono>
#include <memory>
#include <optional>
#include <stdexcept>
#include <thread>

#include "bench/arrivals.h"
#include "bench/background_builds.h"
#include "bench/find_program.h"
#include "bench/live_server.h"

namespace limber::bench {
namespace {

namespace pb = limber::v1;
using Clock = Arrivals::Clock;

/// A result that comes later than this after its edit is missed.
constexpr std::chrono::milliseconds kPatience{1000};
/// A sample that takes seconds to be built.
constexpr const char* kBuilt = "bird";

/// One client, its session and its measurements.
class Editor {
 public:
  Editor(const ServerProcess& server, const std::string& sample, int number)
      : session_(fmt::format("bench-{}", number)),
        client_(server),
        scene_(open_sample(client_, sample, session_).scene()),
        arrivals_(client_, server, session_) {}

  /// @param shift  of the first edit, so that clients do not all edit at once [s]
  void edit(const ServiceLoad& load, double shift) {
    const auto seconds = [](double s) {
      return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(s));
    };
    const int edits = static_cast<int>(load.edits_per_s * load.seconds);
    const auto begin = Clock::now() + seconds(shift);
    struct Sent {
      std::uint64_t revision;
      Clock::time_point at;
    };
    std::vector<Sent> sent;
    try {
      for (int i = 0; i < edits; ++i) {
        std::this_thread::sleep_until(begin + seconds(i / load.edits_per_s));
        const auto at = Clock::now();
        const std::uint64_t revision =
            client_.call(circling_edit(session_, scene_, i)).edit().revision();
        ack_ms.push_back(milliseconds(Clock::now() - at));
        sent.push_back({revision, at});
      }
      for (const Sent& one : sent) {
        Clock::time_point first;
        if (arrivals_.first_of(one.revision, kPatience, first)) {
          first_frame_ms.push_back(milliseconds(first - one.at));
          if (first - one.at > kPatience) ++missed;
        } else {
          ++missed;
        }
      }
    } catch (const std::exception& error) {
      fault = error.what();
    }
  }

  std::vector<double> ack_ms, first_frame_ms;
  int missed = 0;
  std::string fault;

 private:
  static double milliseconds(Clock::duration time) {
    return std::chrono::duration<double, std::milli>(time).count();
  }

  const std::string session_;
  LiveClient client_;
  const pb::Scene scene_;
  Arrivals arrivals_;
};

pb::GetServerInfoResponse info_of(LiveClient& client) {
  pb::Request request;
  request.mutable_get_server_info()->set_with_status(true);
  return client.call(request).get_server_info();
}

}  // namespace

Case measure_clients(const SuiteOptions& options, Recorder& recorder, const ServiceLoad& load,
                     const std::string& sample, const std::vector<std::string>& server_options) {
  const ServerProcess server(find_program("limberd", options.limberd), server_options);
  recorder.note(fmt::format("service: {} sessions of {}", load.clients, sample));
  std::vector<std::unique_ptr<Editor>> editors;
  for (int i = 0; i < load.clients; ++i)
    editors.push_back(std::make_unique<Editor>(server, sample, i));
  std::this_thread::sleep_for(std::chrono::seconds(2));  // subscriptions, checks in the background
  LiveClient operator_client(server);
  std::optional<BackgroundBuilds> builds;
  if (load.builders > 0) builds.emplace(server, kBuilt, load.builders);
  const auto before = info_of(operator_client);
  const auto begin = Clock::now();
  std::vector<std::thread> threads;
  for (int i = 0; i < load.clients; ++i) {
    const double shift = i / (load.clients * load.edits_per_s);
    threads.emplace_back(
        [&, i, shift] { editors[static_cast<std::size_t>(i)]->edit(load, shift); });
  }
  for (auto& thread : threads) thread.join();
  const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  const auto after = info_of(operator_client);
  if (builds && builds->has_failed()) throw std::runtime_error("a client beside could not build");
  std::vector<double> ack, first;
  int missed = 0;
  for (const auto& editor : editors) {
    if (!editor->fault.empty()) throw std::runtime_error(editor->fault);
    ack.insert(ack.end(), editor->ack_ms.begin(), editor->ack_ms.end());
    first.insert(first.end(), editor->first_frame_ms.begin(), editor->first_frame_ms.end());
    missed += editor->missed;
  }
  Case result;
  result["scene"] = sample;
  result["clients"] = load.clients;
  result["sessions"] = load.clients;
  result["builders"] = load.builders;
  result["built"] = builds ? builds->built() : 0;
  result["edits"] = static_cast<int>(ack.size());
  result["edits_per_s"] = static_cast<double>(ack.size()) / seconds;
  result["ack_p50_ms"] = quantile(ack, 0.5);
  result["ack_p99_ms"] = quantile(ack, 0.99);
  result["first_frame_p50_ms"] = quantile(first, 0.5);
  result["first_frame_p99_ms"] = quantile(first, 0.99);
  result["missed"] = missed;
  result["rss_mb"] = static_cast<double>(after.status().process().resident_bytes()) / 1e6;
  const auto syncs = [](const pb::GetServerInfoResponse& info) {
    const auto found = info.counters().find("store_syncs");  // absent without a data folder
    return found == info.counters().end() ? 0.0 : static_cast<double>(found->second);
  };
  result["fsyncs_per_s"] = (syncs(after) - syncs(before)) / seconds;
  return result;
}

}  // namespace limber::bench
