// The code that reads GPIO lines, on a real kernel's character device: lines of a gpio-sim chip, pulsed by hil/gpio_sim.
// `make gpio` runs it in a virtual machine; on a bench that has gpio-sim: test/gpio/bench.sh.
// CYCLOPS_GPIO_SIM names the chip in configfs (its label is the same).
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <thread>
#include <vector>

#include "capture/strobe_source.hpp"
#include "hil/gige_device.hpp"
#include "hil/gpio_sim.hpp"
#include "timesync/frame_stamper.hpp"

namespace cyclops {
namespace {

using hil::GpioSimLine;
using hil::monotonic_ns;

constexpr int kStrobe = 17, kPps = 18;

std::string chip() {
  const char* name = std::getenv("CYCLOPS_GPIO_SIM");
  return name != nullptr ? name : "cyclops-sim";
}
std::string in_config(const std::string& file) { return "/sys/kernel/config/gpio-sim/" + chip() + "/" + file; }
std::string word(const std::string& path) {
  std::string out;
  std::ifstream(path) >> out;
  return out;
}
std::string folder() { return "/sys/devices/platform/" + word(in_config("dev_name")) + "/" + word(in_config("bank0/chip_name")); }

StrobeConfig config(int line = kStrobe) {
  StrobeConfig c;
  c.kind = StrobeKind::kGpio;
  c.chip = chip();
  c.line = line;
  return c;
}

std::unique_ptr<GpioSimLine> pulser(int line = kStrobe) {
  auto opened = GpioSimLine::open(folder(), line);
  EXPECT_TRUE(opened.ok()) << opened.error().message();
  return std::move(opened).value();
}

struct Reader {
  const char* name;
  std::unique_ptr<StrobeSource> (*make)(const StrobeConfig&);
  bool numbered;
};
constexpr Reader kReaders[] = {{"interface v2", make_uapi_strobe, true}, {"libgpiod", make_gpiod_strobe, CYCLOPS_GPIOD >= 2}};

/// Reads until nothing has come for `patience`.
std::vector<StrobeEdge> read_all(StrobeSource& source, Duration patience, std::vector<std::int64_t>* read_at = nullptr) {
  std::vector<StrobeEdge> out;
  std::array<StrobeEdge, 64> edges;
  for (;;) {
    auto ready = source.wait(patience);
    if (!ready.ok() || !*ready) return out;
    auto n = source.read_many(edges);
    if (!n.ok()) return out;
    for (std::size_t i = 0; i < *n; ++i) {
      out.push_back(edges[i]);
      if (read_at != nullptr) read_at->push_back(monotonic_ns());
    }
  }
}

/// When each pulse was asked for, on the clock of the edges.
std::vector<std::int64_t> pulse_train(GpioSimLine& line, int count, double hz) {
  std::vector<std::int64_t> at;
  const std::int64_t begin = monotonic_ns() + 20'000'000;
  for (int i = 0; i < count; ++i) {
    hil::sleep_until_ns(begin + std::llround(i * 1e9 / hz));
    at.push_back(monotonic_ns());
    line.pulse();
  }
  return at;
}

struct Spread {
  double p50, p99, max;
  explicit Spread(std::vector<double> v) {
    std::sort(v.begin(), v.end());
    p50 = v[v.size() / 2];
    p99 = v[std::min(v.size() - 1, v.size() * 99 / 100)];
    max = v.back();
  }
};

void report(const char* name, double hz, const std::vector<StrobeEdge>& edges, const std::vector<std::int64_t>& asked, const std::vector<std::int64_t>& read_at) {
  std::vector<double> latency, wake, off;
  double squares = 0;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    latency.push_back(static_cast<double>(edges[i].t.ns - asked[i]) * 1e-3);
    wake.push_back(static_cast<double>(read_at[i] - edges[i].t.ns) * 1e-3);
    if (i == 0) continue;
    const double interval_us = static_cast<double>((edges[i].t - edges[i - 1].t).ns) * 1e-3;
    off.push_back(std::abs(interval_us - 1e6 / hz));
    squares += off.back() * off.back();
  }
  const Spread l(latency), w(wake), o(off);
  std::printf("%-12s %4.0f Hz: %zu of %zu edges; interval sd %.1f us, worst %.1f; pulse to stamp p50 %.1f p99 %.1f max %.1f us; stamp to reader p50 %.1f p99 %.1f max %.1f us\n", name, hz, edges.size(),
              asked.size(), std::sqrt(squares / static_cast<double>(off.size())), o.max, l.p50, l.p99, l.max, w.p50, w.p99, w.max);
}

TEST(GpioLine, EveryEdgeArrivesWithTheKernelsStampAtEveryRate) {
  for (const Reader& reader : kReaders) {
    for (const double hz : {30.0, 60.0, 200.0}) {
      auto source = reader.make(config());
      ASSERT_TRUE(source->open().ok());
      auto line = pulser();
      const int count = static_cast<int>(3 * hz);
      std::vector<StrobeEdge> edges;
      std::vector<std::int64_t> read_at;
      std::thread read([&] { edges = read_all(*source, Duration::from_ms(500), &read_at); });
      const auto asked = pulse_train(*line, count, hz);
      read.join();
      ASSERT_EQ(edges.size(), asked.size()) << reader.name << " " << hz << " Hz";
      for (std::size_t i = 0; i < edges.size(); ++i) {
        EXPECT_TRUE(edges[i].rising);
        EXPECT_GE(edges[i].t.ns, asked[i]);
        EXPECT_LE(edges[i].t.ns, read_at[i]);
        EXPECT_EQ(edges[i].line_seq, reader.numbered ? static_cast<std::int64_t>(i) + 1 : -1);
      }
      EXPECT_EQ(source->status().lost, 0U);
      report(reader.name, hz, edges, asked, read_at);
    }
  }
}

TEST(GpioLine, WhatAFullBufferLostIsCountedByTheNumbersOrAtLeastNoticed) {
  // GIVEN a reader that sleeps through 1500 edges
  for (const Reader& reader : kReaders) {
    auto source = reader.make(config());
    ASSERT_TRUE(source->open().ok());
    auto line = pulser();
    pulse_train(*line, 1500, 800);
    const auto edges = read_all(*source, Duration::from_ms(100));
    const StrobeStatus status = source->status();
    std::printf("%-12s slept through 1500 edges: %zu kept, lost by number %llu, overruns %llu, newest number %lld\n", reader.name, edges.size(),
                static_cast<unsigned long long>(status.lost), static_cast<unsigned long long>(status.overruns), static_cast<long long>(edges.back().line_seq));
    if (reader.numbered) {
      EXPECT_EQ(edges.size(), 1024U);
      EXPECT_EQ(status.lost, 1500U - 1024U);
      EXPECT_EQ(edges.back().line_seq, 1500);
    } else {
      EXPECT_EQ(edges.size(), 16U);
      EXPECT_GE(status.overruns, 1U);
    }
  }
}

TEST(GpioLine, TheServiceTakesTheInterfaceThatNumbersItsEdges) {
  const auto source = make_strobe_source(config());
  ASSERT_TRUE(source->open().ok());
  EXPECT_TRUE(source->status().numbered);
}

TEST(GpioLine, StrobeAndPpsAreTwoLinesThatDoNotMix) {
  auto strobe = make_strobe_source(config(kStrobe)), pps = make_strobe_source(config(kPps));
  ASSERT_TRUE(strobe->open().ok());
  ASSERT_TRUE(pps->open().ok());
  auto one = pulser(kStrobe), other = pulser(kPps);
  pulse_train(*one, 30, 100);
  pulse_train(*other, 3, 100);
  EXPECT_EQ(read_all(*strobe, Duration::from_ms(50)).size(), 30U);
  EXPECT_EQ(read_all(*pps, Duration::from_ms(50)).size(), 3U);
}

TEST(GpioLine, IsFoundByLabelNameAndPathAndByTheNameOfTheLine) {
  const std::string device = word(in_config("bank0/chip_name"));
  for (const Reader& reader : kReaders) {
    for (const std::string& by : {chip(), device, "/dev/" + device}) {
      StrobeConfig c = config();
      c.chip = by;
      EXPECT_TRUE(reader.make(c)->open().ok()) << reader.name << " " << by;
      c.line = 0;
      c.line_name = "STROBE";
      auto source = reader.make(c);
      ASSERT_TRUE(source->open().ok()) << reader.name << " " << by;
      auto line = pulser();
      pulse_train(*line, 2, 100);
      EXPECT_EQ(read_all(*source, Duration::from_ms(50)).size(), 2U) << reader.name << " " << by;
      c.line_name = "NO-SUCH-LINE";
      const auto opened = reader.make(c)->open();
      ASSERT_FALSE(opened.ok());
      EXPECT_EQ(opened.error().code, ErrorCode::kNotFound);
    }
  }
}

TEST(GpioLine, AnEdgeOfTheOtherSlopeIsNotReported) {
  StrobeConfig c = config();
  c.rising = false;
  auto source = make_strobe_source(c);
  ASSERT_TRUE(source->open().ok());
  auto line = pulser();
  pulse_train(*line, 5, 100);
  const auto edges = read_all(*source, Duration::from_ms(50));
  EXPECT_EQ(edges.size(), 5U);
  for (const StrobeEdge& e : edges) EXPECT_FALSE(e.rising);
}

TEST(GpioLine, ALineThatIsTakenSaysSo) {
  const auto first = make_strobe_source(config());
  ASSERT_TRUE(first->open().ok());
  for (const Reader& reader : kReaders) {
    const auto opened = reader.make(config())->open();
    ASSERT_FALSE(opened.ok());
    EXPECT_NE(opened.error().message().find("another program holds the line"), std::string::npos) << opened.error().message();
  }
}

TEST(GpioLine, EdgesOfTheKernelAndACamerasTicksMakeMidExposureTimes) {
  // GIVEN a camera of 30 Hz whose clock runs 50 ppm fast, its strobe a real line
  constexpr double kHz = 30;
  constexpr int kFrames = 150;
  auto source = make_strobe_source(config());
  ASSERT_TRUE(source->open().ok());
  auto line = pulser();
  std::vector<StrobeEdge> edges;
  std::thread read([&] { edges = read_all(*source, Duration::from_ms(500)); });
  const auto asked = pulse_train(*line, kFrames, kHz);
  read.join();
  // WHEN edges and frames go through the stamper
  FrameStamperConfig c;
  c.residual_max = Duration{4'000'000};
  FrameStamper stamper(c);
  std::size_t strobe = 0;
  std::vector<double> error_us;
  for (std::size_t i = 0, e = 0; i < kFrames; ++i) {
    FrameInfo f;
    f.camera_frame_id = i + 1;
    f.camera_tick_ns = 7'000'000'000 + std::llround(static_cast<double>(asked[i] - asked[0]) * (1 + 50e-6));
    f.exposure = Duration{4'000'000};
    f.t_arrival = Time{asked[i] + 9'000'000};
    f.status = FrameStatus::kComplete;
    while (e < edges.size() && edges[e].t <= f.t_arrival) stamper.on_edge(edges[e++]);
    ASSERT_TRUE(stamper.on_frame(f, i));
    FrameToken token = 0;
    while (stamper.pop(f, token)) {
      if (f.time_source == TimeSource::kStrobe) ++strobe;
      error_us.push_back(static_cast<double>(f.t_mid.ns - asked[token] - 2'000'000) * 1e-3);
    }
  }
  // THEN nearly every frame is timed by its own edge, and no frame by another one's
  EXPECT_GE(strobe, kFrames * 9 / 10U);
  for (const double e : error_us) EXPECT_LE(std::abs(e), 0.25e6 / kHz);
  const Spread s(error_us);
  std::printf("stamper on a real line: %zu of %zu frames by strobe; mid-exposure against pulse p50 %.1f p99 %.1f max %.1f us; camera clock %.1f ppm\n", strobe, error_us.size(), s.p50, s.p99, s.max, stamper.line().rate_ppm());
}

TEST(GpioLine, AChipThatGoesAwayIsAnErrorAndCanBeOpenedAgain) {
  for (const Reader& reader : kReaders) {
    auto source = reader.make(config());
    ASSERT_TRUE(source->open().ok());
    std::ofstream(in_config("live")) << "0\n";
    const auto waited = source->wait(Duration::from_ms(1000));
    std::array<StrobeEdge, 4> edges;
    EXPECT_FALSE(waited.ok() && source->read_many(edges).ok()) << reader.name;
    EXPECT_FALSE(source->open().ok());
    std::ofstream(in_config("live")) << "1\n";
    ASSERT_TRUE(source->open().ok()) << reader.name;
    auto line = pulser();
    pulse_train(*line, 3, 100);
    EXPECT_EQ(read_all(*source, Duration::from_ms(50)).size(), 3U) << reader.name;
  }
}

}  // namespace
}  // namespace cyclops
