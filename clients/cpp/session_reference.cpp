#include "clients/cpp/session_reference.h"

#include <utility>

namespace limber::client {

std::string session_reference(const std::string& name, std::uint64_t uid) {
  return uid == 0 ? name : name + '@' + std::to_string(uid);
}

std::string session_name(const std::string& reference) {
  return reference.substr(0, reference.find('@'));
}

SessionReference::SessionReference(const Client& client, std::string session, Naming naming)
    : session_(std::move(session)), naming_(naming), instance_(client.instance()) {}

const std::string& SessionReference::get(Client& client) {
  if (naming_ == Naming::kAsGiven || session_.find('@') != std::string::npos) return session_;
  if (!instance_.empty() && client.instance() != instance_) {
    throw ServerRestarted(v1::ERROR_CODE_RESTARTED, "session",
                          "limberd was restarted: session '" + session_ + "' of before is gone");
  }
  v1::GetSessionRequest request;
  request.set_session(session_);
  session_ = session_reference(session_, client.call(request).status().uid());
  return session_;
}

}  // namespace limber::client
