#include "bench/background_builds.h"

#include <fmt/core.h>

#include <exception>

namespace limber::bench {

namespace pb = limber::v1;

BackgroundBuilds::BackgroundBuilds(const ServerProcess& server, const std::string& sample,
                                   int clients) {
  for (int number = 0; number < clients; ++number) {
    threads_.emplace_back([this, &server, sample, number, clients] {
      try {
        LiveClient client(server);
        pb::Request get_sample;
        get_sample.mutable_get_sample()->set_name(sample);
        pb::Scene scene = client.call(get_sample).get_sample().scene();
        for (int i = 0; !is_over_; ++i) {
          const std::string session = fmt::format("built-{}-{}", number, i);
          scene.mutable_material()->set_density(1000 + number + i * clients);
          open_scene(client, scene, session);
          ++built_;
          pb::Request close;
          close.mutable_close_session()->set_session(session);
          client.call(close);
        }
      } catch (const std::exception&) {
        has_failed_ = true;
      }
    });
  }
}

BackgroundBuilds::~BackgroundBuilds() {
  is_over_ = true;
  for (std::thread& thread : threads_) thread.join();
}

}  // namespace limber::bench
