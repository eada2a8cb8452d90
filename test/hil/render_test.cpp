// The generator of flights: are corners where the camera model puts them, do seeds repeat, is the truth true?
#include "hil/render.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "hil/flight.hpp"
#include "hil/made_up_windscreen.hpp"
#include "hil/render_corners.hpp"
#include "hil/sensor.hpp"
#include "test/support.hpp"

namespace cyclops::hil {
namespace {

constexpr double kDeg = 3.14159265358979323846 / 180;
constexpr const char* kTable = "config/c12/tanker.csv";

Intrinsics small_camera(int side_px, double focal_px) {
  Intrinsics k;
  k.width = k.height = side_px;
  k.cx_px = k.cy_px = 0.5 * (side_px - 1);
  k.fx_px = k.fy_px = focal_px;
  return k;
}

TankerModel tanker() { return TankerModel::load(kTable, 0.0254, {190, 0, 95}).value(); }

Look without_world() {
  Look look;
  look.sky.uniform_cdm2 = 0;
  look.light.uniform_cdm2 = 1;
  return look;
}

double worst(const std::vector<BoardCorner>& all) {
  double most = 0;
  for (const BoardCorner& e : all) most = std::max(most, e.px);
  return most;
}

TEST(Render, CornersOfTiltedBoardsLieWithinATenthOfAPixelOfTheirProjection) {
  const auto all = board_corners(Camera(small_camera(320, 325), {}), 12);
  double sum = 0;
  for (const BoardCorner& e : all) sum += e.px * e.px;
  EXPECT_GE(all.size(), 100U);
  EXPECT_LT(worst(all), 0.1);
  EXPECT_LT(std::sqrt(sum / static_cast<double>(all.size())), 0.05);
}

TEST(Render, CornersOfTheTankerLieWithinATenthOfAPixelOfTheirFeatures) {
  const auto all = feature_corners({}, c12_mesh(tanker()).value(), level_view(75, -15), tanker());
  EXPECT_GE(all.size(), 29U);
  for (const FeatureCorner& c : all) {
    ASSERT_TRUE(c.px) << "feature " << c.id << " is visible and no corner is where it should be";
    EXPECT_LT(*c.px, 0.1) << c.id;
  }
}

TEST(Render, CornersStayWhereALensThatBendsPutsThem) {
  Intrinsics k = small_camera(512, 400);
  k.k1 = -0.15;
  k.k2 = 0.03;
  const auto all = board_corners(Camera(k, {}), 10);
  EXPECT_GE(all.size(), 60U);
  EXPECT_LT(worst(all), 0.15);  // over the fit's window the lens bends the edges
}

TEST(Render, CornersBehindAWindscreenLieByItsMatricesAndTheParallaxOfTheirRange) {
  // GIVEN a windscreen that shifts by delta matrices and moves rays sideways, by half of 8 mm at the middle of an edge
  constexpr double kParallax_mm = 8;
  const Camera camera({}, made_up_windscreen(1024, 1024, 1).value());
  for (const double range_m : {12.0, 60.0}) {
    const auto all = board_corners(camera, range_m, kParallax_mm);
    ASSERT_GE(all.size(), 140U);
    double beside_matrices = 0;
    for (const BoardCorner& c : all) {
      // THEN a rendered corner lies where the matrices put it, nearer to the middle by f times the sideways shift over the range
      const Vec2 by_matrices = *camera.project(c.p_c), away = c.rendered_px - by_matrices;
      const Vec2 expected = -camera.intrinsics().fx_px / c.p_c.xyz.z() * windscreen_parallax_m(c.rendered_px, 1024, 1024, kParallax_mm);
      EXPECT_LT((away - expected).norm(), 0.1) << range_m << " m, corner " << c.id;
      EXPECT_LT(c.px, 0.1) << range_m << " m, corner " << c.id;
      beside_matrices = std::max(beside_matrices, away.norm());
    }
    // AND the matrices alone are off near by, less so far away
    const double edge_px = 0.5e-3 * kParallax_mm * camera.intrinsics().fx_px / range_m;
    EXPECT_GT(beside_matrices, 0.2 * edge_px);
    EXPECT_LT(beside_matrices, 0.6 * edge_px + 0.1);
  }
}

TEST(Render, AMovedPoseBlursButDoesNotShiftTheCentreOfTheBody) {
  // GIVEN a body that moves 6 px during the exposure
  const Camera camera(small_camera(256, 260), {});
  const Renderer renderer(camera, c12_mesh(tanker()).value(), without_world(), 1);
  View view = level_view(120, -15);
  std::vector<float> still, blurred;
  renderer.draw(view, Drawing::kMask, still);
  view.moves = true;
  const Vec3 half(3.0 / 260 * view.T_c_m.translation().xyz.z(), 0, 0);
  view.T_c_m_start = {view.T_c_m.rotation(), Point<frame::C>(view.T_c_m.translation().xyz - half)};
  view.T_c_m_end = {view.T_c_m.rotation(), Point<frame::C>(view.T_c_m.translation().xyz + half)};
  renderer.draw(view, Drawing::kMask, blurred);
  // THEN coverage and its centre stay, and pixels differ
  const auto centre = [](const std::vector<float>& image, double& sum) {
    double u = 0;
    sum = 0;
    for (std::size_t i = 0; i < image.size(); ++i) sum += static_cast<double>(image[i]), u += static_cast<double>(image[i]) * static_cast<double>(i % 256);
    return u / sum;
  };
  double a = 0, b = 0;
  EXPECT_NEAR(centre(still, a), centre(blurred, b), 0.1);
  EXPECT_NEAR(b / a, 1, 0.02);
  EXPECT_NE(still, blurred);
}

TEST(Render, DeadPixelsAreZeroAndTheSunSaturates) {
  Look look;
  look.light.sun_azimuth_deg = 8;
  look.light.sun_elevation_deg = 13;
  look.sensor.dead_pixels = 40;
  const Renderer renderer(Camera(small_camera(256, 260), {}), c12_mesh(tanker()).value(), look, 5);
  std::vector<std::uint16_t> one, again, other;
  View view = level_view(75, -15);
  renderer.render(view, one);
  renderer.render(view, again);
  view.frame = 1;
  renderer.render(view, other);
  EXPECT_EQ(one, again);
  EXPECT_NE(one, other);
  int dead = 0, white = 0;
  for (std::size_t i = 0; i < one.size(); ++i) dead += one[i] == 0 && other[i] == 0, white += one[i] >= saturated_count(renderer.look().sensor);
  EXPECT_GE(dead, 35);
  EXPECT_GT(white, 100);
  int saturated = 0;
  for (const FeatureTruth& t : renderer.truth(view, tanker(), &other)) saturated += (t.reasons & kSaturated) != 0;
  EXPECT_GT(saturated, 0);
}

TEST(Truth, OneSaturatedPixelIsScoredAndNineAreNot) {
  // GIVEN a grey frame with a visible feature, of whose 3 x 3 pixels none, one or all are at full scale
  const Renderer renderer(Camera(small_camera(256, 260), {}), c12_mesh(tanker()).value(), Look{}, 5);
  const View view = level_view(75, -15);
  std::vector<std::uint16_t> image(256 * 256, 1000);
  const auto before = renderer.truth(view, tanker(), &image);
  const auto k = static_cast<std::size_t>(std::find_if(before.begin(), before.end(), [](const FeatureTruth& t) { return t.visible && !t.doubtful; }) - before.begin());
  ASSERT_LT(k, before.size());
  EXPECT_EQ(before[k].reasons & (kSaturated | kBlownOut), 0U);
  const auto u = static_cast<std::size_t>(std::lround(before[k].raw_px.x())), v = static_cast<std::size_t>(std::lround(before[k].raw_px.y()));
  const auto white = static_cast<std::uint16_t>(saturated_count(renderer.look().sensor));
  image[256 * v + u + 1] = white;
  const FeatureTruth one = renderer.truth(view, tanker(), &image)[k];
  for (std::size_t dv = 0; dv < 3; ++dv) std::fill_n(image.begin() + static_cast<std::ptrdiff_t>(256 * (v + dv - 1) + u - 1), 3, white);
  const FeatureTruth nine = renderer.truth(view, tanker(), &image)[k];
  // THEN it stays visible, and only the last is not to be scored
  EXPECT_EQ(one.reasons & (kSaturated | kBlownOut), kSaturated);
  EXPECT_TRUE(one.visible && !one.doubtful);
  EXPECT_EQ(nine.reasons & (kSaturated | kBlownOut), kSaturated | kBlownOut);
  EXPECT_TRUE(nine.visible && nine.doubtful);
}

TEST(Render, NightIsBlackAndEveryDepthOfBitsHasItsRange) {
  for (const int bits : {8, 10, 12, 16}) {
    Look look;
    look.sensor.bits = bits;
    look.light.sun_elevation_deg = -25;
    const Renderer night(Camera(small_camera(128, 130), {}), Mesh{}, look, 5);
    std::vector<std::uint16_t> counts;
    night.render(level_view(75, -15), counts);
    EXPECT_LT(*std::max_element(counts.begin(), counts.end()), 0.02 * look.sensor.top_count()) << bits;
    look.light.sun_elevation_deg = 45;
    look.optics.automatic_f_number = false;
    look.optics.f_number = 1;
    const Renderer day(Camera(small_camera(128, 130), {}), Mesh{}, look, 5);
    day.render(level_view(75, -15), counts);
    EXPECT_EQ(*std::max_element(counts.begin(), counts.end()), look.sensor.top_count()) << bits;
  }
}

TEST(Look, RefusesABitDepthThatNoCameraHas) {
  const auto file = ConfigFile::parse("[sensor]\nbits = 9\n", "x.toml").value();
  ConfigTable root = file.root();
  Look look;
  read_look(root, look);
  const auto done = file.finish();
  ASSERT_FALSE(done.ok());
  EXPECT_NE(done.error().message().find("x.toml:2"), std::string::npos) << done.error().message();
}

TEST(Mesh, HasEveryFeatureOfTheC12AsAVertex) {
  const auto model = TankerModel::load(kTable, 0.0254, {190, 0, 95});
  ASSERT_TRUE(model.ok());
  ASSERT_EQ(model->features().size(), 38U);
  const auto mesh = c12_mesh(*model);
  ASSERT_TRUE(mesh.ok());
  std::vector<char> used(mesh->vertices_m.size());
  for (const Triangle& t : mesh->triangles)
    for (std::uint32_t i : t.vertex) used[i] = 1;
  for (const Feature& f : model->features()) {
    double nearest = 1e9;
    for (std::size_t i = 0; i < used.size(); ++i)
      if (used[i]) nearest = std::min(nearest, (mesh->vertices_m[i] - f.p_m.xyz).norm());
    EXPECT_LT(nearest / 0.0254, 1e-6) << "feature " << f.id;
  }
}

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

const char* kSmall = R"(name = "small"
frames = 4
[camera]
width_px = 192
height_px = 160
focal_mm = 3.0
[tanker]
model = "config/c12/tanker.csv"
[navigation]
position_sigma_m = 0.1
attitude_sigma_deg = 0.1
error_at_s = [0.0]
error_px = [2.0]
)";

TEST(Flight, IsTheSameWithOneThreadAndWithTwo) {
  const test::TempDir folder;
  auto scenario = Scenario::parse(kSmall, "./small.toml");
  ASSERT_TRUE(scenario.ok()) << scenario.error().message();
  for (int threads : {1, 2}) {
    FlightOptions options;
    options.out = folder.file(std::to_string(threads));
    options.threads = threads;
    options.cache = options.out + "-cache";  // each draws for itself
    const auto report = make_flight(*scenario, options);
    ASSERT_TRUE(report.ok()) << report.error().message();
    EXPECT_NEAR(report->projection_error_px, 2.0, 0.2);
  }
  for (const char* file : {"frames.lcm", "messages.lcm", "rig.toml", "tanker.csv", "manifest.toml"}) {
    const std::string one = bytes_of(folder.path() / "1" / file);
    EXPECT_FALSE(one.empty()) << file;
    EXPECT_EQ(one, bytes_of(folder.path() / "2" / file)) << file;
  }
}

TEST(Scenario, RefusesAKeyItDoesNotKnowNamingFileAndLine) {
  const auto scenario = Scenario::parse("name = \"x\"\n[tanker]\nmodel = \"t.csv\"\n[light]\nsunn = 3.0\n", "typo.toml");
  ASSERT_FALSE(scenario.ok());
  EXPECT_NE(scenario.error().message().find("typo.toml:5"), std::string::npos) << scenario.error().message();
}

TEST(Truth, AtMidEnvelopeTheTailTipIsSeenAndTheForwardTipIsHiddenByTheFin) {
  const auto model = TankerModel::load(kTable, 0.0254, {190, 0, 95});
  ASSERT_TRUE(model.ok());
  const Camera camera({}, {});
  const Renderer renderer(camera, c12_mesh(*model).value(), {}, 1);
  // GIVEN a lens 75 ft behind the fuselage's tip, 15 deg below, tilted up by 16 deg
  const double el = -15 * kDeg, tilt = 16 * kDeg, range = 75 * 0.3048;
  const Vec3 eye = Vec3(511, 0, 123) * 0.0254 + range * Vec3(std::cos(el), 0, std::sin(el));
  Mat3 R_c_m;
  R_c_m << 0, 1, 0, -std::sin(tilt), 0, -std::cos(tilt), -std::cos(tilt), 0, std::sin(tilt);
  View view;
  view.T_c_m = {Rotation<frame::C, frame::M>(R_c_m), Point<frame::C>(-(R_c_m * eye))};
  const auto truth = renderer.truth(view, *model);
  int visible = 0;
  for (const FeatureTruth& t : truth) {
    visible += t.visible;
    if (t.id == 2) { EXPECT_TRUE(t.visible); }
    if (t.id == 6) { EXPECT_FALSE(t.visible); }
  }
  EXPECT_GE(visible, 29);
  EXPECT_LE(visible, 36);
}

}  // namespace
}  // namespace cyclops::hil
