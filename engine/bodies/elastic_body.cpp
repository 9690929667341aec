#include "engine/bodies/elastic_body.h"

namespace limber::bodies {

double ElasticBody::length() const {
  if (mesh.node_count() == 0) return 0;
  return (mesh.nodes.rowwise().maxCoeff() - mesh.nodes.rowwise().minCoeff()).maxCoeff();
}

}  // namespace limber::bodies
