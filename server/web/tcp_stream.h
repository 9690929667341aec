#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/core/rate_policy.hpp>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace limber::server::web {

/// A policy of rates (of Boost.Beast) that sets no bound, but counts received bytes.
class CountedReads {
 public:
  /// So far.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  friend class boost::beast::rate_policy_access;
  static constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

  [[nodiscard]] std::size_t available_read_bytes() const noexcept { return kAll; }
  [[nodiscard]] std::size_t available_write_bytes() const noexcept { return kAll; }
  void transfer_read_bytes(std::size_t bytes) noexcept { bytes_ += bytes; }
  void transfer_write_bytes(std::size_t /*bytes*/) const noexcept {}
  void on_timer() const noexcept {}

  std::uint64_t bytes_ = 0;
};

/// A connection of a page.
using TcpStream =
    boost::beast::basic_stream<boost::asio::ip::tcp, boost::asio::any_io_executor, CountedReads>;

}  // namespace limber::server::web
