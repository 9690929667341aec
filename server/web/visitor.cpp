// Compiled alone: the templates of Beast's HTTP take long.

#include "server/web/visitor.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <optional>
#include <utility>

#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket/rfc6455.hpp>

#include "server/log/log.h"
#include "server/web/headers.h"
#include "server/web/page_socket.h"

namespace limber::server::web {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using Fault = boost::system::error_code;
using Request = http::request<http::empty_body>;
using Response = http::response<http::span_body<const char>>;

constexpr const char* kPlainText = "text/plain; charset=utf-8";
constexpr std::uint32_t kHeadBytes = 16u << 10;
constexpr std::size_t kVisitors = 64;  // connections that are no WebSockets
constexpr std::chrono::seconds kTimeToWrite{30}, kTimeToLinger{1};
constexpr std::size_t kLingerBytes = 1u << 20;
constexpr int kSendBuffer = 256 << 10;  // what a page that sleeps finds first, old frames
// A machine that went away is noticed within 20 s, as by heartbeats of the sockets.
constexpr int kAliveIdle = 10, kAliveInterval = 5, kAliveCount = 2;

std::string_view text(beast::string_view view) { return {view.data(), view.size()}; }

/// The value of a field that comes once; else nothing.
std::string_view only(const Request& request, http::field field) {
  return request.count(field) == 1 ? text(request[field]) : std::string_view();
}

class Visitor final : public Closable, public std::enable_shared_from_this<Visitor> {
 public:
  Visitor(Site& site, tcp::socket socket) : site_(site), stream_(std::move(socket)) {
    Fault ignored;
    local_address_ = stream_.socket().local_endpoint(ignored).address().to_string();
  }

  void read() {
    parser_.emplace();
    parser_->header_limit(kHeadBytes);
    parser_->body_limit(0);
    stream_.expires_after(site_.options.handshake);
    http::async_read(
        stream_, buffer_, *parser_,
        [self = shared_from_this()](const Fault& fault, std::size_t) { self->has_read(fault); });
  }
  void finish() override { drop(); }
  void drop() override {
    Fault ignored;
    stream_.socket().close(ignored);
  }

 private:
  void has_read(const Fault& fault) {
    if (fault == http::error::header_limit || fault == http::error::buffer_overflow)
      return refuse(431, "The head of the request is too long.", Then::kClose);
    if (fault == http::error::unexpected_body || fault == http::error::body_limit)
      return refuse(413, "Requests have no body.", Then::kClose);
    if (fault.category() == http::make_error_code(http::error::bad_version).category() &&
        fault != http::error::end_of_stream && fault != http::error::partial_message)
      return refuse(400, "This is not HTTP/1.1.", Then::kClose);
    if (fault) return drop();
    request_ = parser_->release();
    if (!has_known_coding())
      return refuse(501, "Of transfer codings this server knows chunked alone.", Then::kClose);
    const Visit visit{text(request_.method_string()),
                      text(request_.target()),
                      only(request_, http::field::host),
                      only(request_, http::field::origin),
                      request_.count(http::field::origin) > 1,
                      beast::websocket::is_upgrade(request_),
                      local_address_};
    const Verdict verdict = site_.door.judge(visit);
    host_ = verdict.status == 403 ? "" : std::string(visit.host);
    switch (verdict.way) {
      case Verdict::Way::kFile:
        return send_file(verdict.path);
      case Verdict::Way::kProbe:
        return answer_probe(verdict.path);
      case Verdict::Way::kRequests:
        return become_page(PageKind::kRequests, verdict.role);
      case Verdict::Way::kStream:
        return become_page(PageKind::kStream, verdict.role);
      case Verdict::Way::kRefused:
        // Neither a probe nor a mistake: an unauthorised visitor.
        if (verdict.status == 401 || verdict.status == 403) {
          site_.counters.web_refused.fetch_add(1, std::memory_order_relaxed);
          log::debug("a page was refused: {} {}", verdict.status, verdict.text);
        }
        return refuse(verdict.status, verdict.text);
    }
  }

  /// Behind another coding it cannot be told where the request ends and the next one begins.
  [[nodiscard]] bool has_known_coding() const {
    const auto codings = request_.count(http::field::transfer_encoding);
    return codings == 0 ||
           beast::iequals(request_[http::field::transfer_encoding], codings == 1 ? "chunked" : "");
  }

  void become_page(PageKind kind, Role role) {
    // Data that the page sent before it was accepted violates the protocol.
    if (buffer_.size() > 0)
      return refuse(400, "Nothing may be sent before the answer.", Then::kClose);
    if (!site_.shares.take_place(role))
      return refuse(503,
                    "As many pages of this role as may be are connected (limberd "
                    "--web-connections).");
    stream_.expires_never();
    open_page(site_, std::move(stream_), std::move(request_), kind, role);
  }

  void send_file(const std::string& path) {
    const auto file = site_.files.find(path);
    if (!file) return refuse(404, "There is no such file.");
    Response response = make_response(200, file->type);
    owner_ = file->owner;
    response.set(http::field::cache_control, file->tag.empty() ? "no-store" : "no-cache");
    if (!file->tag.empty()) response.set(http::field::etag, file->tag);
    if (!file->tag.empty() && only(request_, http::field::if_none_match) == file->tag) {
      response.result(http::status::not_modified);
      return send(std::move(response), {}, 0);
    }
    send(std::move(response), file->bytes, file->bytes.size());
  }

