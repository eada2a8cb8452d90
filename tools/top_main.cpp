#include <csignal>
#include <cstdio>

#include <CLI/CLI.hpp>
#include <clocale>
#include <curses.h>
#include <unistd.h>

#include "tools/listener.hpp"
#include "tools/top_page.hpp"

namespace {

using cyclops::steady_now_ns;
using namespace cyclops::tools;

enum Exit { kGood = 0, kCannotRun = 1, kAlarm = 2, kSilent = 3 };
constexpr int kDraw_ms = 200;

volatile std::sig_atomic_t g_stop = 0;

int attributes(Style style) {
  switch (style) {
    case Style::kPlain: return A_NORMAL;
    case Style::kDim: return has_colors() ? COLOR_PAIR(4) : A_DIM;
    case Style::kTitle: return A_REVERSE;
    case Style::kGood: return COLOR_PAIR(1) | A_BOLD;
    case Style::kWarning: return COLOR_PAIR(2) | A_BOLD;
    case Style::kFault: return COLOR_PAIR(3) | A_BOLD | (has_colors() ? 0 : A_REVERSE);
  }
  return A_NORMAL;
}

void draw(const Page& page) {
  erase();
  for (const Span& s : page.spans) {
    attrset(attributes(s.style));
    mvaddnstr(s.row, s.column, s.text.c_str(), static_cast<int>(s.text.size()));
  }
  refresh();
}

/// ncurses from construction to destruction: the terminal is given back whatever happens.
struct Screen {
  explicit Screen(SCREEN* made) : screen(made) {
    cbreak();
    noecho();
    curs_set(0);
    nodelay(stdscr, TRUE);
    keypad(stdscr, TRUE);
    if (has_colors()) {
      start_color();
      use_default_colors();
      init_pair(1, COLOR_GREEN, -1);
      init_pair(2, COLOR_YELLOW, -1);
      init_pair(3, COLOR_WHITE, COLOR_RED);
      init_pair(4, COLOR_CYAN, -1);
    }
  }
  ~Screen() {
    endwin();
    delscreen(screen);
  }
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;
  SCREEN* screen;
};

int watch(Listener& listener, Board& board) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, [](int) { g_stop = 1; });
  std::setlocale(LC_ALL, "");
  SCREEN* made = isatty(STDIN_FILENO) != 0 && isatty(STDOUT_FILENO) != 0 ? newterm(nullptr, stdout, stdin) : nullptr;
  if (made == nullptr) {
    std::fprintf(stderr, "cyclops-top: this is no terminal, or TERM is not set; --once prints plain text\n");
    return kCannotRun;
  }
  const Screen screen(made);
  std::int64_t next_ns = 0;
  while (g_stop == 0) {
    listener.wait(kDraw_ms / 4);
    listener.handle();
    const int key = getch();
    if (key == 'q' || key == 'Q') break;
    if (const std::int64_t now = steady_now_ns(); now >= next_ns || key == KEY_RESIZE) {
      draw(top_page(board, COLS, LINES, now));
      next_ns = now + kDraw_ms * 1'000'000LL;
    }
  }
  return kGood;
}

int once(Listener& listener, Board& board, double wait_s, int columns, int rows) {
  const std::int64_t start = steady_now_ns();
  const auto gone_s = [&] { return static_cast<double>(steady_now_ns() - start) * 1e-9; };
  while (gone_s() < wait_s && !(board.health() && gone_s() > 1)) {  // a second of events and frames beside HEALTH
    listener.wait(50);
    listener.handle();
  }
  const std::int64_t now = steady_now_ns();
  std::fputs(top_page(board, columns, rows, now).text().c_str(), stdout);
  return board.stale(now) ? kSilent : board.health()->n_alarms > 0 ? kAlarm : kGood;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Shows on one page of a terminal how the service is doing. It only listens."};
  app.set_version_flag("--version", CYCLOPS_VERSION);
  app.footer("With --once, exit code: 0 no alarm, 2 alarms, 3 no HEALTH came; 1 cannot run.");
  std::string url;
  bool only_once = false;
  double wait_s = 3;
  int columns = 80, rows = 24;
  app.add_option("--lcm", url, "LCM URL; LCM_DEFAULT_URL when left out");
  app.add_flag("--once", only_once, "print the page once as plain text and end");
  app.add_option("--wait", wait_s, "with --once: seconds to wait for HEALTH")->capture_default_str()->check(CLI::Range(0.1, 3600.0));
  app.add_option("--columns", columns, "with --once")->capture_default_str()->check(CLI::Range(80, 400));
  app.add_option("--rows", rows, "with --once")->capture_default_str()->check(CLI::Range(24, 200));
  CLI11_PARSE(app, argc, argv);
  limit_memory(std::size_t{1} << 30);
  Board board;
  auto listener = Listener::open(url, [&board](std::string_view channel, const void* data, std::size_t size) { board.take(channel, data, size, steady_now_ns()); });
  if (!listener.ok()) {
    std::fprintf(stderr, "cyclops-top: %s\n", listener.error().message().c_str());
    return kCannotRun;
  }
  return only_once ? once(**listener, board, wait_s, columns, rows) : watch(**listener, board);
}
