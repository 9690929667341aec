#pragma once

#include <boost/asio/ip/tcp.hpp>

#include "server/web/site.h"

namespace limber::server::web {

/// Answers the HTTP requests of a new connection, until it ends or becomes a WebSocket.
void welcome(Site& site, boost::asio::ip::tcp::socket socket);

}  // namespace limber::server::web
