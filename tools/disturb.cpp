#include "tools/disturb.hpp"

#include <cyclops/frame_index_t.hpp>
#include <cyclops/time_mark_t.hpp>
#include <cyclops/truth_t.hpp>
#include <cyclops/tspi_t.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>

#include "hil/flight_messages.hpp"
#include "hil/noise.hpp"
#include "record/flight.hpp"
#include "wire/channels.hpp"

namespace cyclops::tools {
namespace {

namespace fs = std::filesystem;
constexpr double kDeg = std::numbers::pi / 180;
constexpr int kSkyRows = 64;

template <class T>
bool decode(const record::LogEvent& e, T& out) {
  return out.decode(e.data.data(), 0, static_cast<int>(e.data.size())) == static_cast<int>(e.data.size());
}

template <class T>
void encode(const T& message, std::vector<std::uint8_t>& out) {
  out.resize(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(out.data(), 0, static_cast<int>(out.size()));
}

Vec3 direction(std::int64_t seed, std::uint64_t what) {
  Vec3 v;
  for (int i = 0; i < 3; ++i) v[i] = hil::normal(hil::key(static_cast<std::uint64_t>(seed), what, static_cast<std::uint64_t>(i)));
  return v.normalized();
}

class Copy {
 public:
  Copy(FlightReader from, FlightWriter to, const Disturbance& how) : from_(std::move(from)), to_(std::move(to)), how_(how), manifest_(from_.manifest()) {}

  Result<> all() {
    CYCLOPS_TRY(find_clock());
    CYCLOPS_TRY(from_.rewind());
    record::LogEvent e;
    while (true) {
      auto more = from_.next(e);
      if (!more.ok()) return more.error();
      if (!*more) break;
      CYCLOPS_TRY(pass(e));
    }
    manifest_.frames = frames_;
    manifest_.last_frame_ns = last_frame_ns_;
    for (const auto& [name, size] : from_.manifest().files) {
      if (name == "messages.lcm" || name == "frames.lcm") continue;
      std::error_code failed;
      fs::copy_file(from_.path(name), to_.path(name), failed);
      if (failed) return make_error(ErrorCode::kIo, to_.path(name), failed.message());
    }
    return to_.finish(manifest_);
  }

 private:
  Result<> find_clock() {
    record::LogEvent e;
    time_mark_t mark{};
    while (true) {
      auto more = from_.next(e);
      if (!more.ok()) return more.error();
      if (!*more) return make_error(ErrorCode::kNotFound, "TIME_MARK", "the flight has none: GPS times cannot be placed");
      if (e.channel != channel::kTimeMark || !decode(e, mark)) continue;
      service_less_gps_ns_ = mark.service_time_ns - mark.gps_time_ns;
      return Ok{};
    }
  }

  Result<> pass(record::LogEvent& e) {
    if (e.channel == channel::kTspiTanker) navigation(e);
    if (e.channel == channel::kFrame) return frame(e);
    if (e.channel == channel::kTruth && !truth(e)) return Ok{};
    return to_.message(Time{e.time_us * 1000}, e.channel.c_str(), e.data.data(), e.data.size());
  }

  [[nodiscard]] bool disturbed(std::int64_t gps_ns) const {
    const double t = static_cast<double>(gps_ns + service_less_gps_ns_ - manifest_.first_frame_ns) * 1e-9;
    return t >= how_.at_s && t < how_.at_s + how_.for_s;
  }

  void navigation(record::LogEvent& e) {
    tspi_t m{};
    if (!decode(e, m)) return;
    if (!disturbed(m.gps_time_ns)) {
      still_ = m;
      return;
    }
    if (how_.frozen && still_) {
      const auto time = m.gps_time_ns;
      const auto seq = m.seq;
      m = *still_;
      m.gps_time_ns = time;
      m.seq = seq;
    }
    const hil::Local at = hil::local_from_geodetic(m.latitude_deg, m.longitude_deg, m.height_m);
    const hil::Local off = hil::local_from_ecef(at.ecef + at.R_e_n * (how_.position_m * direction(how_.seed, 1)));
    m.latitude_deg = off.latitude_deg;
    m.longitude_deg = off.longitude_deg;
    m.height_m = off.height_m;
    const Eigen::Quaterniond q = Eigen::Quaterniond(m.q_n_b[0], m.q_n_b[1], m.q_n_b[2], m.q_n_b[3]) * so3_exp(how_.attitude_deg * kDeg * direction(how_.seed, 2));
    const double w[4] = {q.w(), q.x(), q.y(), q.z()};
    std::copy(w, w + 4, m.q_n_b);
    for (int i = 0; i < 3; ++i) {
      if (how_.position_sigma_m > 0) m.position_sigma_m[i] = how_.position_sigma_m;
      if (how_.attitude_sigma_deg > 0) m.attitude_sigma_rad[i] = how_.attitude_sigma_deg * kDeg;
    }
    encode(m, e.data);
  }

  [[nodiscard]] bool occluded(std::int64_t number) const {
    return std::any_of(how_.occlusions.begin(), how_.occlusions.end(), [&](const Occlusion& o) { return number >= o.first && number <= o.last; });
  }

  Result<> frame(record::LogEvent& e) {
    frame_index_t index;
    if (!decode(e, index)) return make_error(ErrorCode::kCorrupt, channel::kFrame, "does not decode");
    if (index.camera_frame_id > how_.last_frame) return Ok{};
    ++frames_;
    last_frame_ns_ = std::max(last_frame_ns_, index.mid_exposure_ns);
    if (!how_.occlusions.empty()) {
      auto moved = pixels(index, Time{e.time_us * 1000});
      if (!moved.ok()) return moved.error();
      index.recorded_at = *moved;
      encode(index, e.data);
    }
    return to_.message(Time{e.time_us * 1000}, channel::kFrame, e.data.data(), e.data.size());
  }

  Result<std::int64_t> pixels(const frame_index_t& index, Time arrival) {
    FlightFrame f;
    if (auto read = from_.frame(index.recorded_at, memory_, f); !read.ok()) return read.error();
    if (occluded(index.camera_frame_id)) {
      const auto bytes = static_cast<std::size_t>(bytes_per_pixel(f.image.format)), row = static_cast<std::size_t>(f.image.stride_bytes);
      const std::vector<std::uint8_t> sky(f.image.data, f.image.data + row * kSkyRows);
      painted_.resize(row * static_cast<std::size_t>(f.image.height));
      const std::size_t n = painted_.size() / bytes, choice = sky.size() / bytes;
      for (std::size_t i = 0; i < n; ++i) {
        const std::size_t j = hil::key(static_cast<std::uint64_t>(index.camera_frame_id), i) % choice;
        std::copy_n(sky.begin() + static_cast<std::ptrdiff_t>(j * bytes), bytes, painted_.begin() + static_cast<std::ptrdiff_t>(i * bytes));
      }
      f.image.data = painted_.data();
    }
    return to_.frame(arrival, f);
  }

  /// False: of a frame that is left out.
  bool truth(record::LogEvent& e) {
    truth_t t;
    if (!decode(e, t) || t.camera_frame_id > how_.last_frame) return false;
    if (!occluded(t.camera_frame_id)) return true;
    for (auto& v : t.visible) v = truth_t::HIDDEN;
    for (auto& r : t.reasons) r = static_cast<std::int16_t>(r | truth_t::OCCLUDED);
    encode(t, e.data);
    return true;
  }

  FlightReader from_;
  FlightWriter to_;
  const Disturbance& how_;
  FlightManifest manifest_;
  std::int64_t service_less_gps_ns_{0}, frames_{0}, last_frame_ns_{0};
  std::optional<tspi_t> still_;
  std::vector<std::uint8_t> memory_, painted_;
};

}  // namespace

Result<> disturb_flight(const std::string& from, const std::string& to, const Disturbance& how) {
  auto reader = FlightReader::open(from);
  if (!reader.ok()) return reader.error();
  if (how.last_frame < reader->manifest().frames && how.occlusions.empty())
    return make_error(ErrorCode::kInvalid, "last frame", std::to_string(how.last_frame) + ", expected an occlusion as well: without one the copy shares all frames");
  auto writer = FlightWriter::create(to, true, how.occlusions.empty() ? reader->path("frames.lcm") : "");
  if (!writer.ok()) return writer.error();
  return Copy(std::move(reader).value(), std::move(writer).value(), how).all();
}

}  // namespace cyclops::tools
