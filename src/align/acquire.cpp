#include "align/acquire.hpp"

#include <algorithm>
#include <cmath>

namespace cyclops::align {
namespace {

constexpr double kGate = 11.8;            // squared Mahalanobis, 2 dof, 99.7 %: what is not linear needs some room
constexpr double kCell_px = 32;
constexpr double kCrowd_px = 50;          // radius in which corners around a corner are counted
constexpr double kSame_px = 5;            // closer poses are one
constexpr double kPlace_px = 3;           // readings that put three features so near each other are one
constexpr double kSure_px = 4;            // a feature known to this finds its corner or has none: no second thoughts
constexpr double kSureEvidence = 2;
constexpr std::size_t kWide = 12;         // features after which half the beam is enough
constexpr double kTwoPi = 6.28318530717958648;
constexpr std::uint32_t kStride = 5;      // from one frame's first feature to the next one's

}  // namespace

Acquirer::Acquirer(const AlignConfig& config, const Camera& camera, const std::vector<Point<frame::K>>& body)
    : config_(config), camera_(camera), body_(body) {
  columns_ = camera.intrinsics().width / static_cast<int>(kCell_px) + 1;
  rows_ = camera.intrinsics().height / static_cast<int>(kCell_px) + 1;
  cell_begin_.resize(static_cast<std::size_t>(columns_ * rows_) + 1);
  corners_.reserve(kMostCorners);
  strongest_.reserve(kMaxCorners);
  order_.reserve(static_cast<std::size_t>(config.features));
  const auto beam = static_cast<std::size_t>(std::max(config.acquire_beam, config.doubt_beam));
  nodes_.resize(std::max(beam, kMostCorners));
  next_.resize(nodes_.size());
  nodes_.clear();
  next_.clear();
  children_.reserve(nodes_.capacity() * 32);
  places_.reserve(nodes_.capacity());
}

/// The strongest ones, sorted by cell.
void Acquirer::take_corners(const CornerSet& corners) {
  strongest_.clear();
  for (std::size_t i = 0; i < corners.items.size(); ++i)
    if (camera_.inside(corners.items[i].uv_px)) strongest_.emplace_back(-corners.items[i].measure, static_cast<std::uint32_t>(i));
  const std::size_t n = std::min(strongest_.size(), kMostCorners);
  std::partial_sort(strongest_.begin(), strongest_.begin() + static_cast<std::ptrdiff_t>(n), strongest_.end());
  strongest_.resize(n);
  const auto cell = [&](const Vec2& uv) {
    return static_cast<std::size_t>(static_cast<int>((uv.y() + 0.5) / kCell_px) * columns_ + static_cast<int>((uv.x() + 0.5) / kCell_px));
  };
  std::sort(strongest_.begin(), strongest_.end(), [&](const auto& a, const auto& b) {
    return std::pair(cell(corners.items[a.second].uv_px), a.second) < std::pair(cell(corners.items[b.second].uv_px), b.second);
  });
  corners_.clear();
  std::fill(cell_begin_.begin(), cell_begin_.end(), 0U);
  for (const auto& s : strongest_) {
    corners_.push_back(corners.items[s.second].uv_px);
    ++cell_begin_[cell(corners_.back()) + 1];
  }
  for (std::size_t i = 1; i < cell_begin_.size(); ++i) cell_begin_[i] += cell_begin_[i - 1];
}

template <class Visit>
void Acquirer::for_corners_near(const Vec2& uv, const Vec2& reach, Visit&& visit) const {
  const auto index = [](double v, int most) { return std::clamp(static_cast<int>(std::floor((v + 0.5) / kCell_px)), 0, most - 1); };
  const int u0 = index(uv.x() - reach.x(), columns_), u1 = index(uv.x() + reach.x(), columns_);
  const int v0 = index(uv.y() - reach.y(), rows_), v1 = index(uv.y() + reach.y(), rows_);
  for (int v = v0; v <= v1; ++v) {
    const auto row = static_cast<std::size_t>(v * columns_);
    for (std::uint32_t i = cell_begin_[row + static_cast<std::size_t>(u0)]; i < cell_begin_[row + static_cast<std::size_t>(u1) + 1]; ++i) visit(i);
  }
}

std::optional<Acquirer::Innovation> Acquirer::innovation(const Node& node, std::uint16_t feature) const {
  const auto at = projected(camera_, node.T, body_[feature]);
  if (!at || !camera_.inside(at->uv)) return std::nullopt;
  return Innovation{at->by_pose * node.P * at->by_pose.transpose() + variance_px2_[feature] * Mat2::Identity(), at->uv};
}

/// From the feature whose turn it is to the one that is then known best, and so on.
void Acquirer::order_features(const Prior& prior, const PredictionSet& predicted) {
  order_.clear();
  for (const Prediction& p : predicted.items)
    if ((p.visibility == Visibility::kVisible || p.visibility == Visibility::kOutsideImage) && order_.size() < order_.capacity()) order_.push_back(p.feature);
  if (order_.empty()) return;
  Node known;
  known.T = prior.T;
  known.P = prior.P;
  std::swap(order_[0], order_[(turn_++ * kStride) % order_.size()]);
  for (std::size_t i = 0; i < order_.size(); ++i) {
    if (i > 0) {
      double least = 0;
      std::size_t best = i;
      for (std::size_t j = i; j < order_.size(); ++j) {
        const auto at = projected(camera_, known.T, body_[order_[j]]);
        const double size = at ? (at->by_pose * known.P * at->by_pose.transpose()).trace() : 1e12;
        if (j == i || size < least) {
          least = size;
          best = j;
        }
      }
      std::swap(order_[i], order_[best]);
    }
    if (const auto at = projected(camera_, known.T, body_[order_[i]]); at && !bind(known, order_[i], at->uv)) return;
  }
}

/// Iterated extended Kalman update.
bool Acquirer::bind(Node& node, std::uint16_t feature, const Vec2& corner) const {
  Vec6 d = Vec6::Zero();
  Eigen::Matrix<double, 6, 2> K, PJt;
  for (int step = 0; step < 2; ++step) {
    const auto at = projected(camera_, moved(node.T, d), body_[feature]);
    if (!at) return false;
    PJt = node.P * at->by_pose.transpose();
    K = PJt * (at->by_pose * PJt + variance_px2_[feature] * Mat2::Identity()).inverse();
    d = K * (corner - at->uv + at->by_pose * d);
  }
  node.T = moved(node.T, d);
  node.P -= K * PJt.transpose();
  node.P = 0.5 * (node.P + node.P.transpose().eval());
  return true;
}

void Acquirer::branch(std::uint32_t parent, std::uint16_t feature) {
  const Node& node = nodes_[parent];
  const auto expected = innovation(node, feature);
  if (!expected) {
    children_.push_back({node.evidence, parent, -1});
    return;
  }
  const Mat2& S = expected->S;
  const double det = S.determinant();
  const double ceiling = std::log(config_.detection_probability) - std::log(kTwoPi) - 0.5 * std::log(det) - log_clutter_;
  const Mat2 W = S.inverse();
  const Vec2 reach(std::sqrt(kGate * S(0, 0)), std::sqrt(kGate * S(1, 1)));
  double most = 0;
  for_corners_near(expected->uv, reach, [&](std::uint32_t i) {
    if (node.used[i]) return;
    const Vec2 r = corners_[i] - expected->uv;
    const double m = r.dot(W * r);
    if (m > kGate) return;
    const double evidence = ceiling - 0.5 * m;
    most = std::max(most, evidence);
    if (children_.size() + 1 < children_.capacity()) children_.push_back({node.evidence + evidence, parent, static_cast<std::int32_t>(i)});
  });
  const bool sure = S.trace() < 2 * kSure_px * kSure_px && most > kSureEvidence;
  if (!sure && children_.size() < children_.capacity()) children_.push_back({node.evidence + std::log(1 - config_.detection_probability), parent, -1});
}

void Acquirer::keep_best(std::uint16_t feature, std::size_t beam) {
  const std::size_t n = std::min({beam, children_.size(), nodes_.capacity()});
  const auto better = [](const Child& a, const Child& b) {
    return a.evidence != b.evidence ? a.evidence > b.evidence : std::pair(a.parent, a.corner) < std::pair(b.parent, b.corner);
  };
  const std::size_t looked = std::min(4 * n, children_.size());
  std::partial_sort(children_.begin(), children_.begin() + static_cast<std::ptrdiff_t>(looked), children_.end(), better);
  next_.clear();
  places_.clear();
  for (std::size_t i = 0; i < looked && next_.size() < n; ++i) {
    const Child& c = children_[i];
    Node node = nodes_[c.parent];
    node.evidence = c.evidence;
    if (c.corner >= 0) {
      if (!bind(node, feature, corners_[static_cast<std::size_t>(c.corner)])) continue;
      node.used.set(static_cast<std::size_t>(c.corner));
      ++node.found;
    }
    const std::uint64_t place = where(node);
    if (std::find(places_.begin(), places_.end(), place) != places_.end()) continue;
    places_.push_back(place);
    next_.push_back(node);
  }
  std::swap(nodes_, next_);
}

/// Equal for readings that put the tanker at the same place: the nearer, the more likely.
std::uint64_t Acquirer::where(const Node& node) const {
  std::uint64_t key = 0;
  for (const std::uint16_t feature : {order_.front(), order_[order_.size() / 2], order_.back()}) {
    const auto uv = camera_.project(node.T * body_[feature]);
    const Vec2 at = uv ? *uv : Vec2(-1e3, -1e3);
    for (const double v : {at.x(), at.y()}) key = key << 10 | (static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(std::clamp(v, -1e4, 1e4) / kPlace_px))) & 1023U);
  }
  return key;
}

