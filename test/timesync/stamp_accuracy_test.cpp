// How good are the times, on a simulated rig: strobe and PPS stamped by a kernel, a camera clock that drifts, frames that
// arrive with jitter. Figures of docs/time.md. CYCLOPS_STAMP_SEEDS sets how many rigs are flown; CYCLOPS_STAMP_TUNE=1 takes the
// seeds that were used to choose constants, which the report never does.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "test/timesync/exposure_sim.hpp"
#include "test/timesync/oscillator.hpp"
#include "timesync/gps_clock.hpp"
#include "timesync/pps_marks.hpp"

namespace cyclops {
namespace {

using test::Random;

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr GpsTime kGpsStart{1'450'000'000 * kSecond};
constexpr Time kServiceStart{55'000 * kSecond + 123'456'789};

std::uint64_t first_seed() { return std::getenv("CYCLOPS_STAMP_TUNE") != nullptr ? 1'000'001 : 1; }
std::uint64_t seeds() {
  const char* text = std::getenv("CYCLOPS_STAMP_SEEDS");
  return text != nullptr ? static_cast<std::uint64_t>(std::atoll(text)) : 20;
}

struct RigSetup {
  double seconds{120};
  double period_s{1.0 / 30};
  double exposure_s{4e-3};
  double lost_from_s{1e9}, lost_to_s{1e9};   // strobe dead
  double pps_lost_from_s{1e9};
};

/// True time is GPS time since the start. The service clock and the camera clock are oscillators of their own.
class SimulatedRig {
 public:
  SimulatedRig(const RigSetup& setup, std::uint64_t seed)
      : s_(setup), random_(seed), service_({-25 + 50 * uniform(), 0.03, 0.3, 600, 5}, random_), camera_({uniform() < 0.5 ? -50.0 : 50.0, 0.03, 0.5, 300, 10}, random_) {
    strobe_bias_ns_ = kDelaySigma_ns * normal_(random_);
    pps_bias_ns_ = kDelaySigma_ns * normal_(random_);
  }

  /// Calls edge(StrobeEdge), pps(StrobeEdge, rough GpsTime), frame(FrameInfo, true t_mid in seconds, service clock there) in order of time.
  template <class Edge, class Pps, class Frame>
  void run(Edge edge, Pps pps, Frame frame) {
    std::int64_t next_pps = 0;
    Time last_arrival{INT64_MIN};
    const int n = static_cast<int>(s_.seconds / s_.period_s);
    double camera_t = 0.35;
    for (int i = 0; i < n; ++i) {
      const double exposure = camera_t;
      camera_t += s_.period_s * (1 - camera_gain(exposure));   // the camera counts its period on its own clock
      for (; static_cast<double>(next_pps) < exposure; ++next_pps) {
        const double t = static_cast<double>(next_pps);
        const double latency = interrupt_ns() + pps_bias_ns_;
        if (t >= s_.pps_lost_from_s) continue;
        const Time at = service(t) + Duration{std::llround(latency)};
        pps(StrobeEdge{at, -1, true}, GpsTime{kGpsStart.ns + next_pps * kSecond - 30'000'000});
      }
      const Time start = service(exposure);
      const double latency = interrupt_ns() + strobe_bias_ns_;
      const bool dead = exposure >= s_.lost_from_s && exposure < s_.lost_to_s;
      if (!dead && uniform() > 0.001) edge(StrobeEdge{start + Duration{std::llround(latency)}, -1, true});
      FrameInfo f;
      f.camera_frame_id = static_cast<std::uint64_t>(i) + 1;
      const double tick = 7e9 + exposure * 1e9 + camera_gained_ + 200 * normal_(random_);
      f.camera_tick_ns = std::llround(tick / 8) * 8;           // 125 MHz
      f.exposure = Duration::from_seconds(s_.exposure_s);
      f.status = FrameStatus::kComplete;
      f.t_arrival = std::max(start + f.exposure + Duration{6'000'000 + std::llround(1e6 * uniform())}, last_arrival + Duration{1000});
      last_arrival = f.t_arrival;
      frame(f, exposure + s_.exposure_s / 2, start + f.exposure / 2);
    }
  }
  static constexpr double kDelay_ns = 15'000;       // what a bench would have measured and the config says
  static constexpr double kDelaySigma_ns = 5'000;   // and how well

 private:
  double uniform() { return uniform_(random_); }
  Time service(double t) { return kServiceStart + Duration{std::llround(t * 1e9 + service_.gained_ns(t))}; }
  double camera_gain(double t) {
    const double before = camera_gained_;
    camera_gained_ = camera_.gained_ns(t);
    return t > 1 ? (camera_gained_ - before) * 1e-9 / s_.period_s : 0;
  }
  // Interrupt to stamp: 8 us and an exponential tail of 7 us; one in 200 meets a stretch with interrupts off, up to 0.4 ms.
  double interrupt_ns() {
    const double usual = 8'000 - 7'000 * std::log(1 - uniform());
    return uniform() < 0.005 ? usual + 400'000 * uniform() : usual;
  }

  RigSetup s_;
  Random random_;
  std::uniform_real_distribution<double> uniform_{0, 1};
  std::normal_distribution<double> normal_{0, 1};
  test::Oscillator service_, camera_;
  double camera_gained_{0};
  double strobe_bias_ns_{0}, pps_bias_ns_{0};
};

FrameStamperConfig stamper_config() {
  FrameStamperConfig c;
  c.edge_delay = Duration{std::llround(SimulatedRig::kDelay_ns)};
  c.delay_sigma = Duration{std::llround(SimulatedRig::kDelaySigma_ns)};
  return c;
}

/// Errors of one kind of time with the sigma that was said, in ns.
struct Errors {
  std::vector<double> error, sigma;
  void add(Duration e, Duration s) { error.push_back(static_cast<double>(e.ns)); sigma.push_back(static_cast<double>(s.ns)); }
  [[nodiscard]] double rms() const {
    double sum = 0;
    for (const double e : error) sum += e * e;
    return std::sqrt(sum / static_cast<double>(error.size()));
  }
  [[nodiscard]] double quantile(double q) const {
    std::vector<double> a(error);
    for (double& e : a) e = std::abs(e);
    std::sort(a.begin(), a.end());
    return a[std::min(a.size() - 1, static_cast<std::size_t>(q * static_cast<double>(a.size())))];
  }
  [[nodiscard]] double inside(double sigmas) const {
    std::size_t n = 0;
    for (std::size_t i = 0; i < error.size(); ++i) n += std::abs(error[i]) <= sigmas * sigma[i] ? 1 : 0;
    return 100.0 * static_cast<double>(n) / static_cast<double>(error.size());
  }
  [[nodiscard]] double median_sigma() const {
    std::vector<double> s(sigma);
    std::nth_element(s.begin(), s.begin() + static_cast<std::ptrdiff_t>(s.size() / 2), s.end());
    return s[s.size() / 2];
  }
  void print(const char* what) const {
    std::printf("%-44s n %7zu  1 sigma %7.1f us  p99.9 %7.1f us  max %7.1f us  said %6.1f us  within 1/2/3 sigma %.1f %.1f %.1f %%\n", what, error.size(), rms() * 1e-3,
                quantile(0.999) * 1e-3, quantile(1) * 1e-3, median_sigma() * 1e-3, inside(1), inside(2), inside(3));
  }
};

struct Flown { Errors service, gps, strobe, holdover, gps_holdover; std::size_t by_source[4]{}; };

void fly(const RigSetup& setup, std::uint64_t seed, double settled_s, Flown& out) {
  SimulatedRig rig(setup, seed);
  FrameStamper stamper(stamper_config());
  GpsClock gps({});
  PpsConfig pps_config;
  pps_config.delay = stamper_config().edge_delay;
  pps_config.delay_sigma = stamper_config().delay_sigma;
  PpsMarks pps(pps_config);
  struct Truth { double t_s; Time t; };
  std::vector<Truth> truth;
  const auto look = [&] {
    FrameInfo f;
    FrameToken token = 0;
    while (stamper.pop(f, token)) {
      const Truth& is = truth[token];
      ++out.by_source[static_cast<int>(f.time_source)];
      if (is.t_s < settled_s) continue;
      const Duration error = f.t_mid - is.t;
      out.service.add(error, f.t_mid_sigma);
      if (f.time_source == TimeSource::kStrobe) out.strobe.add(error, f.t_mid_sigma);
      if (is.t_s > setup.lost_to_s - 1 && is.t_s < setup.lost_to_s - 0.5) out.holdover.add(error, f.t_mid_sigma);
      const Duration clock_sigma = gps.sigma_at(f.t_mid);
      const Duration both{std::llround(std::hypot(static_cast<double>(f.t_mid_sigma.ns), static_cast<double>(clock_sigma.ns)))};
      const Duration in_gps = gps.to_gps(f.t_mid) - GpsTime{kGpsStart.ns + std::llround(is.t_s * 1e9)};
      (is.t_s < setup.pps_lost_from_s ? out.gps : out.gps_holdover).add(in_gps, both);
    }
  };
  rig.run([&](const StrobeEdge& e) { stamper.on_edge(e); look(); },
          [&](const StrobeEdge& e, GpsTime rough) { if (const auto mark = pps.on_edge(e, rough)) gps.on_mark(*mark); },
          [&](const FrameInfo& f, double t_s, Time t) {
            truth.push_back({t_s, t});
            ASSERT_TRUE(stamper.on_frame(f, truth.size() - 1));
            look();
          });
  stamper.flush();
  look();
}

TEST(StampAccuracy, TheMiddleOfTheExposureIsRightToFiftyMicrosecondsAndSaysSo) {
  // GIVEN a rig with strobe and PPS, a camera clock off by 50 ppm and drifting, arrivals with 1 ms of jitter, one edge in 1000 lost
  // WHEN it has run for 10 s
  // THEN over all frames, whatever they were timed by: 1 sigma below 50 us, p99.9 below 200 us, and between 90 and 99 % of the
  // errors within twice the sigma that was said; on the service clock, and in GPS time
  Flown out;
  for (std::uint64_t i = 0; i < seeds(); ++i) fly({}, first_seed() + i, 10, out);
  out.service.print("mid-exposure, service clock");
  out.gps.print("mid-exposure, GPS time");
  std::printf("frames by strobe %zu, camera clock %zu, arrival %zu\n", out.by_source[0], out.by_source[1], out.by_source[2]);
  for (const Errors* e : {&out.service, &out.gps}) {
    EXPECT_LE(e->rms(), 50'000);
    EXPECT_LE(e->quantile(0.999), 200'000);
    EXPECT_GE(e->inside(2), 90);
    EXPECT_LE(e->inside(2), 99);
  }
}

TEST(StampAccuracy, AMinuteWithoutStrobeCostsLessThanAMillisecondAndTheSigmaIsHonest) {
  // GIVEN the strobe dead from 120 to 180 s
  // THEN in its last second each frame is timed by the camera clock, with an error below 1 ms and a sigma that holds
  RigSetup setup;
  setup.seconds = 185;
  setup.lost_from_s = 120;
  setup.lost_to_s = 180;
  Flown out;
  for (std::uint64_t i = 0; i < seeds(); ++i) fly(setup, first_seed() + i, 10, out);
  out.holdover.print("60 s after the last edge");
  EXPECT_EQ(out.by_source[static_cast<int>(TimeSource::kUnknown)], 0U);
  EXPECT_LE(out.holdover.quantile(1), 1e6);
  EXPECT_GE(out.holdover.inside(2), 90);
  EXPECT_LE(out.holdover.median_sigma(), 500'000);
}

TEST(StampAccuracy, AMinuteWithoutPpsIsCarriedOverByTheDrift) {
  RigSetup setup;
  setup.seconds = 180;
  setup.pps_lost_from_s = 120;
  Flown out;
  for (std::uint64_t i = 0; i < seeds(); ++i) fly(setup, first_seed() + i, 10, out);
  out.gps_holdover.print("GPS time, 0 to 60 s after the last PPS");
  EXPECT_LE(out.gps_holdover.quantile(1), 1e6);
  EXPECT_GE(out.gps_holdover.inside(2), 90);
}

}  // namespace
}  // namespace cyclops
