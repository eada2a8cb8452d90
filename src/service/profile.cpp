#include "service/profile.hpp"

#include <filesystem>

namespace cyclops {

Profile::Profile() {
  segment.buffer_px = 20;
  segment.link_px = 41;
  detect.gaussian_sigma_px = 1.5;
  detect.gaussian_size = 9;
  associate.gate = Gate::kMahalanobis;
  associate.max_gate_px = 2.5;
  associate.model_sigma_px = 0.7;
  associate.min_probability = 0.9;
  track.blending = Blending::kNavWins;
  track.motion.window_s = 0.7;
  publish.max_nis = 9.21;
  publish.apart_sigmas = 0.9;
}

Result<Profile> Profile::load(const std::string& path) {
  auto file = ConfigFile::load(path);
  if (!file.ok()) return file.error();
  Profile p;
  p.name = std::filesystem::path(path).filename().string();
  ConfigTable root = file->root();
  const auto take = [&](const char* key, auto& config) -> Result<> {
    ConfigTable table = root.table(key);
    auto read = std::remove_reference_t<decltype(config)>::read(table, config);
    if (!read.ok()) return read.error();
    config = *read;
    return Ok{};
  };
  CYCLOPS_TRY(take("nav", p.nav));
  CYCLOPS_TRY(take("estimate", p.estimate));
  CYCLOPS_TRY(take("flow", p.flow));
  CYCLOPS_TRY(take("segment", p.segment));
  CYCLOPS_TRY(take("detect", p.detect));
  CYCLOPS_TRY(take("align", p.align));
  CYCLOPS_TRY(take("edge", p.edge));
  CYCLOPS_TRY(take("patch", p.patch));
  CYCLOPS_TRY(take("associate", p.associate));
  CYCLOPS_TRY(take("track", p.track));
  CYCLOPS_TRY(take("publish", p.publish));
  CYCLOPS_TRY(file->finish());
  const double gate = p.associate.gate == Gate::kFixed ? p.associate.gate_px : p.associate.max_gate_px;
  CYCLOPS_TRY(check_buffer(p.segment, gate, p.detect.border_px, p.detect.nms_radius_px));
  return p;
}

}  // namespace cyclops
