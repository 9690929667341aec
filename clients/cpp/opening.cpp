#include "clients/cpp/opening.h"

#include <algorithm>
#include <utility>

#include "clients/cpp/open_session.h"
#include "clients/cpp/session_reference.h"
#include "clients/cpp/waiting.h"

namespace limber::client {

Milliseconds large(const Client& client) { return std::max(client.options().timeout, kLarge); }

v1::OpenSessionResponse begin_session(Client& client, v1::Scene scene, const std::string& session) {
  v1::OpenSessionRequest request;
  *request.mutable_scene() = std::move(scene);
  request.set_session(session);
  return client.call(request, large(client));
}

std::string open_session(Client& client, const v1::Scene& scene, const std::string& session,
                         Milliseconds timeout) {
  const v1::OpenSessionResponse opened = begin_session(client, scene, session);
  std::string reference = session_reference(opened.session(), opened.uid());
  try {
    wait_until_ready(client, opened, {}, timeout);
  } catch (...) {
    try {
      OpenSession(client, reference).close();
    } catch (const ClientError&) {  // why it was not built matters more
    }
    throw;
  }
  return reference;
}

}  // namespace limber::client
