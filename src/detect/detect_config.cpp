#include "detect/detect_config.hpp"

namespace cyclops {

DetectConfig DetectConfig::thesis() {
  DetectConfig c;
  c.mode = DetectMode::kThesis;
  c.mean_over = MeanOver::kBox;
  c.floor_noise = 0;
  c.subpixel_window_px = 0;
  c.saturation_counts = 0;
  c.near_px = 0;
  return c;
}

Result<DetectConfig> DetectConfig::read(ConfigTable& table, DetectConfig absent) {
  DetectMode mode = absent.mode;
  table.read_enum("mode", {"refined", "thesis"}, mode);
  DetectConfig c = mode == absent.mode ? absent : mode == DetectMode::kThesis ? thesis() : DetectConfig{};
  table.read_in("gaussian_sigma_px", 0.3, 5.0, c.gaussian_sigma_px);
  table.read_in("gaussian_size", 3, 13, c.gaussian_size);
  if (c.gaussian_size % 2 == 0) table.fail("gaussian_size", "is " + std::to_string(c.gaussian_size) + ", expected an odd number");
  table.read_in("nms_radius_px", 1, 7, c.nms_radius_px);
  table.read_in("border_px", 0, 64, c.border_px);
  table.read_in("noble_eps", 1e-30, 1.0, c.noble_eps);
  table.read_in("threshold_factor", 0.0, 1e6, c.threshold_factor);
  table.read_enum("mean_over", {"interior", "box", "cleared-box"}, c.mean_over);
  table.read_in("floor_counts2", 0.0, 1e12, c.floor_counts2);
  table.read_in("floor_noise", 0.0, 1e6, c.floor_noise);
  table.read_enum("equalise", {"off", "box"}, c.equalise);
  table.read_enum("noise", {"estimate", "model"}, c.noise);
  table.read_in("read_noise_counts", 0.0, 65535.0, c.read_noise_counts);
  table.read_in("counts_per_electron", 0.0, 65535.0, c.counts_per_electron);
  table.read_in("subpixel_window_px", 0, 6, c.subpixel_window_px);
  if (c.subpixel_window_px == 1) table.fail("subpixel_window_px", "is 1, expected 0 or 2 to 6");
  table.read_in("subpixel_iterations", 1, 100, c.subpixel_iterations);
  table.read_in("subpixel_max_shift_px", 0.1, 7.0, c.subpixel_max_shift_px);
  table.read_in("subpixel_sigma_px", 0.0, 10.0, c.subpixel_sigma_px);
  table.read_in("pixel_sigma_px", 0.0, 10.0, c.pixel_sigma_px);
  table.read_in("saturation_counts", -1, 65535, c.saturation_counts);
  table.read_in("saturation_sigma_px", -1.0, 10.0, c.saturation_sigma_px);
  table.read_in("near_px", 0.0, 5.0, c.near_px);
  table.read_in("near_sigma_px", 0.01, 10.0, c.near_sigma_px);
  table.read_in("max_corners", 1, static_cast<int>(kMaxCorners), c.max_corners);
  table.read_in("max_corners_per_box", 1, static_cast<int>(kMaxCorners), c.max_corners_per_box);
  return c;
}

}  // namespace cyclops
