// A whole flight without pixels: TSPI of a receiver that rocks its wings, the points a pinhole behind the same lens sees, and frame
// stamps that are wrong by a known offset and drift.
#include <gtest/gtest.h>

#include <cmath>

#include <cyclops/measurement_set_t.hpp>

#include "geometry/tanker_model.hpp"
#include "record/flight.hpp"
#include "test/nav/flying.hpp"
#include "test/support.hpp"
#include "tools/wingrock_data.hpp"
#include "wire/codec.hpp"

namespace cyclops::tools {
namespace {

using test::kDeg;

constexpr std::int64_t kGps = 1'400'000'000'000'000'000;   // of second 0
constexpr double kFocal_px = 1000;
const Vec3 kLens(2.4, 0, -0.6);
const char* const kRig = R"([camera]
width_px = 1024
height_px = 1024
fx_px = 1000.0
fy_px = 1000.0
[mount]
tilt_deg = 16.0
lens_in_receiver_m = [2.4, 0.0, -0.6]
[tanker]
model = "tanker.csv"
unit = "m"
)";
const Vec3 kPoints[] = {{0, -8, 0}, {0, 8, 0}, {5, -2.5, 2}, {5, 2.5, 2}, {-4, 0, 0.3}, {1, -4, -0.2}, {1, 4, -0.2}};   // model: aft right up

/// Right wing down positive: two rocks of 15 deg and 4 s.
double bank_rad(double t) {
  for (const double begin : {3.0, 16.0})
    if (t > begin && t < begin + 4) return 15 * kDeg * std::sin(2 * 3.14159265358979323846 * (t - begin) / 4);
  return 0.3 * kDeg * std::sin(1.7 * t);
}

struct Scene {
  Geodetic datum{35, -118, 6000};
  [[nodiscard]] Pose<frame::E, frame::R> receiver(double t) const {
    const auto level = level_axes(datum.latitude_deg, datum.longitude_deg);
    return {level * attitude<frame::R>({0, 5 * kDeg, bank_rad(t)}), ecef_from_geodetic(datum)};
  }
  [[nodiscard]] Pose<frame::E, frame::K> tanker() const {
    const auto level = level_axes(datum.latitude_deg, datum.longitude_deg);
    return {level * attitude<frame::K>({0, 0, 0}), Point<frame::E>(ecef_from_geodetic(datum).xyz + level.rotate({30, 0, -9}))};
  }
};

void write_flight(const std::string& folder, double length_s) {
  auto out = FlightWriter::create(folder, true).value();
  std::string csv = "id,x,y,z\n";
  int id = 0;
  for (const Vec3& p : kPoints) csv += std::to_string(++id) + "," + std::to_string(p.x()) + "," + std::to_string(p.y()) + "," + std::to_string(p.z()) + "\n";
  ASSERT_TRUE(out.text("rig.toml", kRig).ok() && out.text("tanker.csv", csv).ok());
  const Scene scene;
  std::uint32_t seq = 0;
  for (double t = -6; t < length_s + 6; t += 0.02, ++seq)
    for (const Aircraft a : {Aircraft::kReceiver, Aircraft::kTanker}) {
      TspiReport r = a == Aircraft::kReceiver ? test::report_at(a, scene.receiver(t)) : test::report_at(a, scene.tanker());
      r.seq = seq;
      r.t_gps = {kGps + static_cast<std::int64_t>(t * 1e9)};
      tspi_t m;
      fill(m, r);
      std::vector<std::uint8_t> room(static_cast<std::size_t>(m.getEncodedSize()));
      const Encoded bytes = encode_into(m, room);
      ASSERT_TRUE(out.message(Time{static_cast<std::int64_t>((t + 100) * 1e9)}, channel::tspi(a), bytes.data, bytes.size).ok());
    }
  FlightManifest manifest;
  manifest.name = "rocks";
  ASSERT_TRUE(out.finish(manifest).ok());
}

/// `gps` false: the service did not know GPS time.
void write_log(const std::string& path, double length_s, double offset_s, double drift, bool gps) {
  auto out = record::EventLogWriter::create(path).value();
  const Scene scene;
  const auto R_c_r = camera_from_receiver({0, 16 * kDeg, 0});
  test::Random random(1);
  std::normal_distribution<double> noise(0, 0.3);
  for (double t = 0; t < length_s; t += 1.0 / 30) {
    const auto T_r_k = scene.receiver(t).inverse() * scene.tanker();
    measurement_set_t m{};
    const auto stamp = static_cast<std::int64_t>((t - offset_s - drift * (t - 0.5 * length_s)) * 1e9);
    m.mid_exposure_gps_ns = gps ? kGps + stamp : 0;
    m.mid_exposure_ns = 100'000'000'000 + stamp;
    int id = 0;
    for (const Vec3& p : kPoints) {
      const Vec3 q = R_c_r.rotate(T_r_k * Point<frame::K>(TankerModel::direction_in_body(p)) - Point<frame::R>(kLens));
      measurement_t z{};
      z.id = ++id;
      z.accepted = (id + static_cast<int>(t * 30)) % 7 != 0;
      z.ideal_px[0] = 511.5 + kFocal_px * q.x() / q.z() + noise(random);
      z.ideal_px[1] = 511.5 + kFocal_px * q.y() / q.z() + noise(random);
      m.items.push_back(z);
    }
    m.n = static_cast<std::int32_t>(m.items.size());
    std::vector<std::uint8_t> room(static_cast<std::size_t>(m.getEncodedSize()));
    const Encoded bytes = encode_into(m, room);
    ASSERT_TRUE(out.write(m.mid_exposure_ns / 1000, channel::kMeasurement, bytes.data, bytes.size).ok());
  }
  ASSERT_TRUE(out.close().ok());
}

WingRockResult answer(const test::TempDir& dir, bool& by_arrival) {
  auto data = WingRockData::load(dir.file("flight"), dir.file("log.lcm"));
  EXPECT_TRUE(data.ok()) << (data.ok() ? "" : data.error().message());
  if (!data.ok()) return {};
  by_arrival = (*data)->by_arrival();
  return wing_rock((*data)->seen(), [&](std::size_t frame, double t) { return (*data)->roll_at(frame, t); });
}

TEST(WingRockData, AFlightWithWrongStampsTellsByHowMuchAndInWhichDirection) {
  for (const auto& [offset, drift] : {std::pair{0.0, 0.0}, {0.25, 0.0}, {-0.4, 1500e-6}}) {
    const test::TempDir dir;
    write_flight(dir.file("flight"), 24);
    write_log(dir.file("log.lcm"), 24, offset, drift, true);
    bool by_arrival = true;
    const WingRockResult r = answer(dir, by_arrival);
    ASSERT_TRUE(r.enough) << r.reason;
    EXPECT_FALSE(by_arrival);
    EXPECT_NEAR(r.offset_s, offset, 4 * r.offset_sigma_s + 1e-5);
    EXPECT_NEAR(r.drift, drift, 4 * r.drift_sigma + 1e-6);
    EXPECT_LT(r.offset_sigma_s, 2e-3);
    EXPECT_LT(r.drift_sigma, 300e-6);
    EXPECT_NEAR(r.gain, 1, 0.01);
    EXPECT_EQ(r.manoeuvres.size(), 2U);
  }
}

TEST(WingRockData, WithoutGpsTimeArrivalsOfTspiStandIn) {
  const test::TempDir dir;
  write_flight(dir.file("flight"), 24);
  write_log(dir.file("log.lcm"), 24, 0.03, 0, false);
  bool by_arrival = false;
  const WingRockResult r = answer(dir, by_arrival);
  ASSERT_TRUE(r.enough) << r.reason;
  EXPECT_TRUE(by_arrival);
  EXPECT_NEAR(r.offset_s, 0.03, 4 * r.offset_sigma_s + 1e-5);
}

TEST(WingRockData, WhatIsMissingIsNamed) {
  const test::TempDir dir;
  EXPECT_NE(WingRockData::load(dir.file("none"), dir.file("log.lcm")).error().message().find("none"), std::string::npos);
  write_flight(dir.file("flight"), 2);
  EXPECT_NE(WingRockData::load(dir.file("flight"), dir.file("log.lcm")).error().message().find("log.lcm"), std::string::npos);
  ASSERT_TRUE(record::EventLogWriter::create(dir.file("log.lcm")).value().close().ok());
  EXPECT_NE(WingRockData::load(dir.file("flight"), dir.file("log.lcm")).error().message().find("holds no MEASUREMENT"), std::string::npos);
}

TEST(WingRockData, AFlightWithTooFewFeaturesHasNothingToReadAndThatIsNoError) {
  const test::TempDir dir;
  write_flight(dir.file("flight"), 2);
  auto log = record::EventLogWriter::create(dir.file("log.lcm")).value();
  measurement_set_t m{};
  std::vector<std::uint8_t> room(static_cast<std::size_t>(m.getEncodedSize()));
  const Encoded bytes = encode_into(m, room);
  ASSERT_TRUE(log.write(1, channel::kMeasurement, bytes.data, bytes.size).ok() && log.close().ok());
  bool by_arrival = false;
  const WingRockResult r = answer(dir, by_arrival);
  EXPECT_FALSE(r.enough);
  EXPECT_NE(r.reason.find("fewer than 30 frames"), std::string::npos);
}

}  // namespace
}  // namespace cyclops::tools
