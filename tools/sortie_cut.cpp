#include <algorithm>
#include <filesystem>
#include <optional>

#include "base/file.hpp"
#include "record/flight.hpp"
#include "service/rig.hpp"
#include "tools/sortie_copy.hpp"
#include "wire/codec.hpp"

namespace cyclops::tools {
namespace fs = std::filesystem;
namespace {

using record::LogEvent;

constexpr Duration kHistory = Duration::from_seconds(2);   // of TSPI, before the first frame
constexpr Duration kAfter = Duration::from_seconds(1);     // of TSPI and edges, after the last
constexpr double kOwnEdge = 0.9;   // periods before the end of exposure: the frame's own edge lies within, the one before does not

class Cut {
 public:
  Cut(FlightReader flight, Rig rig, FlightWriter out) : flight_(std::move(flight)), rig_(std::move(rig)), out_(std::move(out)) {}

  Result<Copied> run(double from_s, double to_s) {
    CYCLOPS_TRY(look(from_s, to_s));
    CYCLOPS_TRY(texts());
    CYCLOPS_TRY(flight_.rewind());
    if (flight_.manifest().origin == "recorded") CYCLOPS_TRY(begin());
    LogEvent e;
    while (true) {
      auto more = flight_.next(e);
      if (!more.ok()) return more.error();
      if (!*more) break;
      CYCLOPS_TRY(take(e));
    }
    FlightManifest m = flight_.manifest();
    m.source = "cut from " + m.name + ", frames " + std::to_string(first_id_) + " to " + std::to_string(last_id_) + " of its camera; " + m.source;
    m.name += "-cut";
    m.frames = count_.frames;
    m.pixels = count_.pixels;
    m.first_frame_ns += (first_arrival_ - flight_arrival_).ns;
    m.last_frame_ns = m.first_frame_ns + (last_arrival_ - first_arrival_).ns;
    CYCLOPS_TRY(out_.finish(m));
    return count_;
  }

 private:
  static Time at(const LogEvent& e) { return {e.time_us * 1000}; }

  /// First and last frame of the window.
  Result<> look(double from_s, double to_s) {
    std::optional<Time> zero;
    LogEvent e;
    while (true) {
      auto more = flight_.next(e);
      if (!more.ok()) return more.error();
      if (!*more) break;
      if (e.channel != channel::kFrame) continue;
      const auto f = decode_frame_index(e.data.data(), e.data.size());
      if (!f.ok()) return f.error();
      if (!zero) {
        zero = at(e);
        flight_arrival_ = f->info.t_arrival;
      }
      const double s = (at(e) - *zero).seconds();
      if (s < from_s || s >= to_s || f->info.camera_frame_id == 0) continue;
      if (first_id_ == 0) {
        first_id_ = f->info.camera_frame_id;
        first_ = at(e);
        first_arrival_ = f->info.t_arrival;
        edges_from_ = first_arrival_ - f->info.exposure - Duration::from_seconds(kOwnEdge * rig_.device.period().seconds());
      }
      last_id_ = f->info.camera_frame_id;
      last_ = at(e);
      last_arrival_ = f->info.t_arrival;
    }
    if (first_id_ == 0) return make_error(ErrorCode::kNotFound, flight_.path("messages.lcm"), "has no frame from " + std::to_string(from_s) + " to " + std::to_string(to_s) + " s");
    id_base_ = first_id_ - 1;
    return Ok{};
  }

  Result<> texts() {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(flight_.path(""), error)) {
      const std::string name = entry.path().filename().string(), end = entry.path().extension().string();
      if (name == "manifest.toml" || name == "sortie.toml" || (end != ".toml" && end != ".csv" && end != ".bin")) continue;
      auto text = read_file(entry.path().string());
      if (!text.ok()) return text.error();
      CYCLOPS_TRY(out_.text(name, *text));
    }
    if (error) return make_error(ErrorCode::kIo, flight_.path(""), error.message());
    return Ok{};
  }

  template <class Message>
  Result<> put(Time t, const char* channel, const Message& message) {
    bytes_.resize(static_cast<std::size_t>(message.getEncodedSize()));
    CYCLOPS_ASSERT(static_cast<bool>(encode_into(message, bytes_)));
    ++count_.inputs;
    return out_.message(t, channel, bytes_.data(), bytes_.size());
  }

