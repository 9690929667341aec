// Deploys the sample hyperboloid, holds its foot, and pushes a joint of its rim inwards, step by
// step. push_hyperboloid [ENDPOINT]: of a limberd that runs, tcp://127.0.0.1:7801 by default.
#include <cstdio>

#include "clients/cpp/linkage_session.h"

using namespace limber;

int main(int argc, char** argv) try {
  client::Client server(argc > 1 ? argv[1] : client::kDefaultEndpoint);
  v1::GetSampleRequest sample;
  sample.set_name("hyperboloid");
  auto linkage = client::LinkageSession::open(server, server.call(sample).scene());
  linkage.deploy(50);
  const double angle = linkage.wait().linkage().mean_angle_degrees();
  std::printf("deployed: %.1f degrees in %zu shapes\n", angle, linkage.shapes().size());
  for (unsigned foot = 0; foot < 12; ++foot) linkage.pin(foot, v1::HELD_MOTION);
  constexpr unsigned kRim = 83;
  const auto [x, y, z] = linkage.shape().joints[kRim];
  const auto target = linkage.attach(kRim, {x, y, z}, 5000);
  for (const double share : {0.1, 0.2, 0.3}) {
    linkage.move_target(target, {x * (1 - share), y * (1 - share), z});
    std::printf("pushed by %.0f %%: %.2f J\n", 100 * share, linkage.wait().total_energy());
  }
  linkage.close();
} catch (const client::ClientError& error) {
  std::fprintf(stderr, "%s: %s\n", error.field().c_str(), error.what());
  return 1;
}
