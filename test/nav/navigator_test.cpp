#include "nav/navigator.hpp"

#include <gtest/gtest.h>

#include "geometry/camera.hpp"
#include "geometry/tanker_model.hpp"
#include "test/nav/flying.hpp"
#include "test/support.hpp"

namespace cyclops {
namespace {

using test::at_ms;
using test::kDeg;
using test::report_at;

Pose<frame::E, frame::R> receiver_at(const Geodetic& place, const HeadingPitchBank& angles) {
  return {level_axes(place.latitude_deg, place.longitude_deg) * attitude<frame::R>(angles), ecef_from_geodetic(place)};
}

NavAnswer through_reports(const Pose<frame::E, frame::R>& T_e_r, const Pose<frame::E, frame::K>& T_e_k) {
  Navigator nav(NavConfig{}, NavRig{});
  nav.push(state_from_report(report_at(Aircraft::kReceiver, T_e_r), at_ms(5)));
  nav.push(state_from_report(report_at(Aircraft::kTanker, T_e_k), at_ms(5)));
  return nav.at(at_ms(5));
}

TEST(Navigator, FindsTheRelativePoseOfSpec17FromTwoReportsAnywhereOnEarth) {
  const auto want = test::spec_1_7();
  for (double lat : {-90.0, -89.9999, -33.0, 0.0, 34.9, 89.99999, 90.0})
    for (double lon : {-180.0, -117.9, 0.0, 89.0, 179.9999, 180.0}) {
      // GIVEN a banked receiver and a tanker placed by spec 1.7, each reported in the level axes of its own place
      const auto T_e_r = receiver_at({lat, lon, 7000}, {50 * kDeg, 4 * kDeg, 15 * kDeg});
      const NavAnswer got = through_reports(T_e_r, T_e_r * want);
      // THEN the pose comes back; the rounding of the coordinates is all that is lost
      ASSERT_TRUE(got.state.valid);
      EXPECT_LT((got.state.T_r_k.translation() - want.translation()).norm(), 1e-8) << lat << " " << lon;
      EXPECT_LT(test::angle_between(got.state.T_r_k.rotation().quaternion(), want.rotation().quaternion()), 1e-12) << lat << " " << lon;
      EXPECT_FALSE(got.state.extrapolated);
    }
}

TEST(Navigator, LeadsToThePixelsOfSpec17) {
  const auto T_e_r = receiver_at({34.9, -117.9, 7000}, {200 * kDeg, 3 * kDeg, -10 * kDeg});
  const NavAnswer got = through_reports(T_e_r, T_e_r * test::spec_1_7());
  const auto model = TankerModel::parse("id,x,y,z\n2,539,0,131\n15,300,318,120\n22,300,-318,120\n", "model", 0.0254, {190, 0, 95});
  ASSERT_TRUE(model.ok());
  const auto R_c_r = camera_from_receiver({0, 16 * kDeg, 0});
  const Camera camera;
  const Vec2 want[] = {{511.5, 529.682359}, {816.722181, 613.749984}, {228.753087, 587.477063}};
  for (std::size_t i = 0; i < 3; ++i) {
    const Point<frame::R> p_r = got.state.T_r_k * model->in_body(model->features()[i]);
    const auto uv = camera.project(R_c_r * Point<frame::R>(p_r - Point<frame::R>(2.40, -0.15, -0.60)));
    ASSERT_TRUE(uv.has_value());
    EXPECT_LT((*uv - want[i]).norm(), 2e-6) << i;
  }
}

TEST(Navigator, ComposesAttitudesInABankLikeSpecE5) {
  // receiver (0, 4, 15), tanker (5, 2, 15) deg at one place: true (5.342, -0.625, -0.291), the difference would say (5, -2, 0)
  TspiReport r, k;
  k.aircraft = Aircraft::kTanker;
  r.q_n_b = attitude<frame::R>({0, 4 * kDeg, 15 * kDeg}).quaternion();
  k.q_n_b = attitude<frame::K>({5 * kDeg, 2 * kDeg, 15 * kDeg}).quaternion();
  r.latitude_deg = k.latitude_deg = 34.9;
  Navigator nav(NavConfig{}, NavRig{});
  nav.push(state_from_report(r, at_ms(0)));
  nav.push(state_from_report(k, at_ms(0)));
  const auto e = heading_pitch_bank(nav.at(at_ms(0)).state.T_r_k.rotation().matrix());
  EXPECT_NEAR(e.heading / kDeg, 5.342, 5e-4);
  EXPECT_NEAR(e.pitch / kDeg, -0.625, 5e-4);
  EXPECT_NEAR(e.bank / kDeg, -0.291, 5e-4);
}

TEST(Navigator, MovesFromTheTspiPointToTheInsByTheLeverArms) {
  const auto T_e_r = receiver_at({34.9, -117.9, 7000}, {200 * kDeg, 3 * kDeg, -10 * kDeg});
  const NavRig rig{{1.0, 0.5, -0.3}, {-2.0, 0.1, 0.8}};
  const Pose<frame::E, frame::K> T_e_k = T_e_r * test::spec_1_7();
  // GIVEN reports about points that sit a lever arm away from each INS
  auto of_point = [](const auto& T, const Vec3& arm) { return std::decay_t<decltype(T)>(T.rotation(), Point<frame::E>(T.translation().xyz - T.rotation().rotate(arm))); };
  Navigator nav(NavConfig{}, rig);
  nav.push(state_from_report(report_at(Aircraft::kReceiver, of_point(T_e_r, rig.receiver_ins_from_tspi_m)), at_ms(0)));
  nav.push(state_from_report(report_at(Aircraft::kTanker, of_point(T_e_k, rig.tanker_ins_from_tspi_m)), at_ms(0)));
  // THEN the INS to INS vector is that of spec 1.7
  EXPECT_LT((nav.at(at_ms(0)).state.T_r_k.translation() - test::spec_1_7().translation()).norm(), 1e-8);
}

TEST(Navigator, SaysWhichAircraftIsMissingOrTooOld) {
  const auto T_e_r = receiver_at({10, 20, 5000}, {});
  const Tspi r = state_from_report(report_at(Aircraft::kReceiver, T_e_r), at_ms(0));
  const Tspi k = state_from_report(report_at(Aircraft::kTanker, T_e_r * test::spec_1_7()), at_ms(0));
  Navigator nav(NavConfig{}, NavRig{}), only_r = nav, only_k = nav, both = nav, late_k = nav;
  EXPECT_EQ(nav.at(at_ms(0)).absence, NavAbsence::kNoBoth);
  only_r.push(r);
  EXPECT_EQ(only_r.at(at_ms(0)).absence, NavAbsence::kNoTanker);
  only_k.push(k);
  EXPECT_EQ(only_k.at(at_ms(0)).absence, NavAbsence::kNoReceiver);
  both.push(r);
  both.push(k);
  EXPECT_EQ(both.at(at_ms(0)).absence, NavAbsence::kNone);
  EXPECT_EQ(both.at(at_ms(501)).absence, NavAbsence::kTooOldReceiver);
  EXPECT_FALSE(both.at(at_ms(501)).state.valid);
  Tspi fresh = r;
  fresh.t = at_ms(400);
  fresh.seq = 1;
  both.push(fresh);
  EXPECT_EQ(both.at(at_ms(501)).absence, NavAbsence::kTooOldTanker);
}

TEST(Navigator, FlagsExtrapolationWithItsAgeAndALargerCovariance) {
  const auto T_e_r = receiver_at({10, 20, 5000}, {});
  Navigator nav(NavConfig{}, NavRig{});
  for (int i = 0; i < 3; ++i) {
    Tspi r = state_from_report(report_at(Aircraft::kReceiver, T_e_r), at_ms(20 * i));
    Tspi k = state_from_report(report_at(Aircraft::kTanker, T_e_r * test::spec_1_7()), at_ms(20 * i));
    r.seq = k.seq = static_cast<std::uint32_t>(i);
    nav.push(r);
    nav.push(k);
  }
  const NavAnswer in = nav.at(at_ms(30)), out = nav.at(at_ms(140));
  EXPECT_FALSE(in.state.extrapolated);
  EXPECT_EQ(in.state.age_tanker, Duration::from_ms(-10));
  EXPECT_TRUE(out.state.extrapolated);
  EXPECT_EQ(out.state.age_receiver, Duration::from_ms(100));
  EXPECT_GT(out.state.covariance.trace(), in.state.covariance.trace());
  EXPECT_GT(Eigen::LLT<Mat6>(out.state.covariance).matrixLLT().diagonal().minCoeff(), 0);
}

TEST(NavConfig, NamesTheKeyTheValueAndTheRange) {
  const struct { const char* text; const char* want; } cases[] = {
      {"[nav]\nmax_age_ms = -5\n", "profile.toml:2: nav.max_age_ms: is -5, expected 0 to 10000"},
      {"[nav]\nmax_gap_ms = 0\n", "nav.max_gap_ms: is 0, expected 1 to 10000"},
      {"[nav]\nposition_correlation = 1.5\n", "nav.position_correlation: is 1.5, expected 0 to 1"},
      {"[nav]\nupdate_every_n_frames = 0\n", "nav.update_every_n_frames: is 0, expected 1 to 100000"},
      {"[nav]\nupdate_every_n_frames = 30\nupdate_interval_s = 1\n", "nav.update_interval_s: is given together with"},
      {"[nav]\ndropouts_s = [1.0, 2.0, 3.0]\n", "nav.dropouts_s: has 3 numbers, expected pairs"},
      {"[nav]\ndropouts_s = [5, 2]\n", "nav.dropouts_s: windows must have start < end"},
      {"[nav]\nmax_gap_ms = 8000\n", "nav.max_gap_ms: is longer than max_jump_s"},
  };
  for (const auto& c : cases) {
    auto file = ConfigFile::parse(c.text, "profile.toml");
    ASSERT_TRUE(file.ok());
    auto nav = file->root().table("nav");
    const auto config = NavConfig::read(nav, {});
    ASSERT_FALSE(config.ok()) << c.text;
    EXPECT_NE(config.error().message().find(c.want), std::string::npos) << config.error().message();
  }
}

TEST(NavConfig, ReadsEveryKeyAndLeavesTheRestAtTheirDefaults) {
  auto file = ConfigFile::parse("[nav]\nupdate_interval_s = 1.0\ndropouts_s = [10, 12, 20, 25.5]\nmax_wait_ms = 40\n"
                                "[tspi]\ntanker_ins_m = [1.0, 2, -3]\n", "profile.toml");
  ASSERT_TRUE(file.ok());
  auto nav = file->root().table("nav");
  auto tspi = file->root().table("tspi");
  const auto config = NavConfig::read(nav, {});
  const auto rig = NavRig::read(tspi);
  ASSERT_TRUE(config.ok() && rig.ok() && file->finish().ok());
  EXPECT_EQ(config->max_wait_ms, 40);
  EXPECT_EQ(config->max_age_ms, NavConfig{}.max_age_ms);
  ASSERT_EQ(config->dropouts.size(), 2u);
  EXPECT_EQ(config->dropouts[1].end_s, 25.5);
  EXPECT_EQ(rig->tanker_ins_from_tspi_m, Vec3(1, 2, -3));
  EXPECT_EQ(rig->receiver_ins_from_tspi_m, Vec3(0, 0, 0));
}

}  // namespace
}  // namespace cyclops
