#include <gtest/gtest.h>

#include "test/support.hpp"
#include "tools/top_page.hpp"
#include "tools/web_feed.hpp"

namespace cyclops::tools {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

template <class Message>
std::vector<std::uint8_t> bytes_of(const Message& m) {
  std::vector<std::uint8_t> out(static_cast<std::size_t>(m.getEncodedSize()));
  m.encode(out.data(), 0, static_cast<int>(out.size()));
  return out;
}
template <class Message>
bool tell(Board& board, const char* channel, const Message& m, std::int64_t now_ns) {
  const auto b = bytes_of(m);
  return board.take(channel, b.data(), b.size(), now_ns);
}

alarm_t alarm(const char* name, std::int8_t level, const char* quantity) {
  alarm_t a{};
  a.name = name;
  a.level = level;
  a.text = std::string("text of ") + name;
  a.quantity = quantity;
  a.unit = "ms";
  a.value = 245;
  a.limit = 150;
  return a;
}

health_t good_health() {
  health_t h{};
  h.number = 1;
  h.state = health_t::RUNNING;
  h.version = "1.2.3";
  h.profile = "default.toml";
  h.uptime_s = 3725;
  h.frame_rate_hz = 29.97F;
  h.frame_rate_share = 1;
  h.frames_received = 1234;
  h.range_m = 22.5F;
  h.closure_mps = 0.31F;
  h.features_visible = 30;
  h.features_matched = 24;
  h.disk_left_min = -1;
  h.temperature_c = -1;
  h.n_counters = 1;
  h.counters.push_back({"capture.lost.gap", 7});
  return h;
}

/// One whole frame; `jpeg` on demand.
void tell_frame(Board& board, std::int64_t seq, bool jpeg, std::int64_t now_ns) {
  frame_index_t f{};
  f.seq = seq;
  f.width_px = f.height_px = 1024;
  if (jpeg) f.thumbnail_jpeg = {0xff, 0xd8, 0xff, 0xd9};
  f.thumbnail_bytes = static_cast<std::int32_t>(f.thumbnail_jpeg.size());
  prediction_set_t p{};
  p.seq = seq;
  p.items.resize(2);
  p.items[0].id = 4;
  p.items[0].uv_px[0] = 100.25F;
  p.items[1].id = 5;
  p.items[1].visibility = prediction_t::FACING_AWAY;
  p.n = 2;
  track_set_t t{};
  t.seq = seq;
  measurement_set_t m{};
  m.seq = seq;
  m.items.resize(1);
  m.items[0].id = 4;
  m.items[0].accepted = 1;
  m.items[0].raw_px[0] = 101.5;
  m.n = 1;
  EXPECT_TRUE(tell(board, "FRAME", f, now_ns) && tell(board, "PREDICTION", p, now_ns) && tell(board, "TRACK", t, now_ns) && tell(board, "MEASUREMENT", m, now_ns));
}

TEST(Board, IsStaleUntilHealthComesAndAgainASecondAfterTheLast) {
  Board board;
  EXPECT_TRUE(board.stale(0));
  ASSERT_TRUE(tell(board, "HEALTH", good_health(), kSecond));
  EXPECT_FALSE(board.stale(kSecond + kSecond / 2));
  EXPECT_TRUE(board.stale(3 * kSecond));
  EXPECT_DOUBLE_EQ(board.health_age_s(3 * kSecond), 2.0);
}

TEST(Board, CountsHealthThatWasLostOnTheWay) {
  Board board;
  health_t h = good_health();
  for (const std::int64_t number : {1, 2, 5, 6}) {
    h.number = number;
    ASSERT_TRUE(tell(board, "HEALTH", h, kSecond));
  }
  EXPECT_EQ(board.health_lost(), 2);
  h.number = 1;  // a service that began anew
  ASSERT_TRUE(tell(board, "HEALTH", h, kSecond));
  EXPECT_EQ(board.health_lost(), 2);
}

TEST(Board, AFrameOfWhichAPartIsMissingIsNotShown) {
  Board board;
  tell_frame(board, 7, true, 1);
  EXPECT_EQ(board.thumbnail().seq, 7);
  track_set_t t{};
  t.seq = 8;
  measurement_set_t m{};
  m.seq = 8;
  ASSERT_TRUE(tell(board, "TRACK", t, 2) && tell(board, "MEASUREMENT", m, 2));  // FRAME and PREDICTION 8 never came
  EXPECT_EQ(board.newest().seq, 7);
  tell_frame(board, 9, false, 3);
  EXPECT_EQ(board.newest().seq, 9);
  EXPECT_EQ(board.thumbnail().seq, 7);
}

TEST(Board, DamagedMessagesAreCountedAndChangeNothing) {
  Board board;
  ASSERT_TRUE(tell(board, "HEALTH", good_health(), kSecond));
  const auto good = bytes_of(good_health());
  test::Random random(5);
  std::int64_t refused = 0;
  for (int i = 0; i < 3000; ++i) {
    auto bad = good;
    bad.resize(random() % bad.size());
    EXPECT_FALSE(board.take("HEALTH", bad.data(), bad.size(), kSecond));
    EXPECT_EQ(board.refused(), ++refused);
  }
  auto lie = good;  // more counters than bytes: the decoder's exception must end here
  const std::string name = "capture.lost.gap";
  const auto at = std::search(lie.begin(), lie.end(), name.begin(), name.end()) - lie.begin() - 8;
  lie[static_cast<std::size_t>(at)] = 0xff;
  EXPECT_FALSE(board.take("HEALTH", lie.data(), lie.size(), kSecond));
  EXPECT_EQ(board.counter("capture.lost.gap"), 7);
}

TEST(Board, KeepsABoundedHistory) {
  Board board;
  event_t e{};
  for (std::size_t i = 0; i < 2 * Board::kEvents; ++i) ASSERT_TRUE(tell(board, "EVENT", e, 1));
  for (std::size_t i = 0; i < Board::kSamples + 10; ++i) ASSERT_TRUE(tell(board, "HEALTH", good_health(), static_cast<std::int64_t>(i)));
  EXPECT_EQ(board.events().size(), Board::kEvents);
  EXPECT_EQ(board.samples().size(), Board::kSamples);
}

TEST(TopPage, ShowsStateRatesAndLossesAndNothingBeyondItsSize) {
  Board board;
  ASSERT_TRUE(tell(board, "HEALTH", good_health(), kSecond));
  tell_frame(board, 3, false, kSecond);
  for (const auto& [columns, rows] : {std::pair{80, 24}, {120, 40}, {200, 60}}) {
    const Page page = top_page(board, columns, rows, kSecond);
    for (const Span& s : page.spans) {
      EXPECT_LT(s.row, rows);
      EXPECT_LE(s.column + static_cast<int>(s.text.size()), columns) << s.text;
    }
    const std::string text = page.text();
    for (const char* words : {"RUNNING", "1.2.3", "up 1:02:05", "no alarm", "30.0 Hz", "gap 7", "range 22.5 m (74 ft)", "matched 24", "not recording"})
      EXPECT_NE(text.find(words), std::string::npos) << words << "\n" << text;
  }
}

TEST(TopPage, SaysWhereGpsTimeComesFromHowGoodItIsAndHowOldItsNewestMark) {
  Board board;
  health_t h = good_health();
  h.gps_sigma_us = h.gps_age_s = h.strobe_age_s = -1;
  ASSERT_TRUE(tell(board, "HEALTH", h, kSecond));
  EXPECT_NE(top_page(board, 80, 24, kSecond).text().find("CLOCK     GPS by UNKNOWN\n"), std::string::npos);
  h.gps_sigma_us = 20'000;
  ASSERT_TRUE(tell(board, "HEALTH", h, kSecond));
  EXPECT_NE(top_page(board, 80, 24, kSecond).text().find("GPS by arrival of TSPI  sigma 20000 us\n"), std::string::npos);
  h.gps_sigma_us = 12;
  h.gps_age_s = 7.5F;
  h.strobe_age_s = 0.1F;
  h.alarms = {alarm("gps.holdover", alarm_t::WARNING, "gps_age_s")};
  h.n_alarms = 1;
  clock_state_t c{};
  c.gps_drift_ppm = -3.25;
  ASSERT_TRUE(tell(board, "HEALTH", h, kSecond) && tell(board, "CLOCK", c, kSecond));
  const Page page = top_page(board, 120, 40, kSecond);
  EXPECT_NE(page.text().find("GPS by marks  sigma 12 us  mark 7.5 s ago  edge 0.1 s ago  drift -3.25 ppm"), std::string::npos) << page.text();
  for (const Span& s : page.spans)
    if (s.text == "mark 7.5 s ago") { EXPECT_EQ(s.style, Style::kWarning); }
  EXPECT_NE(health_json(board, kSecond).find("\"gps_drift_ppm\":-3.25"), std::string::npos);
}

TEST(TopPage, ColoursAValueByTheAlarmOnItAndPutsFaultsOnTop) {
  Board board;
  health_t h = good_health();
  h.alarms = {alarm("camera.silent", alarm_t::FAULT, "frame_age_ms"), alarm("latency.long", alarm_t::WARNING, "latency_ms_p99")};
  h.n_alarms = 2;
  ASSERT_TRUE(tell(board, "HEALTH", h, kSecond));
  const Page page = top_page(board, 80, 24, kSecond);
  const auto style = [&](const char* words) {
    for (const Span& s : page.spans)
      if (s.text.find(words) != std::string::npos) return s.style;
    ADD_FAILURE() << words;
    return Style::kPlain;
  };
  EXPECT_EQ(style("text of camera.silent"), Style::kFault);
  EXPECT_EQ(style("text of latency.long"), Style::kWarning);
  EXPECT_EQ(style("newest "), Style::kFault);
  EXPECT_EQ(style("p50 0.0  p99"), Style::kWarning);
  EXPECT_EQ(style("matched"), Style::kPlain);
}

TEST(TopPage, OldNumbersAreShownAsStale) {
  Board board;
  ASSERT_TRUE(tell(board, "HEALTH", good_health(), kSecond));
  const Page page = top_page(board, 80, 24, 6 * kSecond);
  EXPECT_NE(page.text().find("STALE: no HEALTH for 5.0 s"), std::string::npos);
  for (const Span& s : page.spans) EXPECT_EQ(s.style, s.row > 0 ? Style::kDim : Style::kFault) << s.text;
}

TEST(TopPage, ControlCharactersOfASenderDoNotReachTheTerminal) {
  Board board;
  health_t h = good_health();
  h.profile = "\x1b[2J\x07";
  ASSERT_TRUE(tell(board, "HEALTH", h, kSecond));
  event_t e{};
  e.source = "\x1b]0;x";
  e.text = "\x9b\n";
  ASSERT_TRUE(tell(board, "EVENT", e, kSecond));
  for (const Span& s : top_page(board, 120, 40, kSecond).spans)
    for (const unsigned char c : s.text) EXPECT_TRUE(c >= 0x20 && c <= 0x7e) << s.text;
}

TEST(WebFeed, GivesEachViewerWhatIsNewerAndOnlyTheNewest) {
  WebFeed feed;
  EXPECT_EQ(feed.wait(0, 0, 0).health, nullptr);
  const auto b = bytes_of(good_health());
  for (int i = 1; i <= 5; ++i)
    for (int flood = 0; flood < 1000; ++flood) feed.put("HEALTH", b.data(), b.size(), i * kSecond);
  const auto news = feed.wait(0, 0, 0);
  EXPECT_EQ(news.health_number, 5U);
  ASSERT_NE(news.health, nullptr);
  EXPECT_NE(news.health->find("\"range_m\":22.5"), std::string::npos);
  EXPECT_EQ(feed.wait(news.health_number, news.frame_number, 0).health, nullptr);
  feed.stop();
  EXPECT_TRUE(feed.wait(news.health_number, news.frame_number, 60'000).stopped);  // at once
}

TEST(WebFeed, AFrameCarriesVisiblePredictionsWithTheirMeasurementsAndThePicture) {
  Board board;
  tell_frame(board, 7, true, 1);
  const std::string text = frame_json(board.thumbnail());
  EXPECT_NE(text.find("\"jpeg\":\"/9j/2Q==\""), std::string::npos) << text;
  EXPECT_NE(text.find("\"id\":4"), std::string::npos);
  EXPECT_NE(text.find("\"p\":[100.25,"), std::string::npos);
  EXPECT_NE(text.find("\"m\":[101.5,"), std::string::npos);
  EXPECT_EQ(text.find("\"id\":5"), std::string::npos);  // not visible
}

TEST(WebFeed, BytesThatAreNoTextAndNumbersThatAreNoneStayJson) {
  Board board;
  health_t h = good_health();
  h.profile = "\xff\xfe<script>";
  h.range_m = std::numeric_limits<float>::quiet_NaN();
  ASSERT_TRUE(tell(board, "HEALTH", h, kSecond));
  const std::string text = health_json(board, kSecond);
  EXPECT_NE(text.find("\"range_m\":null"), std::string::npos);
}

}  // namespace
}  // namespace cyclops::tools
