#pragma once

#include <memory>

#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>

#include "server/web/site.h"
#include "server/web/tcp_stream.h"

namespace limber::server::web {

enum class PageKind { kRequests, kStream };

/// Makes a WebSocket of a connection after its request was accepted. It lives until its connection
/// ends, and then leaves its place.
/// @param role  what the page may do
/// @pre a place of its role was taken for it
void open_page(Site& site, TcpStream stream,
               boost::beast::http::request<boost::beast::http::empty_body> request, PageKind kind,
               Role role);

}  // namespace limber::server::web
