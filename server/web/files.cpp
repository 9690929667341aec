#include "server/web/files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <sstream>
#include <utility>

#include "engine/base/hash.h"
#include "server/web/compiled_in.h"

namespace limber::server::web {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxBytes = 64u << 20;  // of a file that is read from a folder

constexpr std::string_view kNotBuilt = R"(<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>limber</title></head><body>
<h1>limberd serves no page yet</h1>
<p>This limberd was built without its page. In the folder of the sources:</p>
<pre>npm --prefix clients/web ci
npm --prefix clients/web run build
scripts/build release limberd</pre>
<p>and start limberd again. A page that was built can be served without building limberd again:
<code>limberd --web --web-root clients/web/dist</code>.</p>
<p>WebSockets for other clients are there: docs/protocol.md, "Browsers".</p>
</body></html>
)";

std::string tag_of(std::string_view bytes) {
  return fmt::format("\"{}\"", ContentHash().add(bytes).hex());
}

bool is_plain(std::string_view path) {
  constexpr std::string_view kBesides = "._-~@+/";
  const bool is_spelled = std::all_of(path.begin(), path.end(), [&](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           kBesides.find(c) != std::string_view::npos;
  });
  return is_spelled && path.starts_with('/') && path.find("/.") == std::string_view::npos &&
         path.find("//") == std::string_view::npos;
}

}  // namespace

std::string content_type(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 19> kTypes{{
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".mjs", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".json", "application/json"},
      {".map", "application/json"},
      {".webmanifest", "application/manifest+json"},
      {".txt", "text/plain; charset=utf-8"},
      {".md", "text/plain; charset=utf-8"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".jpg", "image/jpeg"},
      {".ico", "image/x-icon"},
      {".webp", "image/webp"},
      {".wasm", "application/wasm"},
      {".woff2", "font/woff2"},
      {".glb", "model/gltf-binary"},
      {".mp4", "video/mp4"},
      {".obj", "text/plain; charset=utf-8"},
  }};
  for (const auto& [ending, type] : kTypes) {
    if (name.ends_with(ending)) return std::string(type);
  }
  return "application/octet-stream";
}

Files::Files(const fs::path& root) {
  if (!root.empty()) {
    root_ = fs::canonical(root);
    return;
  }
  for (const CompiledIn& file : compiled_in_files()) {
    const std::string_view bytes(file.begin, static_cast<std::size_t>(file.end - file.begin));
    compiled_in_.emplace(fmt::format("/{}", file.path),
                         File{bytes, nullptr, content_type(file.path), tag_of(bytes)});
  }
  if (compiled_in_.empty())
    compiled_in_.emplace("/index.html", File{kNotBuilt, nullptr, content_type(".html"), ""});
}

std::optional<File> Files::find(std::string_view path) const {
  if (path == "/") path = "/index.html";
  if (!root_.empty()) return read(path);
  const auto found = compiled_in_.find(path);
  return found == compiled_in_.end() ? std::nullopt : std::optional(found->second);
}

std::optional<File> Files::read(std::string_view path) const {
  if (!is_plain(path)) return std::nullopt;
  std::error_code fault;
  const fs::path file = fs::canonical(root_ / fs::path(path.substr(1)), fault);
  if (fault) return std::nullopt;
  const auto [rest, unused] = std::mismatch(root_.begin(), root_.end(), file.begin(), file.end());
  if (rest != root_.end() || !fs::is_regular_file(file, fault) ||
      fs::file_size(file, fault) > kMaxBytes || fault)
    return std::nullopt;
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) return std::nullopt;
  auto owner = std::make_shared<const std::string>(std::move(text).str());
  return File{*owner, owner, content_type(path), ""};
}

}  // namespace limber::server::web
