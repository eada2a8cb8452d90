#include "tools/offline.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>

#include <cyclops/measurement_set_t.hpp>

#include "record/flight.hpp"
#include "service/front.hpp"
#include "service/publisher.hpp"

namespace cyclops::tools {
namespace {

class Run {
 public:
  Run(FlightReader flight, const Rig& rig, const Profile& profile, MessageSink& sink, const FrameObserver& observe)
      : flight_(std::move(flight)),
        rig_(rig),
        observe_(observe),
        front_(rig.stamper, rig.gps, profile.nav, rig.nav, rig.pps_marks),
        chain_(rig, profile),
        publisher_(rig, sink),
        out_(std::make_unique<FrameOutput>()) {}

  Result<OfflineResult> all(const std::function<void(double)>& progress, std::int64_t most_frames) {
    // As the service does when the camera starts on the bench; a recorded flight says itself when that was.
    if (flight_.manifest().origin != "recorded") front_.restart(Time{INT64_MIN});
    record::LogEvent event;
    while (result_.frames_out < most_frames) {
      auto more = flight_.next(event);
      if (!more.ok()) return more.error();
      if (!*more) break;
      if (const auto taken = take(event); !taken.ok() && result_.refused_messages++ == 0) result_.first_refusal = taken.error().message();
      CYCLOPS_TRY(drain());
      if (progress && event.channel == channel::kFrame)
        progress(static_cast<double>(result_.frames) / static_cast<double>(std::max<std::int64_t>(1, flight_.manifest().frames)));
    }
    if (result_.frames_out < most_frames) front_.flush();
    CYCLOPS_TRY(drain());
    return result_;
  }

 private:
  Result<> take(const record::LogEvent& e) {
    const Time arrival{e.time_us * 1000};
    if (e.channel == channel::kTspiReceiver || e.channel == channel::kTspiTanker) {
      auto r = decode_tspi(e.data.data(), e.data.size(), e.channel == channel::kTspiReceiver ? Aircraft::kReceiver : Aircraft::kTanker);
      if (!r.ok()) return r.error();
      front_.push(*r, arrival);
    } else if (e.channel == channel::kStrobe) {
      auto r = decode_strobe_edge(e.data.data(), e.data.size());
      if (!r.ok()) return r.error();
      if (r->line == StrobeLine::kStrobe) front_.push(r->edge);
      else front_.push(PpsEdge{r->edge});
    } else if (e.channel == channel::kTimeMark) {
      auto r = decode_time_mark(e.data.data(), e.data.size());
      if (!r.ok()) return r.error();
      front_.push(r->mark);
    } else if (e.channel == channel::kAcquisition) {
      auto r = decode_acquisition(e.data.data(), e.data.size());
      if (!r.ok()) return r.error();
      if (r->what == AcquisitionChange::kStarted) front_.restart(r->t);
      else front_.flush();
    } else if (e.channel == channel::kFrame) {
      auto r = decode_frame_index(e.data.data(), e.data.size());
      if (!r.ok()) return r.error();
      ++result_.frames;
      FrameInfo info = r->info;
      info.seq = static_cast<std::uint64_t>(result_.frames);
      info.t_mid = {};
      info.t_mid_sigma = {};
      info.time_source = TimeSource::kUnknown;
      const bool taken = front_.push(info, static_cast<std::uint64_t>(r->recorded_at));
      CYCLOPS_ASSERT(taken);
    }
    return Ok{};
  }

