// The whole chain on a flight it draws first, stage by stage; then estimate, align and track of one of its frames beside what
// OpenCV offers for the same job.
#include <cstdio>
#include <filesystem>
#include <memory>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/video/tracking.hpp>
#include <thread>

#include "hil/flight.hpp"
#include "test/bench/bench.hpp"
#include "test/support.hpp"
#include "tools/offline.hpp"

namespace cyclops {
namespace {

constexpr int kFrames = 120;
constexpr std::uint64_t kShown = 60;  // number of the frame that the races are about

struct Flown {
  std::unique_ptr<FrameOutput> frame;
  Rig rig{};
};

std::string draw(const test::TempDir& dir) {
  auto scenario = hil::Scenario::load("config/scenarios/embedded.toml");
  if (!scenario.ok()) throw std::runtime_error(scenario.error().message());
  scenario->frames = kFrames;
  hil::FlightOptions options;
  options.out = dir.file("flight");
  options.source = "bench";
  options.threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  const auto made = hil::make_flight(*scenario, options);
  if (!made.ok()) throw std::runtime_error(made.error().message());
  return options.out;
}

void print(const char* name, const Histogram& h) {
  std::printf("  %-56s %10.0f %10.0f %10.0f\n", name, 1e6 * h.quantile(0.5).seconds(), 1e6 * h.quantile(0.99).seconds(), 1e6 * h.max().seconds());
}

Flown fly(const std::string& flight, const test::TempDir& dir, const char* name, const Profile& profile) {
  Flown out;
  const auto run = tools::run_offline(flight, profile, dir.file("log.lcm"), {}, [&](const Rig& rig, const FrameOutput& f, const ImageView&) {
    if (f.in.frame.seq != kShown) return;
    out.frame = std::make_unique<FrameOutput>(f);
    out.rig = rig;
  });
  if (!run.ok()) throw std::runtime_error(run.error().message());
  std::printf("\n%-58s %10s %10s %10s\n", (std::string("chain, 1024x1024 12 bit, ") + std::to_string(run->frames_out) + " frames, profile " + name).c_str(), "p50 us", "p99 us", "max us");
  for (std::size_t s = 0; s < kStages; ++s) print(to_string(static_cast<Stage>(s)), run->stage[s]);
  print("whole chain", run->chain);
  return out;
}

void race_estimate(const Flown& f) {
  const CameraMount mount{camera_from_receiver(f.rig.mount_angles), f.rig.lens, f.rig.boresight_sigma_rad};
  const auto out = std::make_unique<PredictionSet>();
  std::vector<cv::Point3d> points;
  for (const Feature& feature : f.rig.tanker.features()) {
    const Vec3 p = f.rig.tanker.in_body(feature).xyz;
    points.emplace_back(p.x(), p.y(), p.z());
  }
  const Intrinsics& k = f.rig.camera.intrinsics();
  const cv::Matx33d K(k.fx_px, 0, k.cx_px, 0, k.fy_px, k.cy_px, 0, 0, 1);
  const cv::Vec<double, 5> lens(k.k1, k.k2, k.p1, k.p2, k.k3);
  const Pose<frame::C, frame::K>& T = f.frame->alignment.T_c_k;
  const Vec3 r = so3_log(T.rotation().quaternion()), t = T.translation().xyz;
  std::vector<cv::Point2d> image;
  cv::Mat jacobian;
  bench::Race race("estimate: " + std::to_string(points.size()) + " features, covariance and visibility", 1, "us/frame", 1e-6);
  race.add("cyclops", [&] { predict(f.frame->in.nav.state, f.rig.tanker, f.rig.camera, mount, {}, *out); });
  race.add("cv::projectPoints with Jacobian", [&] {
    cv::projectPoints(points, cv::Vec3d(r.x(), r.y(), r.z()), cv::Vec3d(t.x(), t.y(), t.z()), K, lens, image, jacobian);
  });
  race.run();
}

/// The peer is told which corner is which feature, the aligner is not.
void race_align(const Flown& f) {
  const CameraMount mount{camera_from_receiver(f.rig.mount_angles), f.rig.lens, f.rig.boresight_sigma_rad};
  const Pose<frame::C, frame::R> T_c_r(mount.R_c_r, Point<frame::C>(-mount.R_c_r.rotate(mount.lens.xyz)));
  Aligner aligner({}, f.rig.tanker, f.rig.camera, T_c_r, mount.boresight_sigma_rad);
  Alignment alignment;
  Time t = f.frame->in.frame.t_mid;
  std::vector<cv::Point3d> object;
  std::vector<cv::Point2d> image;
  for (const Measurement& m : f.frame->measurements.items) {
    if (!m.accepted) continue;
    const Vec3 p = f.rig.tanker.in_body(f.rig.tanker.features()[m.feature]).xyz;
    object.emplace_back(p.x(), p.y(), p.z());
    image.emplace_back(m.ideal_px.x(), m.ideal_px.y());
  }
  const Intrinsics& k = f.rig.camera.intrinsics();
  const cv::Matx33d K(k.fx_px, 0, k.cx_px, 0, k.fy_px, k.cy_px, 0, 0, 1);
  char title[120];
  std::snprintf(title, sizeof title, "align: %zu corners, %zu features", f.frame->corners.items.size(), f.rig.tanker.features().size());
  bench::Race race(title, 1, "us/frame", 1e-6);
  race.add("cyclops, correspondence unknown", [&] {
    t = t + Duration{33'333'333};
    aligner.predict(t, &f.frame->in.nav.state);
    aligner.step(f.frame->search, f.frame->corners, alignment);
    aligner.search(f.frame->search, f.frame->corners, alignment);
    aligner.learn(alignment);
  });
  if (object.size() >= 6)
    race.add("cv::solvePnPRansac, 100 draws, correspondence given", [&] {
      cv::Vec3d r, where;
      cv::solvePnPRansac(object, image, K, cv::noArray(), r, where, false, 100, 3.0);
    });
  race.run();
}

void race_track(const Flown& f, const Profile& profile) {
  const Intrinsics& k = f.rig.camera.intrinsics();
  Tracker tracker(profile.track, k.width, k.height);
  Time t = f.frame->in.frame.t_mid;
  const std::size_t n = f.frame->tracks.size();
  std::vector<cv::KalmanFilter> filters(n, cv::KalmanFilter(4, 2));
  for (auto& filter : filters) {
    cv::setIdentity(filter.measurementMatrix);
    cv::setIdentity(filter.measurementNoiseCov);
    cv::setIdentity(filter.processNoiseCov);
  }
  const auto aligned = std::make_unique<PredictionSet>(f.frame->aligned);
  const cv::Mat seen = (cv::Mat_<float>(2, 1) << 500, 500);
  bench::Race race("track: " + std::to_string(n) + " tracks", 1, "us/frame", 1e-6);
  race.add("cyclops", [&] {
    t = t + Duration{33'333'333};
    tracker.begin_frame(t);
    aligned->t_mid = t;
    aligned->from_nav = true;
    tracker.nav_update(*aligned);
    tracker.update(f.frame->matches, f.frame->corners);
  });
  race.add("cv::KalmanFilter, one a track", [&] {
    for (auto& filter : filters) {
      filter.predict();
      filter.correct(seen);
    }
  });
  race.run();
}

}  // namespace

BENCH(chain) {
  cv::setNumThreads(1);
  const test::TempDir dir;
  const std::string flight = draw(dir);
  const auto thesis = Profile::load("config/thesis-2007.toml");
  if (!thesis.ok()) throw std::runtime_error(thesis.error().message());
  fly(flight, dir, "thesis-2007", *thesis);
  const Profile profile;
  const Flown flown = fly(flight, dir, "default", profile);
  race_estimate(flown);
  race_align(flown);
  race_track(flown, profile);
}

}  // namespace cyclops
