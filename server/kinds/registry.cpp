#include "server/kinds/registry.h"

#include "server/kinds/beams/kind.h"
#include "server/kinds/bodies/kind.h"
#include "server/kinds/linkages/kind.h"

namespace limber::server {

Kinds standard_kinds(const ServerOptions& options) {
  Kinds kinds;
  kinds.add(make_body_kind(options));
  kinds.add(make_linkage_kind());
  kinds.add(make_beam_kind());
  return kinds;
}

}  // namespace limber::server
