// Compiled alone: the templates of Beast's WebSockets take long.

#include "server/web/page_socket.h"

#include <array>
#include <optional>
#include <utility>

#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/websocket.hpp>

#include "server/log/log.h"
#include "server/web/page.h"

namespace limber::server::web {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using Fault = boost::system::error_code;

constexpr std::size_t kReadBytes = 64u << 10;      // at a time: the buffer grows with them
constexpr std::uint64_t kSubscriptionBytes = 191;  // as the XPUB socket: a prefix of 190
constexpr std::size_t kReasonBytes = 123;
constexpr std::chrono::seconds kTimeToClose{10};
// Limit of a compressed message: so many bytes for each received one, and so many in any case.
// Meshes and arrays come to a tenth of that; deflate unpacks zeros to a thousand.
constexpr std::uint64_t kMostInflation = 100, kFreeInflation = 1 << 20;

class PageSocket final : public Closable, public std::enable_shared_from_this<PageSocket> {
 public:
  PageSocket(Site& site, TcpStream stream, beast::http::request<beast::http::empty_body> request,
             std::shared_ptr<Page> page, PageKind kind, Role role)
      : site_(site),
        role_(role),
        socket_(std::move(stream)),
        deadline_(site.io),
        request_(std::move(request)),
        page_(std::move(page)) {
    beast::get_lowest_layer(socket_).expires_never();  // the WebSocket has its own
    socket_.set_option(websocket::stream_base::timeout{site.options.handshake, site.options.idle,
                                                       /*keep_alive_pings=*/true});
    socket_.read_message_max(kind == PageKind::kRequests ? site.shares.largest_message(role)
                                                         : kSubscriptionBytes);
    socket_.binary(true);
    socket_.auto_fragment(false);
    if (site.options.deflate == Deflate::kOn) {
      websocket::permessage_deflate deflate;
      deflate.server_enable = true;
      deflate.compLevel = 1;
      socket_.set_option(deflate);
    }
  }
  void start() {
    site_.sockets.emplace(this, shared_from_this());
    site_.counters.web_connections.fetch_add(1, std::memory_order_relaxed);
    socket_.async_accept(request_, [self = shared_from_this()](const Fault& fault) {
      if (fault) return self->drop();
      self->accepted();
    });
  }
  void finish() override {
    is_finishing_ = true;
    pump();
  }
  void drop() override {
    const auto self = shared_from_this();
    end();
    Fault ignored;
    beast::get_lowest_layer(socket_).socket().close(ignored);
  }

 private:
  void accepted() {
    is_open_ = true;
    request_ = {};
    page_->open([weak = weak_from_this(), &io = site_.io] {
      asio::post(io, [weak] {
        if (const auto self = weak.lock()) self->pump();
      });
    });
    pump();
  }

  /// Does whatever can be done now.
  void pump() {
    if (!is_open_ || is_closing_) return;
    if (auto closing = page_->closing()) return close(*closing);
    if (!is_reading_ && !page_->is_full()) read();
    if (is_writing_) return;
    if (auto message = page_->next()) return write(std::move(*message));
    if (is_finishing_) close({kGoingAway, "limberd stops"});
  }

  void read() {
    is_reading_ = true;
    if (!buffer_) buffer_.emplace(asio::dynamic_buffer(incoming_));
    socket_.async_read_some(*buffer_, kReadBytes,
                            [self = shared_from_this()](const Fault& fault, std::size_t) {
                              self->is_reading_ = false;
                              self->has_read(fault);
                            });
  }

  void has_read(const Fault& fault) {
    if (fault) {
      log::debug("a page has ended: {}", fault.message());
      return drop();
    }
    if (is_closing_) return forget_incoming();  // async_close() reads on
    if (!socket_.got_binary()) return close({kUnsupported, "messages are binary"});
    if (socket_.is_message_done()) {
      buffer_.reset();
      page_->receive(std::exchange(incoming_, {}));
      give_bytes_back();
      received_before_ = received();
      return pump();
    }
    if (incoming_.size() > kFreeInflation + kMostInflation * (received() - received_before_))
      return close({kTooBig, "a compressed message unpacks to far more than was sent"});
    if (!take_bytes())
      return close({kTryAgain, "too much of other unfinished messages waits to be received"});
    read();
  }

