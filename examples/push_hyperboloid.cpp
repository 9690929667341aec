// Deploys the sample hyperboloid, holds its foot, and pushes a joint of its rim inwards, step by
// step. `push_hyperboloid [ENDPOINT]`: of a limberd that runs (`limber start`); $LIMBER_ENDPOINT,
// or else tcp://127.0.0.1:7801, by default.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <vector>

#include "clients/cpp/linkages/session.h"
#include "clients/cpp/reach.h"

using namespace limber;

namespace {

std::string endpoint(int argc, char** argv) {
  const char* const named = argc > 1 ? argv[1] : std::getenv("LIMBER_ENDPOINT");
  return named != nullptr ? named : client::kDefaultEndpoint;
}

/// Whether one is there is known soon; answers may take their time.
void demand_server(client::Client& server) {
  try {
    (void)client::greet(server, client::Milliseconds{2000});
  } catch (const client::Unreachable&) {
    const std::string why = client::advice(client::probe(server), server);
    throw client::Unreachable("no limberd answers at " + server.endpoint() + ": " + why +
                              ". `limber start` starts one");
  }
}

/// Numbers of joints, the lowest first.
std::vector<unsigned> upwards(const std::vector<client::Point>& joints) {
  std::vector<unsigned> order(joints.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](unsigned a, unsigned b) { return joints[a][2] < joints[b][2]; });
  return order;
}

}  // namespace

int main(int argc, char** argv) try {
  client::Client server(endpoint(argc, argv));
  demand_server(server);
  v1::GetSampleRequest sample;
  sample.set_name("hyperboloid");
  auto linkage = client::LinkageSession::open(server, server.call(sample).scene());
  linkage.deploy(50);
  const double angle = linkage.wait().linkage().mean_angle_degrees();
  std::printf("deployed: %.1f degrees in %zu shapes\n", angle, linkage.shapes().size());
  const auto joints = linkage.shape().joints;
  const auto order = upwards(joints);
  for (std::size_t i = 0; i < 12; ++i) linkage.pin(order[i], v1::HELD_MOTION);
  const auto count = static_cast<double>(joints.size());
  double x = 0, y = 0;
  for (const client::Point& joint : joints) {
    x += joint[0] / count;
    y += joint[1] / count;
  }
  const auto highest =
      std::max_element(joints.begin(), joints.end(),
                       [](const client::Point& a, const client::Point& b) { return a[2] < b[2]; });
  const auto rim = static_cast<unsigned>(highest - joints.begin());
  const client::Point start = joints[rim];
  const auto target = linkage.attach(rim, {start[0], start[1], start[2]}, 5000);
  for (const double share : {0.1, 0.2, 0.3}) {
    linkage.move_target(
        target, {start[0] + share * (x - start[0]), start[1] + share * (y - start[1]), start[2]});
    const double energy = linkage.wait().total_energy();
    const client::Point now = linkage.shape().joints[rim];
    std::printf("pushed by %.3f m, %.2f J\n",
                std::hypot(now[0] - start[0], now[1] - start[1], now[2] - start[2]), energy);
  }
  linkage.close();
} catch (const client::ClientError& error) {
  const std::string field = error.field().empty() ? "" : error.field() + ": ";
  std::fprintf(stderr, "push_hyperboloid: %s%s\n", field.c_str(), error.what());
  return 1;
}
