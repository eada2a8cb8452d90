// Are the errors of the measured TSPI what their sigmas say, and does the link do what it is asked?
#include "hil/navigation_errors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "hil/motion.hpp"
#include "hil/way.hpp"

namespace cyclops::hil {
namespace {

constexpr double kDeg = std::numbers::pi / 180;

AircraftState somewhere(double heading_deg, double pitch_deg, double bank_deg) {
  const Local at = local_from_geodetic(35, -118, 6000);
  AircraftState s;
  s.position_e = at.ecef;
  s.velocity_e = at.R_e_n * Vec3(100, 20, -1);
  s.R_e_b = at.R_e_n * attitude<frame::K>({heading_deg * kDeg, pitch_deg * kDeg, bank_deg * kDeg}).matrix();
  return s;
}

Navigation wrong() {
  Navigation n;
  n.position_sigma_m = 0.2, n.attitude_sigma_deg = 0.3, n.velocity_sigma_mps = 0.05, n.rate_sigma_dps = 0.1, n.shared_position_sigma_m = 3;
  return n;
}

TEST(NavigationErrors, AreAsLargeAsTheStatedSigmasSayAndWhatIsSharedCancels) {
  const AircraftState r = somewhere(10, 5, 0), k = somewhere(12, 1, 2);
  double position = 0, attitude = 0, apart = 0, absolute = 0;
  constexpr int kSeeds = 400;
  for (int seed = 0; seed < kSeeds; ++seed) {
    const NavigationErrors errors(wrong(), static_cast<std::uint64_t>(seed), 3);
    const Said said = errors.said(r, k, 2);
    position += ((said.tanker.position_e - said.receiver.position_e) - (k.position_e - r.position_e)).squaredNorm() / 3;
    absolute += (said.tanker.position_e - k.position_e).squaredNorm() / 3;
    attitude += so3_log(Eigen::Quaterniond(Mat3(k.R_e_b.transpose() * said.tanker.R_e_b))).squaredNorm() / 3;
    apart += 2 * said.tanker.position_sigma_m.squaredNorm() / 3;
    EXPECT_NEAR(said.tanker.attitude_sigma_rad[0], 0.3 * kDeg, 1e-12);
  }
  EXPECT_NEAR(std::sqrt(position / apart), 1, 0.06);
  EXPECT_NEAR(std::sqrt(attitude / kSeeds) / (0.3 * kDeg), 1, 0.06);
  EXPECT_GT(std::sqrt(absolute / kSeeds), 2.5);
}

TEST(NavigationErrors, KeepTheirCorrelationTime) {
  Navigation n = wrong();
  n.rate_hz = 10, n.position_tau_s = 5;
  const AircraftState r = somewhere(0, 0, 0);
  double product = 0, square = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const NavigationErrors errors(n, seed, 400);
    n.shared_position_sigma_m = 0;
    for (std::size_t i = 0; i + 50 < 400; ++i) {
      const Vec3 a = errors.said(r, r, i).tanker.position_e - errors.said(r, r, i).receiver.position_e, b = errors.said(r, r, i + 50).tanker.position_e - errors.said(r, r, i + 50).receiver.position_e;
      product += a.dot(b), square += a.squaredNorm();
    }
  }
  EXPECT_NEAR(product / square, std::exp(-1.0), 0.06);  // after one correlation time
}

TEST(NavigationErrors, CourseAndFactorScaleErrorsAndStatedSigmas) {
  const AircraftState r = somewhere(10, 5, 0), k = somewhere(12, 1, 2);
  Navigation n = wrong();
  n.shared_position_sigma_m = 0;
  NavigationErrors plain(n, 1, 3);
  const Vec3 one = plain.said(r, k, 1).tanker.position_e - k.position_e;
  plain.set_course({1, 4, 1});
  EXPECT_LT((plain.said(r, k, 1).tanker.position_e - k.position_e - 4 * one).norm(), 1e-8);
  EXPECT_NEAR(plain.said(r, k, 1).tanker.position_sigma_m[0], 0.8, 1e-12);
  n.stated_sigma_factor = 0.25, n.stated_sigma_follows = false;
  NavigationErrors optimistic(n, 1, 3);
  optimistic.set_course({1, 4, 1});
  EXPECT_NEAR(optimistic.said(r, k, 1).tanker.position_sigma_m[0], 0.05, 1e-12);
}

TEST(NavigationErrors, TrueNavigationIsTheTruthAtItsPoint) {
  Navigation n = wrong();
  n.is_true = true;
  n.tanker_point_m = {1, 2, 3};
  const AircraftState r = somewhere(10, 5, 0), k = somewhere(12, 1, 2);
  const Said said = NavigationErrors(n, 1, 3).said(r, k, 0);
  EXPECT_EQ((said.receiver.position_e - r.position_e).norm(), 0);
  EXPECT_LT((said.tanker.position_e - k.position_e - k.R_e_b * Vec3(1, 2, 3)).norm(), 1e-9);
}

TEST(NavigationErrors, AForgottenFlightPathMovesThePictureAsTheSpecificationWorksOut) {
  // GIVEN the case of spec 3.5: wings level, pitch 5 deg, heading 6.5 deg right of the track, tail 75 ft away at 15 deg
  const Local at = local_from_geodetic(35, -118, 6000);
  AircraftState r;
  r.position_e = at.ecef;
  r.velocity_e = at.R_e_n * Vec3(100, 0, 0);
  r.R_e_b = at.R_e_n * attitude<frame::R>({6.5 * kDeg, 5 * kDeg, 0}).matrix();
  AircraftState k = r;
  const double foot = 0.3048;
  k.position_e += at.R_e_n * (foot * Vec3(72.444437, 0, -19.411428));
  const auto truth = relative(r, k);
  EXPECT_LT((truth.translation().xyz / foot - Vec3(73.396670, -8.200943, -13.064200)).norm(), 1e-5);
  Navigation n;
  n.reduction = Reduction::kFlightPath;
  const Said said = NavigationErrors(n, 1, 1).said(r, k, 0);
  // THEN what is said is the vector along the path, and the relative attitude stays
  const auto wrong_one = relative(said.receiver, said.tanker);
  EXPECT_LT((wrong_one.translation().xyz / foot - Vec3(72.444437, 0, -19.411428)).norm(), 1e-5);
  EXPECT_LT(so3_log(wrong_one.rotation().quaternion() * truth.rotation().quaternion().conjugate()).norm(), 1e-9);
}

TEST(Link, LosesRepeatsAndSwapsAsOftenAsItIsAsked) {
  Link link;
  link.latency_ms = 35, link.jitter_ms = 5, link.dropouts_per_minute = 6, link.dropout_s = 0.5, link.duplicate_share = 0.02, link.swapped_share = 0.03;
  constexpr std::size_t kSamples = 60000;  // 20 min
  const auto at = arrivals(link, 50, 0, kSamples, 1);
  std::size_t lost = 0, twice = 0, swapped = 0;
  std::int64_t last = 0;
  for (std::size_t i = 0; i < kSamples; ++i) {
    lost += at[i].empty();
    twice += at[i].size() == 2;
    if (at[i].empty()) continue;
    swapped += i + 1 < kSamples && !at[i + 1].empty() && at[i + 1][0] < at[i][0];
    EXPECT_GE(at[i][0] - static_cast<std::int64_t>(i) * 20'000'000, 29'999'000);
    last = at[i][0];
  }
  EXPECT_GT(last, 0);
  EXPECT_NEAR(static_cast<double>(lost) / kSamples, 0.05, 0.02);  // 6 a minute of half a second
  EXPECT_NEAR(static_cast<double>(twice) / kSamples, 0.02, 0.005);
  EXPECT_NEAR(static_cast<double>(swapped) / kSamples, 0.03, 0.008);
  for (const auto& one : arrivals({15, 0, 0, 0, 0, 0}, 50, 0, 100, 1)) EXPECT_EQ(one.size(), 1U);
}

}  // namespace
}  // namespace cyclops::hil
