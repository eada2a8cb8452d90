#include "tools/peers/peer.hpp"

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>

#include <opencv2/imgproc.hpp>

#include "tools/offline.hpp"

namespace cyclops::peers {
namespace {

cv::Mat as_mat(const ImageView& image) {
  return {image.height, image.width, bytes_per_pixel(image.format) == 1 ? CV_8U : CV_16U, const_cast<std::uint8_t*>(image.data), static_cast<std::size_t>(image.stride_bytes)};
}

double full_scale(const cv::Mat& image) {
  std::vector<int> values;
  for (int v = 0; v < image.rows; v += 4)
    for (int u = 0; u < image.cols; u += 4) values.push_back(image.depth() == CV_8U ? image.at<std::uint8_t>(v, u) : image.at<std::uint16_t>(v, u));
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(0.999 * static_cast<double>(values.size()));
  std::nth_element(values.begin(), at, values.end());
  return std::max(1, *at);
}

/// A frame as the peer sees it, in the form of Cyclops' own output.
class Recorder {
 public:
  Recorder(tools::EvaluationTables& tables, Peer& peer) : tables_(tables), peer_(peer), out_(std::make_unique<FrameOutput>()) {}

  void see(const Rig& rig, const FrameOutput& in, const ImageView& image) {
    *out_ = in;
    out_->tracks_before.clear();
    out_->tracks.clear();
    out_->measurements.items.clear();
    found_.clear();
    const auto begin = std::chrono::steady_clock::now();
    if (image.data != nullptr) {
      const cv::Mat raw = as_mat(image);
      if (scale_ == 0) scale_ = raw.depth() == CV_8U ? 1.0 : 255.0 / full_scale(raw);
      raw.convertTo(grey_, CV_8U, scale_);
      peer_.step(rig, in, grey_, found_);
    }
    for (Duration& d : out_->stage_time) d = {};
    out_->chain_time = Duration{std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now() - begin).count()};
    for (const Found& f : found_) add(rig, f);
    tables_.add(rig, *out_);
  }

 private:
  void add(const Rig& rig, const Found& f) {
    Measurement m;
    m.id = f.id;
    m.accepted = true;
    m.raw_px = f.raw_px;
    m.ideal_px = rig.camera.ideal_from_raw(f.raw_px);
    out_->measurements.items.push_back(m);
    Track t;
    t.id = f.id;
    t.state = TrackState::kLive;
    out_->tracks.push_back(t);
  }

  tools::EvaluationTables& tables_;
  Peer& peer_;
  std::unique_ptr<FrameOutput> out_;
  std::vector<Found> found_;
  cv::Mat grey_;
  double scale_{0};
};

}  // namespace

int run(int argc, char** argv, const char* about, const std::function<std::unique_ptr<Peer>(const Rig&)>& make) {
  CLI::App app{about};
  app.set_version_flag("--version", CYCLOPS_VERSION);
  std::string flight, config, out;
  app.add_option("flight", flight, "flight folder with truth")->required();
  app.add_option("--config", config, "profile of Cyclops; only its navigation counts here")->required();
  app.add_option("--out", out, "folder for features.npy, frames.npy and rig.json")->required();
  std::int64_t frames = std::numeric_limits<std::int64_t>::max();
  app.add_option("--frames", frames, "ends after so many")->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  const auto fail = [&](const Error& e) {
    std::fprintf(stderr, "%s: %s\n", argv[0], e.message().c_str());
    return 1;
  };
  cv::setNumThreads(1);
  auto profile = Profile::load(config);
  if (!profile.ok()) return fail(profile.error());
  auto rig = Rig::load(flight + "/rig.toml");
  if (!rig.ok()) return fail(rig.error());
  auto tables = tools::EvaluationTables::create(flight);
  if (!tables.ok()) return fail(tables.error());
  std::error_code ignored;
  std::filesystem::create_directories(out, ignored);
  const auto peer = make(*rig);
  Recorder recorder(*tables, *peer);
  const std::string log = out + "/published.lcm";
  const auto result = tools::run_offline(flight, *profile, log, {}, [&](const Rig& r, const FrameOutput& in, const ImageView& image) { recorder.see(r, in, image); }, {.most_frames = frames});
  std::filesystem::remove(log, ignored);
  if (!result.ok()) return fail(result.error());
  if (auto done = tables->write(*rig, out); !done.ok()) return fail(done.error());
  return 0;
}

}  // namespace cyclops::peers