  void answer_probe(const std::string& path) try {
    if (path == "/healthz") return say(200, kPlainText, "ok\n");
    // As Prometheus wants it: https://prometheus.io/docs/instrumenting/exposition_formats/
    if (path == "/metrics")
      return say(200, "text/plain; version=0.0.4; charset=utf-8", site_.probes.metrics());
    const std::vector<std::string> reasons = site_.probes.not_ready();
    if (reasons.empty()) return say(200, kPlainText, "ready\n");
    say(503, kPlainText, fmt::format("{}\n", fmt::join(reasons, "\n")));
  } catch (const std::exception& fault) {
    log::error("web: {}: {}", path, fault.what());
    refuse(500, "It cannot be said how the server does.");
  }

  void say(unsigned status, const char* type, std::string words) {
    Response response = make_response(status, type);
    response.set(http::field::cache_control, "no-store");
    owner_ = std::make_shared<const std::string>(std::move(words));
    send(std::move(response), *owner_, owner_->size());
  }

  enum class Then { kGoOn, kClose };
  void refuse(unsigned status, std::string words, Then then = Then::kGoOn) {
    Response response = make_response(status, kPlainText);
    response.set(http::field::cache_control, "no-store");
    if (status == 405) response.set(http::field::allow, "GET, HEAD");
    if (status == 426) response.set(http::field::upgrade, "websocket");
    if (then == Then::kClose) response.keep_alive(false);
    words += '\n';
    owner_ = std::make_shared<const std::string>(std::move(words));
    send(std::move(response), *owner_, owner_->size());
  }

  [[nodiscard]] Response make_response(unsigned status, const std::string& type) const {
    Response response(static_cast<http::status>(status), 11);
    response.keep_alive(request_.keep_alive());
    response.set(http::field::content_type, type);
    for (const auto& [name, value] : security_headers(host_, site_.options.frame_ancestors))
      response.set(name, value);
    return response;
  }

  void send(Response response, std::string_view body, std::size_t length) {
    if (response.result() != http::status::not_modified) response.content_length(length);
    if (request_.method() != http::verb::head) response.body() = {body.data(), body.size()};
    response_.emplace(std::move(response));
    stream_.expires_after(kTimeToWrite);
    const auto has_sent = [self = shared_from_this()](const Fault& fault, std::size_t) {
      self->has_sent(fault);
    };
    if (request_.method() == http::verb::head) {
      serializer_.emplace(*response_);
      http::async_write_header(stream_, *serializer_, has_sent);
    } else {
      http::async_write(stream_, *response_, has_sent);
    }
  }

  void has_sent(const Fault& fault) {
    const bool goes_on = !fault && response_->keep_alive() && !site_.is_stopping;
    serializer_.reset();
    response_.reset();
    owner_.reset();
    request_ = {};
    if (goes_on) return read();
    Fault ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    stream_.expires_after(kTimeToLinger);
    linger();
  }

  /// Closing a socket with unread bytes would discard the answer before the client has read it.
  void linger() {
    buffer_.clear();
    stream_.async_read_some(buffer_.prepare(kHeadBytes),
                            [self = shared_from_this()](const Fault& fault, std::size_t bytes) {
                              self->lingered_ += bytes;
                              if (fault || self->lingered_ > kLingerBytes) return self->drop();
                              self->linger();
                            });
  }

  Site& site_;
  TcpStream stream_;
  std::string local_address_, host_;
  beast::flat_buffer buffer_{2 * kHeadBytes};
  std::size_t lingered_ = 0;  // bytes
  std::optional<http::request_parser<http::empty_body>> parser_;
  Request request_;
  std::optional<Response> response_;
  std::optional<http::serializer<false, http::span_body<const char>>> serializer_;
  std::shared_ptr<const std::string> owner_;  // of the body
};

void keep_alive(tcp::socket& socket) {
  const int file = socket.native_handle(), on = 1;
  ::setsockopt(file, SOL_SOCKET, SO_KEEPALIVE, &on, sizeof on);
  ::setsockopt(file, IPPROTO_TCP, TCP_KEEPIDLE, &kAliveIdle, sizeof kAliveIdle);
  ::setsockopt(file, IPPROTO_TCP, TCP_KEEPINTVL, &kAliveInterval, sizeof kAliveInterval);
  ::setsockopt(file, IPPROTO_TCP, TCP_KEEPCNT, &kAliveCount, sizeof kAliveCount);
}

/// A client that opens connections and requests nothing is dropped for later ones.
void make_room(Site& site) {
  auto& visitors = site.visitors;
  visitors.erase(std::remove_if(visitors.begin(), visitors.end(),
                                [](const auto& visitor) { return visitor.expired(); }),
                 visitors.end());
  while (visitors.size() >= kVisitors) {
    if (const auto oldest = visitors.front().lock()) oldest->drop();
    visitors.pop_front();
  }
}

}  // namespace

void welcome(Site& site, tcp::socket socket) {
  Fault ignored;
  socket.set_option(tcp::no_delay(true), ignored);
  socket.set_option(tcp::socket::send_buffer_size(kSendBuffer), ignored);
  keep_alive(socket);
  make_room(site);
  const auto visitor = std::make_shared<Visitor>(site, std::move(socket));
  site.visitors.push_back(visitor);
  visitor->read();
}

}  // namespace limber::server::web
