#include "tools/export_pictures.hpp"

#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <cyclops/measurement_set_t.hpp>
#include <cyclops/nav_state_t.hpp>
#include <cyclops/prediction_set_t.hpp>

#include "record/flight.hpp"
#include "service/rig.hpp"
#include "wire/codec.hpp"

namespace cyclops::tools {
namespace fs = std::filesystem;
namespace {

const cv::Scalar kGreen(120, 187, 72), kAmber(75, 201, 236), kWhite(255, 255, 255);

struct Said {                      // of one frame
  measurement_set_t measurements{};
  prediction_set_t predictions{};
};

cv::Mat counts_of(const ImageView& image) {
  return {image.height, image.width, image.format == PixelFormat::kMono8 ? CV_8UC1 : CV_16UC1, const_cast<std::uint8_t*>(image.data), static_cast<std::size_t>(image.stride_bytes)};
}

void cross(cv::Mat& to, cv::Point2d p, int r) {
  cv::line(to, p - cv::Point2d(r, 0), p + cv::Point2d(r, 0), kAmber, 1, cv::LINE_AA);
  cv::line(to, p - cv::Point2d(0, r), p + cv::Point2d(0, r), kAmber, 1, cv::LINE_AA);
}

cv::Mat draw(const ImageView& image, std::int64_t seq, const Said* said) {
  cv::Mat grey, out;
  cv::normalize(counts_of(image), grey, 0, 255, cv::NORM_MINMAX, CV_8U);
  cv::cvtColor(grey, out, cv::COLOR_GRAY2BGR);
  const double scale = std::max(1.0, 640.0 / image.width);
  if (scale > 1) cv::resize(out, out, {}, scale, scale, cv::INTER_NEAREST);
  char text[160];
  std::snprintf(text, sizeof text, "frame %lld: nothing published", static_cast<long long>(seq));
  if (said != nullptr) {
    const auto place = [scale](double u, double v) { return cv::Point2d((u + 0.5) * scale - 0.5, (v + 0.5) * scale - 0.5); };
    std::map<int, bool> accepted;
    for (const auto& m : said->measurements.items) {
      if (m.accepted == 0) continue;
      accepted[m.id] = true;
      const cv::Point2d p = place(m.raw_px[0], m.raw_px[1]);
      cv::circle(out, p, 7, kGreen, 1, cv::LINE_AA);
      cv::putText(out, std::to_string(m.id), p + cv::Point2d(9, -5), cv::FONT_HERSHEY_SIMPLEX, 0.4, kGreen, 1, cv::LINE_AA);
    }
    for (const auto& p : said->predictions.items)
      if (p.visibility == prediction_t::VISIBLE && accepted.count(p.id) == 0) cross(out, place(static_cast<double>(p.uv_px[0]), static_cast<double>(p.uv_px[1])), 5);
    const auto& m = said->measurements;
    std::snprintf(text, sizeof text, "frame %lld  GPS %.3f s  %d measured  range %.1f m  integrity %.2f", static_cast<long long>(seq), static_cast<double>(m.mid_exposure_gps_ns) * 1e-9, m.accepted,
                  static_cast<double>(said->predictions.range_m), static_cast<double>(m.integrity));
  }
  cv::copyMakeBorder(out, out, 20, 0, 0, 0, cv::BORDER_CONSTANT, {0, 0, 0});
  cv::putText(out, text, {6, 14}, cv::FONT_HERSHEY_SIMPLEX, 0.45, kWhite, 1, cv::LINE_AA);
  return out;
}

/// The program ffmpeg, fed with pictures.
class Film {
 public:
  Film(std::string path, double rate_hz) : path_(std::move(path)), rate_hz_(rate_hz) {}
  Result<> add(const cv::Mat& picture) {
    if (!pipe_) CYCLOPS_TRY(open(picture));
    const std::size_t bytes = picture.total() * picture.elemSize();
    if (std::fwrite(picture.data, 1, bytes, pipe_.get()) != bytes) return make_error(ErrorCode::kIo, path_, "ffmpeg does not take more pictures");
    return Ok{};
  }
  Result<> close() {
    if (!pipe_) return Ok{};
    if (pclose(pipe_.release()) != 0) return make_error(ErrorCode::kIo, path_, "ffmpeg failed (is it installed? make deps-extra)");
    return Ok{};
  }