  Result<> same(const LogEvent& e) {
    ++count_.inputs;
    return out_.message(at(e), e.channel.c_str(), e.data.data(), e.data.size());
  }

  Result<> begin() {
    acquisition_t start;
    fill(start, Acquisition{AcquisitionChange::kStarted, edges_from_});
    return put(first_ - kHistory, channel::kAcquisition, start);
  }

  Result<> take(const LogEvent& e) {
    const Time t = at(e);
    const bool tail = t > last_ + kAfter;
    if (e.channel == channel::kTimeMark && t < first_ - kHistory) {
      mark_ = e;
      return Ok{};
    }
    if (t < first_ - kHistory || tail) return Ok{};
    if (mark_) {
      const LogEvent mark = std::move(*mark_);
      mark_.reset();
      CYCLOPS_TRY(same(mark));
    }
    if (e.channel == channel::kFrame) return frame(e);
    if (e.channel == channel::kStrobe) {
      const auto edge = decode_strobe_edge(e.data.data(), e.data.size());
      return edge.ok() && edge->edge.t >= edges_from_ ? same(e) : Result<>(Ok{});
    }
    if (e.channel == channel::kTruth) return truth(e);
    if (e.channel == channel::kAcquisition) return t > first_ ? acquisition(e) : Result<>(Ok{});
    return same(e);
  }

  Result<> acquisition(const LogEvent& e) {
    const auto a = decode_acquisition(e.data.data(), e.data.size());
    if (!a.ok()) return a.error();
    if (a->what == AcquisitionChange::kStarted) id_base_ = 0;
    return same(e);
  }

  [[nodiscard]] bool wanted(std::uint64_t id) const { return id_base_ == 0 ? id <= last_id_ : id >= first_id_ && (id <= last_id_ || last_id_ < first_id_); }

  Result<> frame(const LogEvent& e) {
    auto f = decode_frame_index(e.data.data(), e.data.size());
    if (!f.ok()) return f.error();
    if (at(e) < first_ || at(e) > last_) return Ok{};
    FrameIndex index = *f;
    if (index.info.camera_frame_id != 0) {
      if (index.info.camera_frame_id <= id_base_) return Ok{};  // late, of before the window
      index.info.camera_frame_id -= id_base_;
    }
    const std::int64_t from = index.recorded_at;
    index.recorded_at = -1;
    index.recorded_in = {};
    if (flight_.has_frame(from)) {
      FlightFrame pixels;
      CYCLOPS_TRY(flight_.frame(from, memory_, pixels));
      pixels.camera_frame_id = index.info.camera_frame_id;
      auto number = out_.frame(at(e), pixels);
      if (!number.ok()) return number.error();
      index.recorded_in = "frames.lcm";
      index.recorded_at = *number;
      ++count_.pixels;
    }
    ++count_.frames;
    fill(frame_, index);
    return put(at(e), channel::kFrame, frame_);
  }

  Result<> truth(const LogEvent& e) {
    CYCLOPS_TRY(decode_truth(e.data.data(), e.data.size(), truth_));
    if (!wanted(truth_.camera_frame_id)) return Ok{};
    truth_.camera_frame_id -= id_base_;
    truth_t m;
    fill(m, truth_);
    return put(at(e), channel::kTruth, m);
  }

  FlightReader flight_;
  Rig rig_;
  FlightWriter out_;
  Copied count_;
  std::uint64_t first_id_{0}, last_id_{0}, id_base_{0};
  Time first_{}, last_{}, first_arrival_{}, last_arrival_{}, flight_arrival_{}, edges_from_{};
  std::optional<LogEvent> mark_;
  std::vector<std::uint8_t> bytes_, memory_;
  frame_index_t frame_{};
  Truth truth_{};
};

}  // namespace

Result<Copied> cut_flight(const std::string& folder, const std::string& out, double from_s, double to_s) {
  auto flight = FlightReader::open(folder);
  if (!flight.ok()) return flight.error();
  auto rig = Rig::load(flight->path("rig.toml"));
  if (!rig.ok()) return rig.error();
  auto writer = FlightWriter::create(out, false);
  if (!writer.ok()) return writer.error();
  return std::make_unique<Cut>(std::move(flight).value(), std::move(rig).value(), std::move(writer).value())->run(from_s, to_s);
}

}  // namespace cyclops::tools
