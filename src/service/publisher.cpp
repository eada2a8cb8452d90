#include "service/publisher.hpp"

namespace cyclops {

Publisher::Publisher(const Rig& rig, MessageSink& sink) : rig_(rig), sink_(sink), buffer_(kMaxMessageBytes) {}

void Publisher::frame(const FrameOutput& out, std::optional<GpsTime> t_mid_gps, std::span<const std::uint8_t> thumbnail, RecordedAt recorded) {
  const FrameInfo& info = out.in.frame;
  const Time t = info.t_mid;
  FrameIndex index;
  index.info = info;
  index.format = rig_.device.format;
  index.width = rig_.camera.intrinsics().width;
  index.height = rig_.camera.intrinsics().height;
  index.thumbnail_jpeg = thumbnail;
  index.recorded_in = recorded.in;
  index.recorded_at = recorded.at;
  fill(box_.frame, index);
  put(t, channel::kFrame, box_.frame);

  const RelativeState& nav = out.in.nav.state;
  fill(box_.nav, info.seq, nav, out.in.nav.absence, out.in.scheduled && nav.valid);
  put(t, channel::kNav, box_.nav);

  const double range = nav.valid ? (nav.T_r_k.translation() - rig_.lens).norm() : -1.0;
  const std::size_t n = out.matches.size() == out.predictions.items.size() ? out.matches.size() : 0;
  for (std::size_t i = 0; i < n; ++i) gates_[i] = static_cast<float>(out.matches[i].gate_px);
  fill(box_.prediction, out.predictions, nav.valid ? &nav : nullptr, range, {gates_.data(), n});
  put(t, channel::kPrediction, box_.prediction);

  const auto& k = rig_.camera.intrinsics();
  fill(box_.subimage, info.seq, t, out.sub_images, static_cast<std::int64_t>(k.width) * k.height);
  put(t, channel::kSubImage, box_.subimage);
  fill(box_.corner, out.corners);
  put(t, channel::kCorner, box_.corner);
  fill(box_.track, info.seq, t, out.tracks);
  put(t, channel::kTrack, box_.track);
  fill(box_.measurement, out.measurements, info.time_source, t_mid_gps);
  put(t, channel::kMeasurement, box_.measurement);
}

}  // namespace cyclops