 private:
  Result<> open(const cv::Mat& picture) {
    if (path_.find('\'') != std::string::npos) return make_error(ErrorCode::kInvalid, path_, "holds a quote");
    char command[256];
    std::snprintf(command, sizeof command, "ffmpeg -loglevel error -y -f rawvideo -pix_fmt bgr24 -s %dx%d -r %g -i - -pix_fmt yuv420p -vf 'pad=ceil(iw/2)*2:ceil(ih/2)*2' ", picture.cols, picture.rows, rate_hz_);
    pipe_.reset(popen((command + ("'" + path_ + "'")).c_str(), "w"));
    if (!pipe_) return make_error(ErrorCode::kIo, path_, "ffmpeg cannot be started");
    return Ok{};
  }
  struct Close { void operator()(std::FILE* f) const { pclose(f); } };
  std::string path_;
  double rate_hz_;
  std::unique_ptr<std::FILE, Close> pipe_;
};

Result<std::map<std::int64_t, Said>> read_said(const std::vector<std::string>& logs) {
  std::map<std::int64_t, Said> out;
  record::LogEvent e;
  for (const std::string& path : logs) {
    auto log = record::EventLog::open(path);
    if (!log.ok()) return log.error();
    measurement_set_t m;
    prediction_set_t p;
    while (true) {
      auto more = log->next(e);
      if (!more.ok()) return more.error();
      if (!*more) break;
      const int n = static_cast<int>(e.data.size());
      if (e.channel == channel::kMeasurement && m.decode(e.data.data(), 0, n) >= 0) out[m.seq].measurements = m;
      if (e.channel == channel::kPrediction && p.decode(e.data.data(), 0, n) >= 0) out[p.seq].predictions = p;
    }
  }
  return out;
}

std::string numbered(const std::string& folder, std::int64_t seq) {
  char name[32];
  std::snprintf(name, sizeof name, "frame_%06lld.png", static_cast<long long>(seq));
  return (fs::path(folder) / name).string();
}

Result<> write_png(const std::string& path, const cv::Mat& picture) {
  std::vector<std::uint8_t> png;
  cv::imencode(".png", picture, png);
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> f(std::fopen(path.c_str(), "wb"), std::fclose);
  if (!f || std::fwrite(png.data(), 1, png.size(), f.get()) != png.size() || std::fflush(f.get()) != 0) return make_error(ErrorCode::kIo, path, "cannot be written");
  return Ok{};
}

}  // namespace

Result<Exported> export_pictures(const ExportOptions& o) {
  auto flight = FlightReader::open(o.folder);
  if (!flight.ok()) return flight.error();
  auto rig = Rig::load(flight->path("rig.toml"));
  if (!rig.ok()) return rig.error();
  auto said = read_said(o.logs);
  if (!said.ok()) return said.error();
  for (const std::string& folder : {o.frames, o.pictures})
    if (std::error_code error; !folder.empty() && (fs::create_directories(folder, error), error)) return make_error(ErrorCode::kIo, folder, error.message());
  Film film(o.video, rig->device.frame_rate_hz);
  Exported out;
  std::vector<std::uint8_t> memory;
  record::LogEvent e;
  std::int64_t seq = 0, first_us = 0;
  while (true) {
    auto more = flight->next(e);
    if (!more.ok()) return more.error();
    if (!*more) break;
    if (e.channel != channel::kFrame) continue;
    const auto index = decode_frame_index(e.data.data(), e.data.size());
    if (!index.ok()) return index.error();
    if (++seq == 1) first_us = e.time_us;
    const double s = static_cast<double>(e.time_us - first_us) * 1e-6;
    if (s < o.from_s || s >= o.to_s || !flight->has_frame(index->recorded_at)) continue;
    FlightFrame frame;
    CYCLOPS_TRY(flight->frame(index->recorded_at, memory, frame));
    if (frame.image.data == nullptr) continue;
    if (!o.frames.empty()) {
      CYCLOPS_TRY(write_png(numbered(o.frames, seq), counts_of(frame.image)));
      ++out.frames;
    }
    if (o.pictures.empty() && o.video.empty()) continue;
    const auto it = said->find(seq);
    const cv::Mat picture = draw(frame.image, seq, it == said->end() ? nullptr : &it->second);
    if (!o.pictures.empty()) CYCLOPS_TRY(write_png(numbered(o.pictures, seq), picture));
    if (!o.video.empty()) CYCLOPS_TRY(film.add(picture));
    ++out.pictures;
  }
  CYCLOPS_TRY(film.close());
  return out;
}

}  // namespace cyclops::tools
