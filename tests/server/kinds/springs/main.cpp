// limberd with one kind more: the program of docs/a-kind-of-your-own.md.
#include "server/cli/commands.h"
#include "tests/server/kinds/springs/kind.h"

int main(int argc, char** argv) {
  using namespace limber::server;
  return run(argc, argv, [](const ServerOptions& options) {
    Kinds kinds = standard_kinds(options);
    kinds.add(springs::make_kind());
    return kinds;
  });
}