  Result<> drain() {
    AlignedFrame ready;
    while (front_.pop(ready)) {
      FlightFrame pixels;
      const auto number = static_cast<std::int64_t>(ready.token);
      const bool there = flight_.has_frame(number);
      if (there || flight_.manifest().origin != "recorded") CYCLOPS_TRY(flight_.frame(number, memory_, pixels));
      if (!there && result_.without_pixels++ == 0) result_.first_without_pixels = result_.frames_out + 1;
      const bool seen = there && ready.frame.status != FrameStatus::kMissing;
      const ImageView image = seen ? pixels.image : ImageView{};
      chain_.step(ready, image, ready.frame.status == FrameStatus::kPartial ? &pixels.missing : nullptr, *out_);
      publisher_.frame(*out_, front_.gps_time(ready.frame.t_mid), {});
      if (observe_) observe_(rig_, *out_, image);
      ++result_.frames_out;
      for (std::size_t s = 0; s < kStages; ++s) result_.stage[s].add(out_->stage_time[s]);
      result_.chain.add(out_->chain_time);
    }
    return Ok{};
  }

  FlightReader flight_;
  const Rig& rig_;
  const FrameObserver& observe_;
  Front front_;
  Chain chain_;
  Publisher publisher_;
  std::unique_ptr<FrameOutput> out_;
  std::vector<std::uint8_t> memory_;
  OfflineResult result_;
};

}  // namespace

Result<OfflineResult> run_offline(const std::string& folder, const Profile& profile, const std::string& log,
                                  const std::function<void(double)>& progress, const FrameObserver& observe, const OfflineOptions& options) {
  auto flight = FlightReader::open(folder);
  if (!flight.ok()) return flight.error();
  auto rig = Rig::load(flight->path("rig.toml"), options.tanker, options.looks);
  if (!rig.ok()) return rig.error();
  auto writer = record::EventLogWriter::create(log);
  if (!writer.ok()) return writer.error();
  LogSink sink(std::move(writer).value());
  const FlightManifest manifest = flight->manifest();
  const auto begin = std::chrono::steady_clock::now();
  auto run = std::make_unique<Run>(std::move(flight).value(), *rig, profile, sink, observe);
  auto result = run->all(progress, options.most_frames);
  if (!result.ok()) return result;
  CYCLOPS_TRY(sink.close());
  result->run_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  result->flight_s = static_cast<double>(manifest.last_frame_ns - manifest.first_frame_ns) * 1e-9;
  return result;
}

Result<std::int64_t> measurements_csv(const std::vector<std::string>& logs, const std::string& path) {
  std::int64_t rows = 0;
  std::FILE* f = std::fopen(path.c_str(), "w");
  if (f == nullptr) return make_error(ErrorCode::kIo, path, "cannot be written");
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> closer(f, std::fclose);
  std::fprintf(f, "frame,mid_exposure_ns,mid_exposure_gps_ns,id,accepted,reason,kind,u_px,v_px,ideal_u_px,ideal_v_px,z_x_m,z_y_m,cov_uu_px2,cov_uv_px2,cov_vv_px2,innovation_u_px,innovation_v_px,nis,integrity\n");
  record::LogEvent event;
  measurement_set_t m;
  for (const std::string& log : logs) {
    auto in = record::EventLog::open(log);
    if (!in.ok()) return in.error();
    while (true) {
      auto more = in->next(event);
      if (!more.ok()) return more.error();
      if (!*more) break;
      if (event.channel != channel::kMeasurement || m.decode(event.data.data(), 0, static_cast<int>(event.data.size())) < 0) continue;
      rows += static_cast<std::int64_t>(m.items.size());
      for (const auto& z : m.items)
        std::fprintf(f, "%lld,%lld,%lld,%d,%d,%d,%d,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.6g\n", static_cast<long long>(m.seq),
                     static_cast<long long>(m.mid_exposure_ns), static_cast<long long>(m.mid_exposure_gps_ns), z.id, z.accepted, z.reason, z.kind, z.raw_px[0], z.raw_px[1],
                     z.ideal_px[0], z.ideal_px[1], z.z_m[0], z.z_m[1], z.cov_px2[0], z.cov_px2[1], z.cov_px2[2], z.innovation_px[0], z.innovation_px[1], z.nis,
                     static_cast<double>(m.integrity));
    }
  }
  if (std::ferror(f) != 0 || std::fflush(f) != 0) return make_error(ErrorCode::kIo, path, "cannot be written whole");
  return rows;
}

}  // namespace cyclops::tools
