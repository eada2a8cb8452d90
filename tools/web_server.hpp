#pragma once
/// The page of cyclops-web and the data behind it, over HTTP on 127.0.0.1.
///
///   GET /          the page: one file with all its script and style
///   GET /events    server-sent events `health` (5 Hz), `frame` (as thumbnails come), `alive` (when neither came for 1 s)
///   GET /history   the last ten minutes for the strip charts
///   GET /health    newest HEALTH as JSON, for scripts
///
/// Refused  methods but GET and HEAD (405); a Host that is not this server, so that a foreign page whose name was made to
///          point here gets nothing (403); a foreign Origin (403); any other path (404). No file is ever opened for a request.
/// Limits   kMostViewers of /events and 4 readers of /history at a time (503 beyond); a reader that takes nothing for 2 s is cut off; one
///          request a connection, without body. Whoever holds connections, or all these places, keeps nobody from the page and
///          from /health, which a page without a place in /events asks instead (tools/web_door.hpp).
/// Threads  its own; start and stop by one.
#include <memory>

#include "base/result.hpp"
#include "tools/web_feed.hpp"

namespace cyclops::tools {

class WebServer {
 public:
  static constexpr int kMostViewers = 8;
  explicit WebServer(WebFeed& feed);
  ~WebServer();
  /// `port` 0: any free one. The port that is served.
  Result<int> start(int port);
  void stop();

 private:
  struct State;
  std::unique_ptr<State> s_;
};

/// The page itself, part of the program.
[[nodiscard]] std::string_view web_page();
/// The Content-Security-Policy that allows the page's own script and style, by their hashes, and nothing else.
[[nodiscard]] std::string web_policy(std::string_view page);

}  // namespace cyclops::tools
