#include "tools/learn.hpp"

#include <algorithm>

#include "tools/learn_sift.hpp"

namespace cyclops::tools::learn {
namespace {

constexpr int kLeastInRound = 6;         // sights without which a point does not go on to the next round
constexpr double kHopeless_px = 1.0;     // scatter

/// Mean distance of a point from another place, in some of the point's views, px.
double mean_distance_px(const std::vector<View>& views, const LearntPoint& p, const Point<frame::K>& q) {
  double sum = 0;
  int n = 0;
  for (std::size_t i = 0; i < p.sights.size(); i += 1 + p.sights.size() / 8) {
    const View& view = views[static_cast<std::size_t>(p.sights[i].view)];
    const auto a = view.camera->project(view.T_c_k * p.p_k), b = view.camera->project(view.T_c_k * q);
    sum += a && b ? (*a - *b).norm() : 1e9;
    ++n;
  }
  return n == 0 ? 1e9 : sum / n;
}

/// Each surveyed feature gets the point that is nearest to it in the pictures, if any is near.
void tie_to_survey(const Views& views, double most_px, std::vector<LearntPoint>& points) {
  for (LearntPoint& p : points) p.survey = -1;
  const auto& features = views.tanker.features();
  for (std::size_t f = 0; f < features.size(); ++f) {
    double least = most_px;
    LearntPoint* nearest = nullptr;
    for (LearntPoint& p : points)
      if (const double d = mean_distance_px(views.views, p, views.tanker.in_body(features[f])); d < least && p.survey < 0) {
        least = d;
        nearest = &p;
      }
    if (nearest != nullptr && features[f].enabled) nearest->survey = static_cast<int>(f);
  }
}

void drop_hopeless(std::vector<LearntPoint>& points) {
  std::erase_if(points, [](const LearntPoint& p) { return p.sights.size() < kLeastInRound || p.scatter_px > kHopeless_px; });
}

/// Says what it leaves out.
void leave_out(const LearnConfig& config, const Views& views, std::vector<LearntPoint>& points, const Said& said) {
  const Sifted sifted = sift(config.bundle, config.follow.beyond, views, points);
  if (said && sifted.outside + sifted.undetermined > 0)
    said("left out: " + std::to_string(sifted.outside) + " points that are not on the tanker, " + std::to_string(sifted.undetermined) + " whose corners do not tell where they are");
}

std::string counted(const char* what, std::size_t n) { return std::string(what) + ": " + std::to_string(n) + " points"; }

}  // namespace

Result<std::vector<ChosenPoint>> learn_points(Views& views, const LearnConfig& config, std::size_t& followed, const Said& said) {
  std::vector<LearntPoint> points = follow(views, config.follow);
  followed = points.size();
  if (said) said(counted("followed", followed));
  if (points.empty()) return make_error(ErrorCode::kUnusable, "follow", "found no point in " + std::to_string(views.views.size()) + " views, expected some that are seen often");
  for (const LearnConfig::Round& round : config.rounds) {
    match_all(views.views, round.match_px, points);
    drop_hopeless(points);
    tie_to_survey(views, round.tie_px, points);
    CYCLOPS_TRY(adjust(config.bundle, views, points));
    for (LearntPoint& p : points) rate(views.views, p);
    drop_hopeless(points);
    leave_out(config, views, points, said);
    if (said) said(counted("adjusted", points.size()) + ", " + std::to_string(std::count_if(points.begin(), points.end(), [](const LearntPoint& p) { return p.survey >= 0; })) + " of them tied to the survey");
  }
  BundleConfig last = config.bundle;
  last.covariance = true;
  CYCLOPS_TRY(adjust(last, views, points));
  for (LearntPoint& p : points) rate(views.views, p);
  Refused refused;
  std::vector<ChosenPoint> chosen = choose(config.choose, views.views, points, &refused);
  if (said)
    said("refused: " + std::to_string(refused.few) + " seldom seen, " + std::to_string(refused.scatter) + " scatter, " + std::to_string(refused.drift) + " drift, " +
         std::to_string(refused.weak) + " weak, " + std::to_string(refused.uncertain) + " uncertain, " + std::to_string(refused.near) + " too near to a better one");
  if (chosen.empty()) return make_error(ErrorCode::kUnusable, "choose", "no point of " + std::to_string(followed) + " is found again and again in the same place, expected some");
  for (ChosenPoint& c : chosen) c.point.cov_m2 *= c.point.inflation;
  if (said) said(counted("chosen", chosen.size()));
  return chosen;
}

Result<Learnt> learn(const std::vector<Stretch>& flights, const Profile& profile, const LearnConfig& config, const Said& said) {
  auto views = views_of(flights, profile, config.views, said);
  if (!views.ok()) return views.error();
  Learnt out;
  out.views = std::move(views).value();
  if (said) said(std::to_string(out.views.views.size()) + " views");
  auto points = learn_points(out.views, config, out.followed, said);
  if (!points.ok()) return points.error();
  out.points = std::move(points).value();
  return out;
}

}  // namespace cyclops::tools::learn
