// The generator of flights: are corners where the camera model puts them, do seeds repeat, is the truth true?
#include "hil/render.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "hil/flight.hpp"
#include "hil/mesh_builder.hpp"
#include "test/support.hpp"

namespace cyclops::hil {
namespace {

constexpr double kDeg = 3.14159265358979323846 / 180;
constexpr const char* kTable = "config/c12/tanker.csv";

/// Coverage 0..1 of a frame; the only thing the measurement below knows.
struct Picture {
  int width, height;
  std::vector<double> share;
  [[nodiscard]] double at(int u, int v) const { return u < 0 || v < 0 || u >= width || v >= height ? 0 : share[static_cast<std::size_t>(v * width + u)]; }
};

std::vector<Vec2> rough_corners(const Picture& p) {
  std::vector<Vec2> inside;
  Vec2 middle(0, 0);
  for (int v = 0; v < p.height; ++v)
    for (int u = 0; u < p.width; ++u)
      if (p.at(u, v) > 0.5) { inside.emplace_back(u, v); middle += inside.back(); }
  middle /= static_cast<double>(inside.size());
  const auto most = [&](auto&& measure) { return *std::max_element(inside.begin(), inside.end(), [&](const Vec2& a, const Vec2& b) { return measure(a) < measure(b); }); };
  const Vec2 a = most([&](const Vec2& q) { return (q - middle).norm(); });
  const Vec2 c = most([&](const Vec2& q) { return (q - a).norm(); });
  const Vec2 n(-(c - a).y(), (c - a).x());
  return {a, most([&](const Vec2& q) { return n.dot(q - a); }), c, most([&](const Vec2& q) { return -n.dot(q - a); })};
}

struct Line { Vec2 on, along; };

/// Fits the edge between two rough corners: along its middle part, coverage across the edge adds up to its place.
Line fit_edge(const Picture& p, const Vec2& a, const Vec2& b, const Vec2& middle) {
  const bool steep = std::fabs(b.y() - a.y()) > std::fabs(b.x() - a.x());
  const auto get = [&](const Vec2& q) { return steep ? Vec2(q.y(), q.x()) : q; };  // (along, across)
  const Vec2 s = get(a), e = get(b), m = get(middle);
  const double low = std::min(s.x(), e.x()), high = std::max(s.x(), e.x()), skip = 0.22 * (high - low);
  double n = 0, st = 0, sc = 0, stt = 0, stc = 0;
  for (int t = static_cast<int>(std::ceil(low + skip)); t <= high - skip; ++t) {
    const double guess = s.y() + (e.y() - s.y()) * (t - s.x()) / (e.x() - s.x());
    const int from = static_cast<int>(std::lround(guess)) - 4, to = from + 8;
    double sum = 0;
    for (int c = from; c <= to; ++c) sum += steep ? p.at(c, t) : p.at(t, c);
    const double across = m.y() > guess ? to + 0.5 - sum : from - 0.5 + sum;
    n += 1; st += t; sc += across; stt += 1.0 * t * t; stc += t * across;
  }
  const double slope = (n * stc - st * sc) / (n * stt - st * st), at0 = (sc - slope * st) / n;
  return {get(Vec2(0, at0)), get(Vec2(1, slope))};
}

std::vector<Vec2> measured_corners(const Picture& p) {
  const auto rough = rough_corners(p);
  const Vec2 middle = 0.25 * (rough[0] + rough[1] + rough[2] + rough[3]);
  std::vector<Line> edges;
  for (std::size_t i = 0; i < 4; ++i) edges.push_back(fit_edge(p, rough[i], rough[(i + 1) % 4], middle));
  std::vector<Vec2> out;
  for (std::size_t i = 0; i < 4; ++i) {
    const Line &a = edges[(i + 3) % 4], &b = edges[i];
    Mat2 m;
    m << a.along, -b.along;
    out.push_back(a.on + a.along * m.inverse().row(0).dot(b.on - a.on));
  }
  return out;
}

Mesh board(double side_m) {
  MeshBuilder b;
  const double h = side_m / 0.0254 / 2;
  b.quad({-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}, b.material({"white", 1.0F, 0, true}));
  return b.mesh();
}

Look clean() {
  Look look;
  look.light.sun = 0;
  look.light.sky = look.light.ground = 4000;
  look.electrons_per_count = 1e9;
  look.read_noise_e = 0;
  look.black_level = 0;
  return look;
}

/// Sum of squared distances of 4 measured corners from the projected ones.
double squared_error(const Camera& camera, double side_m, const View& view) {
  const Renderer renderer(camera, board(side_m), clean(), 1);
  std::vector<std::uint16_t> counts;
  renderer.render(view, counts, 0);
  Picture p{camera.intrinsics().width, camera.intrinsics().height, {}};
  for (std::uint16_t c : counts) p.share.push_back(c / 4000.0);
  double sum = 0;
  for (const Vec2& corner : measured_corners(p)) {
    double nearest = 1e9;
    for (double x : {-1.0, 1.0})
      for (double y : {-1.0, 1.0})
        nearest = std::min(nearest, (*camera.project(view.T_c_m * Point<frame::M>(0.5 * side_m * x, 0.5 * side_m * y, 0)) - corner).squaredNorm());
    sum += nearest;
  }
  return sum;
}

View tilted(double turn_deg, double tilt_deg, const Vec3& place) {
  View v;
  v.T_c_m = {Rotation<frame::C, frame::M>(Mat3(rotation_z(turn_deg * kDeg) * rotation_x(tilt_deg * kDeg) * rotation_y(0.6 * tilt_deg * kDeg))), Point<frame::C>(place)};
  return v;
}

TEST(Render, CornersOfATiltedBoardLieWithinATwentiethPixelOfTheirProjection) {
  Intrinsics k;
  k.width = k.height = 256;
  k.cx_px = k.cy_px = 127.5;
  const Camera camera(k, {});
  double sum = 0;
  int n = 0;
  for (double turn : {7.0, 23.0, 38.0, 61.0, 81.0})
    for (double tilt : {-40.0, 15.0, 35.0}) {
      sum += squared_error(camera, 1.1, tilted(turn, tilt, {0.03 * tilt / 40, 0.05, 10}));
      n += 4;
    }
  EXPECT_LT(std::sqrt(sum / n), 0.05);
  RecordProperty("rms_px", std::to_string(std::sqrt(sum / n)));
}

// Small boards: over 20 px the bend of an edge is below the tolerance, so straight lines may be fitted.
TEST(Render, CornersStayWhereALensThatBendsPutsThem) {
  Intrinsics k;
  k.width = k.height = 512;
  k.cx_px = k.cy_px = 255.5;
  k.fx_px = k.fy_px = 400;
  k.k1 = -0.2;
  k.k2 = 0.05;
  const Camera camera(k, {});
  double sum = 0;
  int n = 0;
  for (const Vec3& place : {Vec3(-4, -3, 10), Vec3(4.5, 1, 10), Vec3(0, 5, 10), Vec3(3, -4, 9)}) {
    sum += squared_error(camera, 0.45, tilted(27, 20, place));
    n += 4;
  }
  EXPECT_LT(std::sqrt(sum / n), 0.05);
  RecordProperty("rms_px", std::to_string(std::sqrt(sum / n)));
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
