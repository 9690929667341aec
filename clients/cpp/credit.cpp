#include "clients/cpp/credit.h"

#include <utility>

#include "clients/cpp/client.h"

namespace limber::client {
namespace {

/// Credit is given again when this part of the window is read.
constexpr std::uint64_t kShare = 4;

}  // namespace

Credit::Credit(std::string client_name)
    : client_name_(std::move(client_name)), name_(random_id()) {}

std::string Credit::request() {
  v1::Request request;
  request.set_version(kProtocolVersion);
  request.set_id(++id_);
  request.set_client_name(client_name_);
  auto& follow = *request.mutable_follow();
  follow.set_stream(name_);
  follow.set_read_bytes(read_bytes_);
  follow.set_instance(instance_);
  for (const auto& [prefix, after] : topics_) {
    auto& topic = *follow.add_topics();
    topic.set_prefix(prefix);
    topic.set_after(after);
  }
  granted_ = read_bytes_;
  return request.SerializeAsString();
}

bool Credit::note(const std::string& topic, const v1::StreamMessage& message,
                  const v1::StreamPosition& position) {
  if (const auto found = topics_.find(topic); found != topics_.end())
    found->second = message.sequence();
  instance_ = message.instance();
  read_bytes_ = position.sent_bytes();
  // A server that was restarted counts from 0 again.
  return read_bytes_ < granted_ || read_bytes_ - granted_ >= window_bytes_ / kShare;
}

void Credit::note(const v1::FollowResponse& answer) {
  if (answer.window_bytes() > 0) window_bytes_ = answer.window_bytes();
  if (!answer.cut_off().empty()) cut_off_ = answer.cut_off();
}

}  // namespace limber::client