  [[nodiscard]] std::uint64_t received() {
    return beast::get_lowest_layer(socket_).rate_policy().bytes();
  }
  /// Takes the share for the received part of the message.
  [[nodiscard]] bool take_bytes() {
    const std::uint64_t bytes = incoming_.size();
    if (bytes <= Shares::kFreeBytes + taken_bytes_) return true;
    const std::uint64_t more = bytes - Shares::kFreeBytes - taken_bytes_;
    if (!site_.shares.take_bytes(role_, more)) return false;
    taken_bytes_ += more;
    return true;
  }
  void give_bytes_back() { site_.shares.give_bytes_back(role_, std::exchange(taken_bytes_, 0)); }

  void write(Page::Message message) {
    is_writing_ = true;
    outgoing_ = std::move(message);
    const std::array<asio::const_buffer, 2> parts{asio::buffer(outgoing_.head),
                                                  asio::buffer(outgoing_.body)};
    socket_.async_write(parts, [self = shared_from_this()](const Fault& fault, std::size_t) {
      self->is_writing_ = false;
      self->outgoing_ = {};
      if (fault) return self->drop();
      self->pump();
    });
  }

  void close(const Closing& closing) {
    if (is_closing_) return;
    is_closing_ = true;
    log::debug("a page is closed: {} {}", closing.code, closing.reason);
    page_->leave();
    if (!is_reading_) forget_incoming();
    // A page that reads nothing does not get the reason.
    deadline_.expires_after(kTimeToClose);
    deadline_.async_wait([self = shared_from_this()](const Fault& fault) {
      if (!fault) self->drop();
    });
    const websocket::close_reason reason(static_cast<websocket::close_code>(closing.code),
                                         closing.reason.substr(0, kReasonBytes));
    socket_.async_close(reason, [self = shared_from_this()](const Fault&) { self->drop(); });
  }

  /// @pre nothing is read into it
  void forget_incoming() {
    buffer_.reset();
    incoming_ = {};
    give_bytes_back();
  }

  void end() {
    if (has_ended_) return;
    has_ended_ = true;
    is_closing_ = true;
    page_->leave();
    give_bytes_back();
    site_.shares.leave_place(role_);
    deadline_.cancel();
    site_.sockets.erase(this);
    site_.counters.web_connections.fetch_sub(1, std::memory_order_relaxed);
  }

  Site& site_;
  const Role role_;
  websocket::stream<TcpStream> socket_;
  asio::steady_timer deadline_;  // of closing
  beast::http::request<beast::http::empty_body> request_;
  const std::shared_ptr<Page> page_;
  std::string incoming_;
  std::optional<asio::dynamic_string_buffer<char, std::char_traits<char>, std::allocator<char>>>
      buffer_;                         // of incoming_
  std::uint64_t taken_bytes_ = 0;      // of the shares, for incoming_
  std::uint64_t received_before_ = 0;  // of the connection, before incoming_ [bytes]
  Page::Message outgoing_;
  bool is_open_ = false, is_reading_ = false, is_writing_ = false;
  bool is_finishing_ = false, is_closing_ = false, has_ended_ = false;
};

}  // namespace

void open_page(Site& site, TcpStream stream, beast::http::request<beast::http::empty_body> request,
               PageKind kind, Role role) {
  std::shared_ptr<Page> page;
  if (kind == PageKind::kRequests) {
    page = std::make_shared<RequestPage>(site.transport, role);
  } else {
    page =
        std::make_shared<StreamPage>(site.transport, role, site.counters, site.options.queue_bytes);
  }
  std::make_shared<PageSocket>(site, std::move(stream), std::move(request), std::move(page), kind,
                               role)
      ->start();
}

}  // namespace limber::server::web