double Acquirer::separation_px(const Node& a, const Node& b) const {
  double sum = 0;
  int n = 0;
  for (const std::uint16_t feature : order_) {
    const auto ua = camera_.project(a.T * body_[feature]), ub = camera_.project(b.T * body_[feature]);
    if (!ua || !ub) continue;
    sum += (*ua - *ub).norm();
    ++n;
  }
  return n == 0 ? 0 : sum / n;
}

std::optional<Acquired> Acquirer::best() const {
  if (nodes_.empty()) return std::nullopt;
  const Node& first = nodes_.front();
  Acquired out;
  out.pose = {first.T, first.P, first.T.translation().xyz.allFinite() && first.P.allFinite()};
  out.evidence = first.evidence;
  out.found = first.found;
  for (const std::uint16_t feature : order_) {
    const auto uv = camera_.project(first.T * body_[feature]);
    out.in_view += uv && camera_.inside(*uv) ? 1 : 0;
  }
  double second = std::min(0.0, nodes_.back().evidence);
  for (const Node& n : nodes_)
    if (separation_px(first, n) > kSame_px) {
      second = std::max(second, n.evidence);
      break;
    }
  out.margin = first.evidence - second;
  return out;
}

std::optional<Acquired> Acquirer::search(const Prior& prior, const PredictionSet& predicted, const CornerSet& corners,
                                         const std::vector<double>& variance_px2, int width) {
  variance_px2_ = variance_px2.data();
  take_corners(corners);
  order_features(prior, predicted);
  if (order_.empty() || corners_.empty()) return std::nullopt;
  // Corners crowd on the tanker: a density over the whole image would make every corner there a feature.
  double crowd = 0;
  for (const Vec2& c : corners_) for_corners_near(c, Vec2(kCrowd_px, kCrowd_px), [&](std::uint32_t i) { crowd += (corners_[i] - c).squaredNorm() < kCrowd_px * kCrowd_px; });
  log_clutter_ = std::log(crowd / (static_cast<double>(corners_.size()) * 0.5 * kTwoPi * kCrowd_px * kCrowd_px));
  nodes_.clear();
  nodes_.push_back({});
  nodes_.front().T = prior.T;
  nodes_.front().P = prior.P;
  const auto beam = static_cast<std::size_t>(width);
  for (std::size_t depth = 0; depth < order_.size(); ++depth) {
    children_.clear();
    for (std::uint32_t n = 0; n < nodes_.size(); ++n) branch(n, order_[depth]);
    keep_best(order_[depth], depth == 0 ? kMostCorners : depth < kWide ? beam : std::max<std::size_t>(1, beam / 2));
    if (nodes_.empty()) return std::nullopt;
  }
  return best();
}

}  // namespace cyclops::align
