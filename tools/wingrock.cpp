#include "tools/wingrock.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

namespace cyclops::tools {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kDeg = 3.14159265358979323846 / 180;
constexpr double kKnots_s = 10;
constexpr double kStep_s = 0.02;            // of the search, and of numerical derivatives
constexpr std::size_t kMostSearched = 800;  // frames in the search
constexpr double kKernel_s = 1.5;           // of the frames' own products
constexpr double kMemory_s = 6;             // of the flight's autocovariance
constexpr double kHuber = 2.5;              // sigmas
constexpr double kAmbiguous = 1.5;
constexpr double kElsewhere_s = 0.5;        // another place, not the flank of the same
constexpr double kDriftSpan_s = 4;          // between the middles of first and last manoeuvre
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

double median(std::vector<double> v) {
  if (v.empty()) return 0;
  std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

class Solver {
 public:
  Solver(const RollSeries& seen, const RollAt& tspi, const WingRockConfig& config) : seen_(seen), tspi_(tspi), config_(config) {}

  WingRockResult run() {
    out_.fitted_rad.assign(n(), kNaN);
    if (n() < 30) return refuse("fewer than 30 frames show enough features");
    out_.t_mid_s = 0.5 * (seen_.t_s.front() + seen_.t_s.back());
    if (!search()) return out_;
    find_manoeuvres();
    if (out_.manoeuvres.empty()) return refuse("not enough roll motion: nowhere does TSPI roll by " + std::to_string(static_cast<int>(config_.least_roll_deg)) + " deg at " + std::to_string(static_cast<int>(config_.manoeuvre_dps)) + " deg/s or more");
    const double apart = middle(out_.manoeuvres.back()) - middle(out_.manoeuvres.front());
    out_.has_drift = apart >= kDriftSpan_s;
    if (!fit()) return refuse("the fit does not settle");
    judge();
    return out_;
  }

 private:
  [[nodiscard]] std::size_t n() const { return seen_.t_s.size(); }
  static double middle(const Manoeuvre& m) { return 0.5 * (m.begin_s + m.end_s); }
  WingRockResult& refuse(const std::string& why) {
    out_.enough = false;
    out_.reason = why;
    return out_;
  }

  /// Frames that say most: those that roll, filled up evenly.
  [[nodiscard]] std::vector<std::size_t> searched() const {
    std::vector<std::size_t> lively, all;
    for (std::size_t i = 0; i < n(); ++i) {
      all.push_back(i);
      if (i == 0 || i + 1 >= n()) continue;
      const double dt = seen_.t_s[i + 1] - seen_.t_s[i - 1];
      if (dt > 0 && dt < 1 && std::fabs(seen_.roll_rad[i + 1] - seen_.roll_rad[i - 1]) / dt > 0.5 * config_.manoeuvre_dps * kDeg) lively.push_back(i);
    }
    const auto thin = [](std::vector<std::size_t>& v, std::size_t most) {
      const std::size_t stride = std::max<std::size_t>(1, (v.size() + most - 1) / most);
      for (std::size_t i = 0; i * stride < v.size(); ++i) v[i] = v[i * stride];
      v.resize((v.size() + stride - 1) / stride);
    };
    thin(lively, kMostSearched / 2);
    thin(all, kMostSearched / 2);
    lively.insert(lively.end(), all.begin(), all.end());
    std::sort(lively.begin(), lively.end());
    lively.erase(std::unique(lively.begin(), lively.end()), lively.end());
    return lively;
  }

  /// Share of the measured variance that TSPI at this offset leaves; 1 when it explains nothing.
  [[nodiscard]] double unexplained(const std::vector<std::size_t>& frames, double offset) const {
    double sp = 0, sm = 0, spp = 0, spm = 0, smm = 0, k = 0;
    for (const std::size_t i : frames) {
      const double p = tspi_(i, seen_.t_s[i] + offset), m = seen_.roll_rad[i];
      if (std::isnan(p)) continue;
      k += 1, sp += p, sm += m, spp += p * p, spm += p * m, smm += m * m;
    }
    if (k < 0.6 * static_cast<double>(frames.size()) || k < 20) return kNaN;
    const double vp = spp - sp * sp / k, vm = smm - sm * sm / k, c = spm - sp * sm / k;
    return c > 0 && vp > 0 && vm > 0 ? 1 - c * c / (vp * vm) : 1;
  }

  bool search() {
    const auto frames = searched();
    std::vector<double> left;
    const int steps = static_cast<int>(config_.search_s / kStep_s);
    for (int s = -steps; s <= steps; ++s) left.push_back(unexplained(frames, s * kStep_s));
    double best = kNaN, second = kNaN;
    int at = 0;
    for (int s = 0; s <= 2 * steps; ++s)
      if (const double v = left[static_cast<std::size_t>(s)]; !std::isnan(v) && !(v >= best)) best = v, at = s;
    if (std::isnan(best)) return refuse("TSPI does not cover the frames"), false;
    for (int s = 1; s < 2 * steps; ++s) {
      const auto i = static_cast<std::size_t>(s);
      if (std::abs(s - at) * kStep_s > kElsewhere_s && left[i] <= left[i - 1] && left[i] <= left[i + 1] && !(left[i] >= second)) second = left[i];
    }
    out_.offset_s = (at - steps) * kStep_s;
    out_.runner_up = std::isnan(second) ? 1 / std::max(best, 1e-12) : second / std::max(best, 1e-12);
    return true;
  }

  [[nodiscard]] double shifted(std::size_t i, double offset, double drift) const { return tspi_(i, seen_.t_s[i] + offset + drift * (seen_.t_s[i] - out_.t_mid_s)); }

  void find_manoeuvres() {
    constexpr double kMerge_s = 1.0, kPad_s = 0.4;
    std::vector<Manoeuvre> found;
    for (std::size_t i = 0; i < n(); ++i) {
      const double t = seen_.t_s[i], h = 0.05;
      const double rate = (tspi_(i, t + out_.offset_s + h) - tspi_(i, t + out_.offset_s - h)) / (2 * h);
      if (!(std::fabs(rate) > config_.manoeuvre_dps * kDeg)) continue;
      if (found.empty() || t - found.back().end_s > kMerge_s) found.push_back({t, t, 0, 0, 0});
      found.back().end_s = t;
    }
    for (Manoeuvre& m : found) {
      double low = 1e9, high = -1e9;
      for (std::size_t i = 0; i < n(); ++i)
        if (seen_.t_s[i] >= m.begin_s && seen_.t_s[i] <= m.end_s)
          if (const double p = shifted(i, out_.offset_s, 0); !std::isnan(p)) low = std::min(low, p), high = std::max(high, p);
      m.roll_deg = (high - low) / kDeg;
      m.begin_s -= kPad_s;
      m.end_s += kPad_s;
      if (m.roll_deg >= config_.least_roll_deg) out_.manoeuvres.push_back(m);
    }
  }

  /// Columns: offset, drift (when there is one), gain, knots of the slow line.
  [[nodiscard]] std::size_t first_knot() const { return out_.has_drift ? 3 : 2; }

  void add_knots(MatrixXd& j, Eigen::Index row, double t) const {
    const double x = (t - seen_.t_s.front()) / knot_step_;
    const auto k = static_cast<Eigen::Index>(std::min(x, static_cast<double>(knots_ - 2)));
    const auto first = static_cast<Eigen::Index>(first_knot());
    j(row, first + k) = 1 - (x - static_cast<double>(k));
    j(row, first + k + 1) = x - static_cast<double>(k);
  }

  bool fit() {
    const double span = seen_.t_s.back() - seen_.t_s.front();
    knots_ = std::max(2, static_cast<int>(std::ceil(span / kKnots_s)) + 1);
    knot_step_ = span / (knots_ - 1);
    const auto columns = static_cast<Eigen::Index>(first_knot()) + knots_;
    p_ = VectorXd::Zero(columns);
    p_[0] = out_.offset_s;
    p_[columns - knots_ - 1] = 1;
    for (int round = 0; round < 15; ++round) {
      linearise(columns);
      const VectorXd step = (j_.transpose() * w_.asDiagonal() * j_ + 1e-12 * MatrixXd::Identity(columns, columns)).ldlt().solve(j_.transpose() * w_.asDiagonal() * e_);
      if (!step.allFinite()) return false;
      p_ += step;
      if (std::fabs(p_[0] - out_.offset_s) > 1.0) return false;
      if (round > 3 && std::fabs(step[0]) < 1e-7) break;
    }
    linearise(columns);
    return rows_.size() > 30;
  }

  void linearise(Eigen::Index columns) {
    const double offset = p_[0], drift = out_.has_drift ? p_[1] : 0, gain = p_[static_cast<Eigen::Index>(first_knot()) - 1];
    rows_.clear();
    j_ = MatrixXd::Zero(static_cast<Eigen::Index>(n()), columns);
    e_ = VectorXd::Zero(static_cast<Eigen::Index>(n()));
    for (std::size_t i = 0; i < n(); ++i) {
      const double t = seen_.t_s[i], here = shifted(i, offset, drift), next = shifted(i, offset + kStep_s, drift), before = shifted(i, offset - kStep_s, drift);
      if (std::isnan(here) || std::isnan(next) || std::isnan(before)) continue;
      const auto r = static_cast<Eigen::Index>(rows_.size());
      const double slope = gain * (next - before) / (2 * kStep_s);
      j_(r, 0) = slope;
      if (out_.has_drift) j_(r, 1) = slope * (t - out_.t_mid_s);
      j_(r, static_cast<Eigen::Index>(first_knot()) - 1) = here;
      add_knots(j_, r, t);
      double line = 0;
      for (Eigen::Index c = static_cast<Eigen::Index>(first_knot()); c < columns; ++c) line += j_(r, c) * p_[c];
      e_[r] = seen_.roll_rad[i] - gain * here - line;
      rows_.push_back(i);
    }
    const auto rows = static_cast<Eigen::Index>(rows_.size());
    j_.conservativeResize(rows, columns);
    e_.conservativeResize(rows);
    std::vector<double> sizes(rows_.size());
    for (Eigen::Index r = 0; r < rows; ++r) sizes[static_cast<std::size_t>(r)] = std::fabs(e_[r]);
    const double limit = kHuber * std::max(1e-9, 1.4826 * median(sizes));
    w_ = e_.unaryExpr([&](double e) { return std::fabs(e) <= limit ? 1.0 : limit / std::fabs(e); });
  }

  /// Newey-West covariance of the estimate with influence rows `g` (one a frame), in frames' own time.
  [[nodiscard]] MatrixXd sandwich(const MatrixXd& g) const {
    MatrixXd s = g.transpose() * g;
    for (Eigen::Index r = 0; r < g.rows(); ++r)
      for (Eigen::Index q = r + 1; q < g.rows(); ++q) {
        const double apart = seen_.t_s[rows_[static_cast<std::size_t>(q)]] - seen_.t_s[rows_[static_cast<std::size_t>(r)]];
        if (apart >= kKernel_s) break;
        const MatrixXd c = g.row(r).transpose() * g.row(q) * (1 - apart / kKernel_s);
        s += c + c.transpose();
      }
    return s;
  }

  /// Variances if the residuals were of one process all the time, with the autocovariance of the whole flight.
  [[nodiscard]] VectorXd stationary(const MatrixXd& influence) const {
    const auto time = [&](Eigen::Index r) { return seen_.t_s[rows_[static_cast<std::size_t>(r)]]; };
    const Eigen::Index n = influence.rows();
    const double span = time(n - 1) - time(0), step = span / static_cast<double>(n - 1), memory = std::min(kMemory_s, span / 4);
    const auto lags = static_cast<std::size_t>(memory / step) + 1;
    std::vector<double> sum(lags, 0), pairs(lags, 0);
    const auto each_pair = [&](auto&& use) {
      for (Eigen::Index r = 0; r < n; ++r)
        for (Eigen::Index q = r; q < n; ++q) {
          const auto lag = static_cast<std::size_t>((time(q) - time(r)) / step + 0.5);
          if (lag >= lags) break;
          use(r, q, lag);
        }
    };
    each_pair([&](Eigen::Index r, Eigen::Index q, std::size_t lag) { sum[lag] += w_[r] * e_[r] * w_[q] * e_[q], pairs[lag] += 1; });
    VectorXd out = VectorXd::Zero(influence.cols());
    each_pair([&](Eigen::Index r, Eigen::Index q, std::size_t lag) {
      const double gamma = sum[lag] / pairs[lag] * (1 - static_cast<double>(lag) / static_cast<double>(lags));
      out += (r == q ? 1 : 2) * gamma * influence.row(r).cwiseProduct(influence.row(q)).transpose();
    });
    return out;
  }

  void judge() {
    const auto columns = j_.cols();
    const auto gain_at = static_cast<Eigen::Index>(first_knot()) - 1;
    const MatrixXd bread = (j_.transpose() * w_.asDiagonal() * j_ + 1e-12 * MatrixXd::Identity(columns, columns)).inverse();
    // Only the numbers asked for: influence of each frame on them.
    const MatrixXd influence = w_.asDiagonal() * (j_ * bread.leftCols(gain_at + 1));
    const double freedom = static_cast<double>(j_.rows()) / std::max(1.0, static_cast<double>(j_.rows() - columns));
    const VectorXd variance = freedom * sandwich(e_.asDiagonal() * influence).diagonal().cwiseMax(stationary(influence));
    out_.offset_s = p_[0];
    out_.gain = p_[gain_at];
    out_.drift = out_.has_drift ? p_[1] : 0;
    scatter_of_manoeuvres();
    const double grow = std::sqrt(std::max(1.0, out_.chi2));
    out_.offset_sigma_s = grow * std::sqrt(variance[0]);
    out_.drift_sigma = out_.has_drift ? grow * std::sqrt(variance[1]) : 0;
    out_.gain_sigma = grow * std::sqrt(variance[gain_at]);
    quality();
    if (out_.gain < 0.3) refuse("picture and TSPI do not roll alike: gain " + std::to_string(out_.gain));
    else if (out_.runner_up < kAmbiguous) refuse("ambiguous: another offset fits nearly as well; a roll that begins and ends is needed");
    else if (!(out_.offset_sigma_s <= config_.most_sigma_s)) refuse("not enough roll motion: 1 sigma of the offset would be " + std::to_string(1e3 * out_.offset_sigma_s) + " ms");
    else out_.enough = true;
  }

  /// What each manoeuvre alone would add to the offset.
  void scatter_of_manoeuvres() {
    double chi2 = 0;
    int used = 0;
    for (Manoeuvre& m : out_.manoeuvres) {
      double information = 0, sum = 0;
      std::vector<Eigen::Index> inside;
      for (Eigen::Index r = 0; r < j_.rows(); ++r) {
        const double t = seen_.t_s[rows_[static_cast<std::size_t>(r)]];
        if (t < m.begin_s || t > m.end_s) continue;
        inside.push_back(r);
        information += w_[r] * j_(r, 0) * j_(r, 0);
        sum += w_[r] * j_(r, 0) * e_[r];
      }
      if (!(information > 0)) continue;
      m.offset_s = sum / information;
      double variance = 0;
      for (const Eigen::Index r : inside)
        for (const Eigen::Index q : inside) {
          const double apart = std::fabs(seen_.t_s[rows_[static_cast<std::size_t>(q)]] - seen_.t_s[rows_[static_cast<std::size_t>(r)]]);
          if (apart < kKernel_s) variance += (1 - apart / kKernel_s) * w_[r] * w_[q] * j_(r, 0) * j_(q, 0) * e_[r] * e_[q];
        }
      m.sigma_s = std::sqrt(std::max(variance, 0.0)) / information;
      if (m.sigma_s > 0) chi2 += m.offset_s * m.offset_s / (m.sigma_s * m.sigma_s), ++used;
    }
    const int freedom = used - (out_.has_drift ? 2 : 1);
    out_.chi2 = freedom > 0 ? chi2 / freedom : 1;
  }

  void quality() {
    double see = 0, smm = 0, sff = 0, smf = 0;
    for (Eigen::Index r = 0; r < j_.rows(); ++r) {
      const std::size_t i = rows_[static_cast<std::size_t>(r)];
      double line = 0;
      for (Eigen::Index c = static_cast<Eigen::Index>(first_knot()); c < j_.cols(); ++c) line += j_(r, c) * p_[c];
      const double m = seen_.roll_rad[i] - line, f = m - e_[r];
      out_.fitted_rad[i] = seen_.roll_rad[i] - e_[r];
      see += e_[r] * e_[r], smm += m * m, sff += f * f, smf += m * f;
    }
    out_.residual_deg = std::sqrt(see / static_cast<double>(j_.rows())) / kDeg;
    out_.correlation = smm > 0 && sff > 0 ? smf / std::sqrt(smm * sff) : 0;
  }

  const RollSeries& seen_;
  const RollAt& tspi_;
  WingRockConfig config_;
  WingRockResult out_;
  VectorXd p_, e_, w_;
  MatrixXd j_;
  std::vector<std::size_t> rows_;    // frames that take part
  int knots_{2};
  double knot_step_{1};
};

}  // namespace

WingRockResult wing_rock(const RollSeries& seen, const RollAt& tspi, const WingRockConfig& config) { return Solver(seen, tspi, config).run(); }

}  // namespace cyclops::tools
