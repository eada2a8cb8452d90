#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include "hil/made_up_windscreen.hpp"
#include "hil/mesh_file.hpp"
#include "hil/render_corners.hpp"

namespace {

using namespace cyclops;
using namespace cyclops::hil;

double thread_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

Intrinsics lens(double focal_mm) {
  Intrinsics k;
  k.fx_px = k.fy_px = focal_mm / 0.012;
  return k;
}

double error(const BoardCorner& c) { return c.px; }
double error(const FeatureCorner& c) { return *c.px; }

template <class Corner>
void say(const char* what, double focal_mm, double range_ft, std::vector<Corner> all) {
  std::printf("%-8s %5.1f mm %4.0f ft  ", what, focal_mm, range_ft);
  if (all.empty()) { std::printf("no corner was found\n"); return; }
  std::sort(all.begin(), all.end(), [](const Corner& a, const Corner& b) { return error(a) < error(b); });
  std::printf("%3zu corners  median %.3f  90 %% %.3f  worst %.3f px (%d)\n", all.size(), error(all[all.size() / 2]), error(all[all.size() * 9 / 10]), error(all.back()), all.back().id);
}

/// Every visible, scored feature: in the figures, or by name and elevation among those that were not found.
void measure(const Mesh& mesh, const TankerModel& model, const Vec3& reference_in, bool each) {
  for (const double focal : {12.5, 25.0})
    for (const double range : {300.0, 75.0, 35.0}) {
      std::vector<FeatureCorner> features;
      std::string missing;
      for (const double el : {-12.0, -18.0})
        for (const FeatureCorner& c : feature_corners(lens(focal), mesh, level_view(range, el, 0, reference_in), model)) {
          if (c.px) features.push_back(c);
          else missing += fmt::format("  {} at {:.0f} deg", c.id, el);
          if (each && c.px) std::printf("  %2d at %.0f deg  %.4f px +- %.4f, zoom %d, by %s\n", c.id, el, *c.px, c.sigma_px, c.zoom, c.by_faces ? "faces" : "paint");
        }
      say("board", focal, range, board_corners(Camera(lens(focal), {}), range * 0.3048));
      say("+screen", focal, range, board_corners(Camera(lens(focal), made_up_windscreen(1024, 1024, 1).value()), range * 0.3048, 2));
      say("tanker", focal, range, features);
      if (!missing.empty()) std::printf("         no corner found:%s\n", missing.c_str());
    }
}

void time_frames(const Mesh& mesh, const TankerModel& model, const Look& look, const Vec3& reference_in) {
  const Camera camera(lens(12.5), made_up_windscreen(1024, 1024, 1).value());
  const Renderer renderer(camera, mesh, look, 1);
  std::vector<std::uint16_t> out;
  std::vector<float> light;
  for (const double range : {300.0, 75.0, 35.0}) {
    double whole = 1e9, scene = 1e9, truth = 1e9;
    for (int i = 0; i < 5; ++i) {
      View view = level_view(range, -15, 0, reference_in);
      view.frame = static_cast<std::uint64_t>(i);
      view.moves = true;
      view.T_c_m_start = view.T_c_m_end = view.T_c_m;
      const double a = thread_ms();
      renderer.draw(view, Drawing::kLight, light);
      const double b = thread_ms();
      renderer.render(view, out);
      const double c = thread_ms();
      (void)renderer.truth(view, model, &out);
      const double d = thread_ms();
      scene = std::min(scene, b - a), whole = std::min(whole, c - b), truth = std::min(truth, d - c);
    }
    std::printf("%4.0f ft  frame %.0f ms (sky and body %.0f), truth %.1f ms of one thread, best of 5\n", range, whole, scene, truth);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Looks at single frames of the flight generator: a picture, how exact its corners are, how long a frame takes."};
  app.set_version_flag("--version", CYCLOPS_VERSION);
  std::string picture, table = "config/c12/tanker.csv", file;
  TankerMeshConfig shape;
  std::vector<double> reference{511, 0, 123};
  bool corners = false, each = false, times = false;
  double range = 75, elevation = -15, azimuth = 0, focal = 12.5, gamma = 1;
  app.add_option("--picture", picture, "PNG to write, 8 bits");
  app.add_flag("--corners", corners, "rendered against projected corners, a table");
  app.add_flag("--each", each, "with --corners: every feature on a line");
  app.add_flag("--times", times, "thread time a frame, a table");
  app.add_option("--look", file, "TOML with [light] [sky] [optics] [sensor]");
  app.add_option("--tanker", table, "feature table")->capture_default_str();
  app.add_option("--mesh", shape.mesh, "its shape: c12, or a file in inches, x aft, y right, z up")->capture_default_str();
  app.add_option("--reference", reference, "in, model axes: ranges count from here")->expected(3)->capture_default_str();
  app.add_option("--range", range, "ft")->capture_default_str();
  app.add_option("--elevation", elevation, "deg")->capture_default_str();
  app.add_option("--azimuth", azimuth, "deg")->capture_default_str();
  app.add_option("--focal", focal, "mm")->capture_default_str();
  app.add_option("--gamma", gamma, "of the picture alone")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const auto fail = [](const Error& e) { std::fprintf(stderr, "cyclops-render: %s\n", e.message().c_str()); return 1; };
  Look look;
  if (!file.empty()) {
    const auto config = ConfigFile::load(file);
    if (!config.ok()) return fail(config.error());
    ConfigTable root = config->root();
    read_look(root, look);
    if (const auto done = config->finish(); !done.ok()) return fail(done.error());
  }
  const auto model = TankerModel::load(table, 0.0254, {190, 0, 95});
  if (!model.ok()) return fail(model.error());
  const Vec3 reference_in(reference[0], reference[1], reference[2]);
  const auto mesh = tanker_mesh(shape, *model);
  if (!mesh.ok()) return fail(mesh.error());
  if (corners) measure(*mesh, *model, reference_in, each);
  if (times) time_frames(*mesh, *model, look, reference_in);
  if (picture.empty()) return 0;
  const Renderer renderer(Camera(lens(focal), made_up_windscreen(1024, 1024, 1).value()), *mesh, look, 1);
  std::vector<std::uint16_t> counts;
  renderer.render(level_view(range, elevation, azimuth, reference_in), counts);
  cv::Mat out(1024, 1024, CV_8U);
  for (std::size_t i = 0; i < counts.size(); ++i)
    out.data[i] = static_cast<std::uint8_t>(255 * std::pow(1.0 * counts[i] / renderer.look().sensor.top_count(), 1 / gamma) + 0.5);
  if (!cv::imwrite(picture, out)) return fail(make_error(ErrorCode::kIo, picture, "cannot be written"));
  std::printf("%s: f/%.1f\n", picture.c_str(), renderer.look().optics.f_number);
  return 0;
}
