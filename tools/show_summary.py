#!/usr/bin/python3
"""show_summary.py SUMMARY.json: the figures of a run for a terminal."""
import json
import sys

with open(sys.argv[1]) as file:
    s = json.load(file)
e, lat, chain = s["feature_error_px"], s["latency_ms"], s["stage_us"]["chain"]
lost = {k: v for k, v in s["frames_lost_by_cause"].items() if v}
print(f"""
  flight {s['flight']}, profile {s['profile']}, version {s['version']}
  frames      {s['frames_received']} received of {s['frames_served']} served, lost {sum(s['frames_lost_by_cause'].values())} {lost or ''}, x{s['realtime_factor']:.2f} real time
  navigation  {s['nav_updates']} updates, prediction error mean {s['projection_error_px']['mean']:.2f} px
  features    {s['features_visible_mean']:.1f} visible, {s['features_matched_mean']:.1f} measured a frame, P_D {s['detection_probability']:.2f}
  error       mean {e['mean']:.2f}  median {e['median']:.2f}  p95 {e['p95']:.2f} px; {100 * s['share_within_3px']:.0f} % of visible within 3 px
  wrong       {100 * s['misassociated_share']:.2f} % misassociated, {100 * s['wrong_by_5px_share']:.2f} % off by more than 5 px; 95 % ellipse holds {100 * s['covariance_95_share']:.0f} %
  chain       p50 {chain['p50']:.0f}  p99 {chain['p99']:.0f}  max {chain['max']:.0f} us a frame
  latency     p50 {lat['p50']:.1f}  p99 {lat['p99']:.1f}  max {lat['max']:.1f} ms, last packet to published""")
