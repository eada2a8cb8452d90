#include <gtest/gtest.h>

#include "monitor/alarms.hpp"

namespace cyclops {
namespace {

constexpr Duration kStep = Duration::from_ms(20);   // as the service looks

std::string one(const std::string& more) {
  return "[[alarm]]\nname = \"camera.silent\"\ntext = \"camera is silent\"\nlevel = \"fault\"\nquantity = \"frame_age_ms\"\nunit = \"ms\"\n" + more;
}
Alarms made(const std::string& more) {
  auto limits = Limits::parse(one(more), "test.toml");
  EXPECT_TRUE(limits.ok()) << (limits.ok() ? "" : limits.error().message());
  return Alarms(*limits);
}
std::string refusal(const std::string& text) {
  const auto limits = Limits::parse(text, "test.toml");
  return limits.ok() ? "taken" : limits.error().message();
}
health_t age(float ms) {
  health_t h{};
  h.frame_age_ms = ms;
  return h;
}

/// A service in which nothing is wrong.
health_t quiet() {
  health_t h{};
  h.state = health_t::RUNNING;
  h.frames_received = 100;
  h.frame_rate_hz = 30;
  h.frame_rate_share = 1;
  h.consensus_share = 1;
  h.integrity = 1;
  h.disk_left_min = -1;
  h.temperature_c = 50;
  h.load = 1;
  return h;
}

TEST(Alarms, ComeAfterTheOnsetHoldAndSayWhatWasPassedAndSinceWhen) {
  Alarms alarms = made("above = 150\nclear = 100\nhold_ms = 60\n");
  EXPECT_TRUE(alarms.step(age(150), Time{0}).empty());  // at the limit is not beyond it
  EXPECT_TRUE(alarms.step(age(151), Time{} + kStep).empty());
  EXPECT_TRUE(alarms.step(age(180), Time{} + kStep * 3).empty());
  const auto& on = alarms.step(age(211), Time{} + kStep * 4);
  ASSERT_EQ(on.size(), 1U);
  EXPECT_TRUE(on[0].on);
  EXPECT_EQ(on[0].since, Time{} + kStep);
  EXPECT_EQ(words(*on[0].limit, on[0].value), "camera is silent: frame_age_ms 211 ms, limit 150 ms");
  health_t h = age(211);
  alarms.put(h);
  ASSERT_EQ(h.n_alarms, 1);
  EXPECT_EQ(h.alarms[0].name, "camera.silent");
  EXPECT_EQ(h.alarms[0].since_ns, kStep.ns);
  EXPECT_EQ(h.alarm_line, "camera is silent");
}

TEST(Alarms, AMomentBeyondTheLimitShorterThanTheHoldIsNoAlarm) {
  Alarms alarms = made("above = 150\nhold_ms = 60\n");
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(alarms.step(age(i % 3 == 0 ? 0 : 200), Time{} + kStep * i).empty()) << i;
}

TEST(Alarms, StayInTheHysteresisAndGoAfterTheClearHold) {
  Alarms alarms = made("above = 150\nclear = 100\nclear_hold_ms = 40\n");
  ASSERT_EQ(alarms.step(age(151), Time{0}).size(), 1U);
  EXPECT_TRUE(alarms.step(age(120), Time{} + kStep * 10).empty());
  EXPECT_TRUE(alarms.step(age(100), Time{} + kStep * 11).empty());
  EXPECT_TRUE(alarms.step(age(101), Time{} + kStep * 12).empty());  // starts over
  EXPECT_TRUE(alarms.step(age(90), Time{} + kStep * 13).empty());
  EXPECT_TRUE(alarms.step(age(90), Time{} + kStep * 14).empty());
  const auto& off = alarms.step(age(90), Time{} + kStep * 15);
  ASSERT_EQ(off.size(), 1U);
  EXPECT_FALSE(off[0].on);
  health_t h = age(90);
  alarms.put(h);
  EXPECT_EQ(h.n_alarms, 0);
  EXPECT_TRUE(h.alarm_line.empty());
}

TEST(Alarms, AnUnknownQuantityIsNoAlarmAndEndsOne) {
  auto limits = Limits::parse("[[alarm]]\nname = \"disk\"\ntext = \"disk\"\nlevel = \"warning\"\nquantity = \"disk_left_min\"\nunit = \"min\"\nbelow = 20\n", "test.toml");
  ASSERT_TRUE(limits.ok());
  Alarms alarms(*limits);
  health_t h{};
  h.disk_left_min = -1;
  EXPECT_TRUE(alarms.step(h, Time{0}).empty());
  h.disk_left_min = 19;
  ASSERT_EQ(alarms.step(h, Time{1}).size(), 1U);
  h.disk_left_min = -1;
  ASSERT_EQ(alarms.step(h, Time{2}).size(), 1U);
}

TEST(Alarms, AFileWithAnythingUnknownDoubledOrContradictoryIsRefusedWithItsLine) {
  EXPECT_EQ(refusal(one("above = 1\n")), "taken");
  EXPECT_NE(refusal(one("above = 1\nhold = 5\n")).find("test.toml:8: alarm[0].hold: unknown key"), std::string::npos);
  EXPECT_NE(refusal(one("")).find("expected either above or below"), std::string::npos);
  EXPECT_NE(refusal(one("above = 1\nbelow = 2\n")).find("expected either above or below"), std::string::npos);
  EXPECT_NE(refusal(one("above = 1\nclear = 2\n")).find("beyond the limit"), std::string::npos);
  EXPECT_NE(refusal(one("above = 1\nhold_ms = -1\n")).find("expected 0 to"), std::string::npos);
  EXPECT_NE(refusal(one("above = 1\n") + one("above = 1\n")).find("another alarm has"), std::string::npos);
  std::string text = one("above = 1\n");
  EXPECT_NE(refusal(text.replace(text.find("\"ms\""), 4, "\"s\"")).find("expected \"ms\" for frame_age_ms"), std::string::npos);
  text = one("above = 1\n");
  EXPECT_NE(refusal(text.replace(text.find("frame_age_ms"), 12, "frame_age")).find("expected a number of HEALTH"), std::string::npos);
  EXPECT_NE(refusal("[[alarm]]\nname = \"a\"\n").find("required key is missing"), std::string::npos);
}

TEST(Alarms, TheFileThatIsShippedIsTheOneBuiltIn) {
  const auto file = Limits::load("config/alarms.toml");
  ASSERT_TRUE(file.ok()) << file.error().message();
  const Limits inside = Limits::built_in();
  ASSERT_EQ(file->items.size(), inside.items.size());
  for (std::size_t i = 0; i < inside.items.size(); ++i) EXPECT_EQ(file->items[i].name, inside.items[i].name);
}

TEST(Alarms, NoneOfTheShippedLimitsIsPassedWhenAllIsWell) {
  Alarms alarms(Limits::built_in());
  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(alarms.step(quiet(), Time{} + kStep * i).empty());
}

TEST(Alarms, HoldoverIsOneByItsAgeAndByItsSigma) {
  const std::tuple<const char*, float health_t::*, float, float> causes[] = {
      {"gps.holdover", &health_t::gps_age_s, 4.9F, 5.1F}, {"gps.sigma", &health_t::gps_sigma_us, 900, 1100}, {"time.holdover", &health_t::strobe_age_s, 59, 61}};
  for (const auto& [name, field, good, bad] : causes) {
    Alarms alarms(Limits::built_in());
    health_t h = quiet();
    for (const float v : {-1.0F, good}) {   // unknown, then within
      h.*field = v;
      for (int i = 0; i < 20; ++i) EXPECT_TRUE(alarms.step(h, Time{} + kStep * i).empty()) << name;
    }
    h.*field = bad;
    std::string said;
    for (int i = 20; i < 40; ++i)
      for (const AlarmChange& c : alarms.step(h, Time{} + kStep * i)) said += c.limit->name;
    EXPECT_EQ(said, name);
  }
}

struct Cause {
  const char* alarm;
  void (*happens)(health_t&, double ms);   ///< since the cause
  double repeats_ms;                       ///< of what is missing: a frame, a report
};

// Times are those of the numbers in HEALTH as the service counts them up; the service looks every 20 ms, at any phase.
TEST(Alarms, EveryCauseThatNeedsACrewToActIsOutWithin200Milliseconds) {
  const Cause causes[] = {
      {"camera.silent", [](health_t& h, double ms) { h.frame_age_ms = static_cast<float>(ms); }, 33.4},
      {"tspi.receiver.silent", [](health_t& h, double ms) { h.tspi_receiver_silence_ms = static_cast<float>(ms); }, 50},
      {"tspi.tanker.silent", [](health_t& h, double ms) { h.tspi_tanker_silence_ms = static_cast<float>(ms); }, 50},
      {"frames.lost", [](health_t& h, double) { h.frames_lost_1s = 1; }, 0},
      {"nav.contradicted", [](health_t& h, double) { h.nav_contradicted = 1; }, 0},
      {"link.refused", [](health_t& h, double) { h.refused_1s = 1; }, 0},
      {"time.not_strobe", [](health_t& h, double) { h.time_source = 1; }, 0},
      {"time.unknown", [](health_t& h, double) { h.time_source = 3; }, 0},
      {"time.sigma", [](health_t& h, double) { h.time_sigma_us = 2000; }, 0},
      {"features.disagree", [](health_t& h, double) { h.consensus_share = 0.4F; }, 0},
      {"residual.large", [](health_t& h, double) { h.residual_rms_px = 5; }, 0},
      {"latency.long", [](health_t& h, double) { h.latency_ms_p99 = 150; }, 0},
      {"disk.full", [](health_t& h, double) { h.disk_left_min = 0.5F; }, 0}};
  for (const Cause& cause : causes)
    for (int phase_ms = 0; phase_ms < 20; ++phase_ms) {
      Alarms alarms(Limits::built_in());
      double out_ms = -1;
      for (double t = phase_ms - 200; t < 1000 && out_ms < 0; t += kStep.seconds() * 1e3) {
        health_t h = quiet();
        if (t >= 0) cause.happens(h, t);
        for (const AlarmChange& c : alarms.step(h, Time{} + Duration::from_ms(t)))
          if (c.limit->name == cause.alarm) out_ms = t;
      }
      ASSERT_GE(out_ms, 0) << cause.alarm;
      EXPECT_LE(out_ms - cause.repeats_ms, 200) << cause.alarm;  // it is missing only when it should have come
    }
}

}  // namespace
}  // namespace cyclops
