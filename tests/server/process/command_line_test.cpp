#include <gmock/gmock.h>

#include <sstream>

#include "engine/scene/formats/mesh_formats.h"
#include "tests/server/process/child_process.h"
#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;
using namespace limber::server::testing;

struct ServerCommandLine : ::testing::Test {
  TemporaryFolder folder;
  std::string text;
  int run(const std::vector<std::string>& arguments) {
    ChildProcess process(folder.path(), arguments);
    const auto code = process.wait();
    text = process.out() + process.err();
    return code.value_or(-1);
  }
  std::string path(const char* name) const { return (folder.path() / name).string(); }
};

TEST_F(ServerCommandLine, HelpAndVersion) {
  EXPECT_EQ(run({"--help"}), 0);
  for (const char* word : {"--bind", "--curve-allow", "--mesh-root", "--max-tets", "--ready-file",
                           "validate", "docs/protocol.md"}) {
    EXPECT_THAT(text, HasSubstr(word));
  }
  EXPECT_EQ(run({"--version"}), 0);
  EXPECT_THAT(text, HasSubstr("limberd 0."));
  EXPECT_EQ(run({"validate", "--help"}), 0);
  EXPECT_EQ(run({"--no-such-option"}), 2);
  EXPECT_EQ(run({"--max-sessions", "many"}), 2);
}

TEST_F(ServerCommandLine, BadOptionsAreNamed) {
  EXPECT_EQ(run({"--bind", "tcp://0.0.0.0:0"}), 1);
  EXPECT_THAT(text, HasSubstr("--bind"));
  EXPECT_THAT(text, HasSubstr("--curve-secret-file"));
  EXPECT_EQ(run({"--max-sessions", "0"}), 1);
  EXPECT_THAT(text, HasSubstr("--max-sessions"));
  EXPECT_EQ(run({"--mesh-root", path("missing")}), 1);
  EXPECT_EQ(run({"--curve-allow", path("missing")}), 1);
}

TEST_F(ServerCommandLine, SamplesValidate) {
  ASSERT_EQ(run({"sample", "beam", path("out")}), 0) << text;
  EXPECT_EQ(run({"validate", path("out/beam.json")}), 0) << text;
  EXPECT_EQ(run({"sample", "unicorn", path("out")}), 2);
  std::string json = read_text(folder.path() / "out/beam.json");
  const auto at = json.find("\"frame\": ");
  ASSERT_NE(at, std::string::npos);
  json.replace(at, 9, "\"frame\": 9");
  std::ofstream(folder.path() / "out/bad.json") << json;
  EXPECT_EQ(run({"validate", path("out/bad.json")}), 1);
  EXPECT_THAT(text, HasSubstr("constraints[0].frame"));
  EXPECT_EQ(run({"validate", path("missing.json")}), 1);
  std::ofstream(folder.path() / "no.json") << "{]";
  EXPECT_EQ(run({"validate", path("no.json")}), 1);
  EXPECT_THAT(text, HasSubstr("error: " + path("no.json")));
}

TEST_F(ServerCommandLine, ValidateListsAllThatIsWrong) {
  const auto complaints = [&](const std::string& json) {
    std::ofstream(folder.path() / "bad.json") << json;
    EXPECT_EQ(run({"validate", path("bad.json")}), 1);
    std::vector<std::string> fields;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      const std::string begin = "error: ";
      if (line.starts_with(begin))
        fields.push_back(line.substr(begin.size(), line.find(": ", begin.size()) - begin.size()));
    }
    return fields;
  };
  EXPECT_THAT(complaints(R"({"mesh":{"sample":"beam"},"frames":20,"constraints":[
      {"frame":10,"nodes":[77777],"displacement":{"x":1}},{"frame":10,"nodes":[]},
      {"frame":500,"nodes":[9],"displacement":{"x":1}}]})"),
              UnorderedElementsAre("constraints[0].nodes[0]", "constraints[1].target",
                                   "constraints[1].nodes", "constraints[2].frame"));
  EXPECT_THAT(complaints(R"({"mesh":{"path":"nope.msh"},"frames":2,"material":{"density":-1}})"),
              UnorderedElementsAre("mesh.path", "frames", "material.density"));
  EXPECT_THAT(complaints(R"({"mesh":{"sample":"beam"},"frames":20,
      "dynamics":{"period_frames":1e300,"frames_per_second":1e-300}})"),
              UnorderedElementsAre("dynamics.period_frames", "dynamics.frames_per_second"));
  EXPECT_THAT(complaints(R"({"mesh":{"sample":"flower"},"frames":100000,
      "model":{"modes":4000,"basis_size":4000}})"),
              UnorderedElementsAre("scene"));
}

TEST_F(ServerCommandLine, TetrahedralizeWritesAMesh) {
  std::ofstream(folder.path() / "box.obj")
      << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
         "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
  for (const char* name : {"box.msh", "box.vtu"}) {
    ASSERT_EQ(
        run({"tetrahedralize", path("box.obj"), path(name), "--tets", "300", "--within", "0.2"}), 0)
        << text;
    EXPECT_GT(scene::read_mesh_file(folder.path() / name).mesh.tet_count(), 200);
  }
  EXPECT_EQ(run({"tetrahedralize", path("box.obj"), "-o", path("other.msh"), "--tets", "300",
                 "--within", "0.2"}),
            0)
      << text;
  EXPECT_NE(text.find("distance: surface to mesh"), std::string::npos) << text;
  EXPECT_EQ(run({"tetrahedralize", path("box.obj"), path("other.msh"), "--tets", "300"}), 1);
  EXPECT_NE(text.find("300 tets come within"), std::string::npos) << text;
  EXPECT_EQ(run({"tetrahedralize", path("box.obj"), path("box.txt")}), 1);
  EXPECT_EQ(run({"tetrahedralize", path("missing.obj"), path("box.msh")}), 1);
}

TEST_F(ServerCommandLine, KeysThatAreMadeCanBeServedWith) {
  ASSERT_EQ(run({"keygen", path("server")}), 0) << text;
  ASSERT_EQ(run({"keygen", path("client")}), 0);
  EXPECT_EQ(run({"keygen", path("client")}), 1);
  Daemon daemon(folder.path(),
                {"--curve-secret-file", path("server"), "--curve-allow", path("client.pub")});
  ASSERT_FALSE(daemon.requests.empty());
  zmq::context_t context;
  zmq::socket_t socket(context, ZMQ_DEALER);
  socket.set(zmq::sockopt::linger, 0);
  const auto key = [&](const char* name) { return read_text(folder.path() / name).substr(0, 40); };
  socket.set(zmq::sockopt::curve_serverkey, key("server.pub"));
  socket.set(zmq::sockopt::curve_publickey, key("client.pub"));
  socket.set(zmq::sockopt::curve_secretkey, key("client"));
  socket.connect(daemon.requests);
  proto::Request request = info_request();
  request.set_version(1);
  socket.send(zmq::buffer(request.SerializeAsString()));
  socket.set(zmq::sockopt::rcvtimeo, 10000);
  zmq::message_t message;
  EXPECT_TRUE(socket.recv(message).has_value());
}

}  // namespace
}  // namespace limber::server
