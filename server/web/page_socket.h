#pragma once

#include <memory>

#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>

#include "server/web/site.h"

namespace limber::server::web {

enum class PageKind { kRequests, kStream };

/// Makes a WebSocket of a connection whose request was let in. It lives until its connection ends.
/// @param role  what the page may do
void open_page(Site& site, boost::beast::tcp_stream stream,
               boost::beast::http::request<boost::beast::http::empty_body> request, PageKind kind,
               Role role);

}  // namespace limber::server::web
