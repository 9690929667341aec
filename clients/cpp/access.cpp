#include "clients/cpp/access.h"

namespace limber::client {

v1::ListAllowedResponse list_allowed(Client& client) {
  return client.call(v1::ListAllowedRequest{});
}

v1::AllowResponse allow(Client& client, const std::string& key, v1::Role role,
                        const std::string& name) {
  v1::AllowRequest request;
  request.mutable_key()->set_key(key);
  request.mutable_key()->set_role(role);
  request.mutable_key()->set_name(name);
  return client.call(request);
}

v1::RevokeResponse revoke(Client& client, const std::string& key) {
  v1::RevokeRequest request;
  request.set_key(key);
  return client.call(request);
}

}  // namespace limber::client
