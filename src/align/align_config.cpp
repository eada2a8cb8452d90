#include "align/align_config.hpp"

namespace cyclops {

Result<AlignConfig> AlignConfig::read(ConfigTable& t, AlignConfig c) {
  t.read("enabled", c.enabled);
  t.read_in("corner_sigma_px", 0.05, 20.0, c.corner_sigma_px);
  t.read_in("scatter_gain", 0.0, 1.0, c.scatter_gain);
  t.read_in("scatter_floor_px", 0.01, 20.0, c.scatter_floor_px);
  t.read_in("detection_probability", 0.01, 0.999, c.detection_probability);
  t.read_in("prior_gate", 1.0, 50.0, c.prior_gate);
  t.read_in("candidates", 1, 64, c.candidates);
  t.read_in("features", 3, 64, c.features);
  t.read_in("readings", 1, 64, c.readings);
  t.read_in("min_evidence", 0.0, 1e3, c.min_evidence);
  t.read_in("min_margin", 0.0, 1e3, c.min_margin);
  t.read_in("wide_margin", 0.0, 1e3, c.wide_margin);
  t.read_in("wide_px", 0.0, 1e3, c.wide_px);
  t.read_in("min_inliers", 2, 64, c.min_inliers);
  t.read_in("min_support", 0.0, 1.0, c.min_support);
  t.read_in("inlier_px", 0.1, 50.0, c.inlier_px);
  t.read_in("robust_scale", 0.5, 20.0, c.robust_scale);
  t.read_in("common_share", 0.0, 10.0, c.common_share);
  t.read_in("sure_support", 0.0, 1.0, c.sure_support);
  t.read_in("doubtful_support", 0.0, 1.0, c.doubtful_support);
  t.read_in("common_floor_px", 0.0, 10.0, c.common_floor_px);
  t.read_in("track_floor_px", 0.1, 50.0, c.track_floor_px);
  t.read_in("track_growth_px_s", 0.0, 1e3, c.track_growth_px_s);
  t.read_in("track_bonus", 0.0, 100.0, c.track_bonus);
  t.read_in("nav_memory_s", 0.0, 1e3, c.nav_memory_s);
  t.read_in("acquire_from_px", 5.0, 1e4, c.acquire_from_px);
  t.read_in("acquire_beam", 16, 4096, c.acquire_beam);
  t.read_in("acquire_least", 4, 64, c.acquire_least);
  t.read_in("acquire_support", 0.0, 1.0, c.acquire_support);
  t.read_in("acquire_blind_s", 0.0, 1e3, c.acquire_blind_s);
  t.read_in("acquire_evidence", -100.0, 1e3, c.acquire_evidence);
  t.read_in("acquire_margin", 0.0, 1e3, c.acquire_margin);
  t.read_in("doubt_px", 0.0, 100.0, c.doubt_px);
  t.read_in("doubt_beam", 16, 4096, c.doubt_beam);
  t.read_in("doubt_margin", 0.0, 1e3, c.doubt_margin);
  t.read_in("search_sigmas", 0.0, 10.0, c.search_sigmas);
  t.read_in("search_most_px", 0.0, 1000.0, c.search_most_px);
  t.read_in("forget_after_s", 0.0, 1e4, c.forget_after_s);
  return c;
}

}  // namespace cyclops
