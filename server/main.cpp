#include "server/cli/commands.h"

int main(int argc, char** argv) { return limber::server::run(argc, argv); }
