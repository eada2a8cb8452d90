// How the chain's time grows with the features of the model and with the picture: 38, 200 and 1000 features, 1, 2 and 4 thousand
// pixels square. Features are drawn corners spread over the whole picture, so that the searched part of it grows with their number;
// as many others, which move otherwise, are clutter. `make bench-scaling` prints the table, and plots it from the JSON file.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <vector>

#include <nlohmann/json.hpp>

#include "service/chain.hpp"
#include "test/bench/bench.hpp"
#include "test/support.hpp"

namespace cyclops {
namespace {

constexpr int kFrames = 24, kSettled = 6;   // the first ones learn what the features look like
constexpr double kField_px = 1041.6666666666667 / 1024;  // focal length of a picture one pixel wide: the flight test's 12.5 mm
constexpr double kRange_m = 25, kDepth_m = 4, kHalfSpan = 0.43;  // of the picture
constexpr double kCorner_px = 5;            // 1 sigma of the window that a drawn corner fades in
const Pose<frame::C, frame::R> kMount(camera_from_receiver({}), Point<frame::C>(0, 0, 0));

struct Scene {
  Rig rig{};
  std::vector<Point<frame::K>> clutter;
  std::vector<double> turn_rad;             // of each drawn corner
};

/// Places on a jittered grid, so that no two corners melt into one.
std::vector<Point<frame::K>> spread(int count, test::Random& random) {
  const int side = static_cast<int>(std::ceil(std::sqrt(count)));
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<int> cells(static_cast<std::size_t>(side * side));
  for (std::size_t i = 0; i < cells.size(); ++i) cells[i] = static_cast<int>(i);
  std::shuffle(cells.begin(), cells.end(), random);
  std::vector<Point<frame::K>> out;
  for (int i = 0; i < count; ++i) {
    const double depth = kDepth_m * (2 * unit(random) - 1), reach = 2 * kHalfSpan * (kRange_m + depth) / kField_px / side;
    const int cell = cells[static_cast<std::size_t>(i)];
    const double y = (cell % side + 0.2 + 0.6 * unit(random) - 0.5 * side) * reach, z = (cell / side + 0.2 + 0.6 * unit(random) - 0.5 * side) * reach;
    out.emplace_back(depth, y, z);
  }
  return out;
}

Scene make_scene(int features, int side_px) {
  test::Random random(static_cast<std::uint64_t>(features));
  Scene scene;
  Intrinsics k;
  k.width = k.height = side_px;
  k.fx_px = k.fy_px = kField_px * side_px;
  k.cx_px = k.cy_px = 0.5 * (side_px - 1);
  scene.rig.camera = Camera(k, {});
  std::string csv = "id,x,y,z,sigma\n";
  int id = 0;
  for (const Point<frame::K>& p : spread(features, random)) {
    char line[120];
    std::snprintf(line, sizeof line, "%d,%.6f,%.6f,%.6f,0.001\n", ++id, -p.xyz.x(), p.xyz.y(), -p.xyz.z());
    csv += line;
  }
  scene.rig.tanker = TankerModel::parse(csv, "scaling", 1, {0, 0, 0}).value();
  scene.clutter = spread(features, random);
  std::uniform_real_distribution<double> angle(0, 3.14159);
  for (int i = 0; i < 2 * features; ++i) scene.turn_rad.push_back(angle(random));
  return scene;
}

/// Four quadrants, two bright and two dark, that fade into the ground.
void draw_corner(std::vector<std::uint8_t>& pixels, int side, const Vec2& at, double turn) {
  const int reach = static_cast<int>(3 * kCorner_px), u0 = static_cast<int>(at.x()), v0 = static_cast<int>(at.y());
  const double c = std::cos(turn), s = std::sin(turn);
  for (int v = std::max(0, v0 - reach); v <= std::min(side - 1, v0 + reach); ++v)
    for (int u = std::max(0, u0 - reach); u <= std::min(side - 1, u0 + reach); ++u) {
      const double x = u - at.x(), y = v - at.y();
      const double grey = 70 * std::tanh((c * x + s * y) / 0.8) * std::tanh((c * y - s * x) / 0.8) * std::exp(-0.5 * (x * x + y * y) / (kCorner_px * kCorner_px));
      std::uint8_t& p = pixels[static_cast<std::size_t>(v) * static_cast<std::size_t>(side) + static_cast<std::size_t>(u)];
      p = static_cast<std::uint8_t>(std::clamp(p + grey, 0.0, 255.0));
    }
}

Pose<frame::R, frame::K> true_pose(int frame) {
  const double s = frame / 30.0;
  return {Rotation<frame::R, frame::K>(so3_exp(Vec3(0.010 * std::sin(s), 0.008 * std::sin(1.3 * s), 0.006 * std::sin(0.7 * s)))),
          Point<frame::R>(kRange_m - 0.4 * s, 0.3 * std::sin(2 * s), 0.2 * std::sin(1.5 * s))};
}

void draw(const Scene& scene, int frame, std::vector<std::uint8_t>& pixels) {
  const int side = scene.rig.camera.intrinsics().width;
  test::Random random(static_cast<std::uint64_t>(frame) + 1);
  for (std::uint8_t& p : pixels) p = static_cast<std::uint8_t>(118 + (random() & 3U) + (random() & 3U));
  const auto put = [&](const Pose<frame::C, frame::K>& T, const Point<frame::K>& p, double turn) {
    if (const auto at = scene.rig.camera.project(T * p)) draw_corner(pixels, side, *at, turn);
  };
  const Pose<frame::C, frame::K> now = kMount * true_pose(frame), other = kMount * true_pose(400 + 4 * frame);
  std::size_t n = 0;
  for (const Feature& f : scene.rig.tanker.features()) put(now, scene.rig.tanker.in_body(f), scene.turn_rad[n++]);
  for (const Point<frame::K>& p : scene.clutter) put(other, p, scene.turn_rad[n++]);
}

/// Navigation 27 cm and 0.3 degrees off at every frame, sigmas to match: about 10 px of 1024.
AlignedFrame frame_at(int frame) {
  AlignedFrame out;
  out.frame.seq = static_cast<std::uint64_t>(frame) + 1;
  out.frame.t_mid = Time{1'000'000'000'000 + frame * 33'333'333LL};
  out.frame.status = FrameStatus::kComplete;
  RelativeState& nav = out.nav.state;
  nav.t = out.frame.t_mid;
  nav.valid = true;
  const Pose<frame::R, frame::K> T = true_pose(frame);
  nav.T_r_k = {Rotation<frame::R, frame::R>(so3_exp(Vec3(0.003, -0.002, 0.004))) * T.rotation(), Point<frame::R>(T.translation().xyz + Vec3(0.2, 0.15, -0.1))};
  nav.covariance.diagonal() << Vec3::Constant(1.6e-5), Vec3::Constant(0.02);
  out.nav.absence = NavAbsence::kNone;
  return out;
}

double quantile(std::vector<double> v, double share) {
  std::sort(v.begin(), v.end());
  return v.empty() ? 0 : v[static_cast<std::size_t>(share * static_cast<double>(v.size() - 1))];
}

nlohmann::json run(int features, int side_px) {
  const Scene scene = make_scene(features, side_px);
  auto chain = std::make_unique<Chain>(scene.rig, Profile{});
  auto out = std::make_unique<FrameOutput>();
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(side_px) * static_cast<std::size_t>(side_px));
  std::vector<double> cpu_us, stage_us[kStages], error_px;
  double measured = 0, corners = 0, consensus = 0, searched = 0;
  for (int f = 0; f < kFrames; ++f) {
    draw(scene, f, pixels);
    const ImageView image{pixels.data(), side_px, side_px, side_px, PixelFormat::kMono8};
    const double begin = bench::thread_seconds();
    chain->step(frame_at(f), image, nullptr, *out);
    const double spent = bench::thread_seconds() - begin;
    if (f < kSettled) continue;
    cpu_us.push_back(1e6 * spent);
    for (std::size_t s = 0; s < kStages; ++s) stage_us[s].push_back(1e-3 * static_cast<double>(out->stage_time[s].ns));
    corners += static_cast<double>(out->corners.items.size()) / (kFrames - kSettled);
    consensus += out->alignment.consensus ? 1.0 / (kFrames - kSettled) : 0;
    for (const SubImage& b : out->sub_images) searched += static_cast<double>(b.width) * b.height / side_px / side_px / (kFrames - kSettled);
    const Pose<frame::C, frame::K> T = kMount * true_pose(f);
    for (const Measurement& m : out->measurements.items) {
      const auto at = scene.rig.camera.project(T * scene.rig.tanker.in_body(scene.rig.tanker.features()[m.feature]));
      if (!m.accepted || !at) continue;
      measured += 1.0 / (kFrames - kSettled);
      error_px.push_back((m.raw_px - *at).norm());
    }
  }
  nlohmann::json j{{"features", features}, {"side_px", side_px}, {"cpu_us", quantile(cpu_us, 0)}, {"corners", corners}, {"measured", measured},
                   {"error_px", quantile(error_px, 0.5)}, {"consensus", consensus}, {"searched", searched}};
  // The chain times its stages by the wall clock, in which other work on the machine is. Their least times split the CPU time.
  double sum = 0;
  for (const auto& v : stage_us) sum += quantile(v, 0);
  for (std::size_t s = 0; s < kStages; ++s) j["stage_us"][to_string(static_cast<Stage>(s))] = quantile(stage_us[s], 0) * quantile(cpu_us, 0) / sum;
  return j;
}

void print(const nlohmann::json& j) {
  std::printf("%8d %6d %8.0f %7.0f %9.2f %8.1f |", j["features"].get<int>(), j["side_px"].get<int>(), j["corners"].get<double>(), j["measured"].get<double>(), j["error_px"].get<double>(), 100 * j["searched"].get<double>());
  for (std::size_t s = 0; s < kStages; ++s) std::printf(" %9.0f", j["stage_us"][to_string(static_cast<Stage>(s))].get<double>());
  std::printf(" | %9.0f\n", j["cpu_us"].get<double>());
  std::fflush(stdout);
}

}  // namespace

/// CYCLOPS_SCALING names a JSON file to write.
BENCH(scaling) {
  std::printf("\nchain by features and picture, default profile: least CPU time of a frame, us\n");
  std::printf("%8s %6s %8s %7s %9s %8s |", "features", "px", "corners", "measured", "median px", "area %");
  for (std::size_t s = 0; s < kStages; ++s) std::printf(" %9s", to_string(static_cast<Stage>(s)));
  std::printf(" | %9s\n", "chain");
  nlohmann::json all = nlohmann::json::array();
  for (const int features : {38, 200, 1000})
    for (const int side : {1024, 2048, 4096}) {
      all.push_back(run(features, side));
      print(all.back());
    }
  const char* path = std::getenv("CYCLOPS_SCALING");
  if (path == nullptr) return;
  std::ofstream file(path);
  file << all.dump(1) << "\n";
  if (!file.flush()) throw std::runtime_error(std::string(path) + " cannot be written");
}

}  // namespace cyclops
