#include "hil/fault_camera.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace cyclops::hil {
namespace {

void copy_rows(const ImageView& from, std::vector<std::uint8_t>& to) {
  const auto row = static_cast<std::size_t>(from.width) * static_cast<std::size_t>(bytes_per_pixel(from.format));
  to.resize(row * static_cast<std::size_t>(from.height));
  for (int v = 0; v < from.height; ++v) std::memcpy(&to[row * static_cast<std::size_t>(v)], from.row8(v), row);
}

ImageView view_of(const std::vector<std::uint8_t>& bytes, const ImageView& like) {
  return {bytes.data(), like.width, like.height, like.width * bytes_per_pixel(like.format), like.format};
}

/// Counts in proportion to the light, up to the end of the range.
template <class Sample>
void scale(std::vector<std::uint8_t>& bytes, double light, double most) {
  auto* samples = reinterpret_cast<Sample*>(bytes.data());
  for (std::size_t i = 0; i < bytes.size() / sizeof(Sample); ++i)
    samples[i] = static_cast<Sample>(std::lround(std::min(most, static_cast<double>(samples[i]) * light)));
}

}  // namespace

CameraFaults::Doom& CameraFaults::doom_of(const PacketRef& p) {
  for (Doom& d : dooms_)
    if (d.block_id == p.block_id) return d;
  Doom& d = dooms_[next_doom_++ % dooms_.size()];
  d = {p.block_id, UINT32_MAX};
  if (p.again) return d;
  if (player_.strike(FaultKind::kFrameLost) != nullptr) d.keep = 0;
  else if (const Fault* f = player_.strike(FaultKind::kFrameTruncated); f != nullptr)
    d.keep = std::max(1U, static_cast<std::uint32_t>(f->amount * p.count));
  return d;
}

PacketFate CameraFaults::packet(const PacketRef& p) { return p.packet_id >= doom_of(p).keep ? PacketFate::kDrop : fate(p); }

PacketFate CameraFaults::fate(const PacketRef& p) {
  constexpr int kNever = 1;
  const Fault* loss = player_.on(FaultKind::kPacketLoss);
  if (loss != nullptr && p.again && loss->choice == kNever) return PacketFate::kDrop;
  if (loss != nullptr && player_.strike(FaultKind::kPacketLoss) != nullptr) return PacketFate::kDrop;
  if (p.again) return PacketFate::kSend;
  if (player_.strike(FaultKind::kPacketDuplicate) != nullptr) return PacketFate::kTwice;
  if (p.packet_id % 2 == 1 && p.packet_id + 2 < p.count && player_.strike(FaultKind::kPacketReorder) != nullptr) return PacketFate::kSwap;
  return PacketFate::kSend;
}

ImageView CameraFaults::picture(const ImageView& taken, double light) {
  ImageView out = taken;
  if (player_.has(FaultKind::kFrameFrozen)) {
    const bool frozen = !frozen_.empty() && player_.strike(FaultKind::kFrameFrozen) != nullptr;
    if (!frozen) copy_rows(taken, frozen_);
    out = view_of(frozen_, taken);
  }
  if (light == 1) return out;
  copy_rows(out, lit_);
  if (bytes_per_pixel(taken.format) == 1) scale<std::uint8_t>(lit_, light, 255);
  else scale<std::uint16_t>(lit_, light, (1 << bits_per_pixel(taken.format)) - 1);
  return view_of(lit_, taken);
}

Duration CameraFaults::delay() {
  const Fault* f = player_.strike(FaultKind::kPacketDelay);
  return f != nullptr ? Duration::from_ms(f->amount) : Duration{};
}

}  // namespace cyclops::hil
