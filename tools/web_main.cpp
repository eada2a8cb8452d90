#include <csignal>
#include <cstdio>

#include <CLI/CLI.hpp>

#include "tools/listener.hpp"
#include "tools/web_server.hpp"

namespace {

volatile std::sig_atomic_t g_stop = 0;

int fail(const cyclops::Error& error) {
  std::fprintf(stderr, "cyclops-web: %s\n", error.message().c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  using cyclops::steady_now_ns;
  using namespace cyclops::tools;
  CLI::App app{"Serves a page that shows how the service is doing, to browsers on this computer only. It only listens to LCM."};
  app.set_version_flag("--version", CYCLOPS_VERSION);
  std::string url;
  int port = 8642;
  app.add_option("--lcm", url, "LCM URL; LCM_DEFAULT_URL when left out");
  app.add_option("--port", port, "on 127.0.0.1; 0: any free one")->capture_default_str()->check(CLI::Range(0, 65535));
  CLI11_PARSE(app, argc, argv);
  limit_memory(std::size_t{2} << 30);
  std::signal(SIGPIPE, SIG_IGN);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, [](int) { g_stop = 1; });

  WebFeed feed;
  auto listener = Listener::open(url, [&feed](std::string_view channel, const void* data, std::size_t size) { feed.put(channel, data, size, steady_now_ns()); });
  if (!listener.ok()) return fail(listener.error());
  WebServer server(feed);
  const auto served = server.start(port);
  if (!served.ok()) return fail(served.error());
  std::printf("http://127.0.0.1:%d/\n", *served);
  std::fflush(stdout);
  while (g_stop == 0)
    if ((*listener)->wait(200)) (*listener)->handle();
  server.stop();
  return 0;
}
