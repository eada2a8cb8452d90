#pragma once
/// Pairs corners with tracks, at most one to one, so that the total gain is as large as can be.
///
/// Gate     kFixed: distance up to gate_px, gain = gate_px - distance (the thesis).
///          kMahalanobis: squared innovation over S up to chi_square and distance up to max_gate_px, where
///          S = track covariance + corner covariance + model_sigma_px^2; gain = log-likelihood ratio of "this corner is the
///          feature" to "the feature was missed and this is clutter", so a certain track outbids an uncertain one.
///          A pair whose gain is below 0 is outside the gate.
/// Method   kAuction: one assignment a frame. kKBest: the k best of each frame, kept over frames as readings (hypotheses.hpp); navigation's
///          word against the track's own, corner against corner, is then decided by several frames.
/// Doubt    kAuction with kMahalanobis: a match is dropped (kAmbiguous) when the k best assignments of the tracks that compete leave it less
///          than min_probability against the corner being another track's. A track competes for what lies within chi_square, further out
///          than its own gate too: a pose that is off moves all gates alike. Points within kSame_px of each other are one.
/// Frames   tracks and corners are in raw pixels. Time: both at the same t_mid; the caller moves the tracks there.
/// Errors   no match is a result: the reason stands in Match. Points that are not finite match nothing.
/// Threads  one object a thread. Memory: all of it in the constructor.
/// Source   spec 2.5; likelihood ratio: Blackman & Popoli, Design and Analysis of Modern Tracking Systems, 1999, ch. 6.
#include "associate/auction.hpp"
#include "associate/cells.hpp"
#include "associate/hypotheses.hpp"
#include "associate/k_best.hpp"
#include "base/config.hpp"
#include "msg/chain.hpp"

namespace cyclops {

enum class Gate : std::uint8_t { kFixed, kMahalanobis };
enum class AssociateMethod : std::uint8_t { kAuction, kKBest };

/// Table "associate".
struct AssociateConfig {
  AssociateMethod method{AssociateMethod::kAuction};
  Gate gate{Gate::kFixed};
  double gate_px{13};                   ///< the thesis used 6, 9, 13 and 16
  double epsilon_px{0.01};              ///< smallest raise of a price; total within n * epsilon of the best
  double cardinality_bonus_px{0};       ///< added to every gain; above n * gate_px it makes pairs count before gain (E15)
  int max_bids{50000};                  ///< of one auction before epsilon grows tenfold
  double chi_square{9.21};              ///< 99 % of 2 degrees of freedom
  double max_gate_px{20};               ///< the Mahalanobis gate never reaches further
  double model_sigma_px{1};             ///< 1 sigma per axis of what neither covariance contains
  double detection_probability{0.8};    ///< that the corner of a visible feature is found
  double clutter_per_px2{0.001};        ///< other corners in the searched area
  double min_probability{0};            ///< of a match among its rivals; 0: every match stands. Only with kMahalanobis
  int best{8};                          ///< assignments looked at of those that compete, and of a frame
  int readings{4};                      ///< kKBest: kept from frame to frame
  double reading_memory_s{0.5};         ///< kKBest: a frame this old counts 1/e

  /// `table` is [associate]; range errors are collected there.
  [[nodiscard]] static Result<AssociateConfig> read(ConfigTable& table, AssociateConfig absent);  ///< `absent`: values of keys left out
  bool operator==(const AssociateConfig&) const = default;
};

/// Sums since construction.
struct AssociateCounters {
  std::uint64_t frames{0};
  std::uint64_t candidates{0};          ///< gated pairs
  std::uint64_t bids{0};
  std::uint64_t epsilon_raised{0};      ///< frames whose auction ran into max_bids
  std::uint64_t gates_thinned{0};       ///< gates with more than kMaxPerGate corners; the best of them were kept
  std::uint64_t ambiguous{0};           ///< matches dropped because of it
  std::uint64_t too_many{0};            ///< problems with more tracks or corners than KBest has room for; the auction's word stood
};

class Associator {
 public:
  /// Lossless as long as no more than this many tracks compete for the same corners.
  static constexpr std::size_t kMaxPerGate = 64;
  static constexpr std::size_t kMaxRivals = 96;    ///< tracks of one problem for KBest
  static constexpr std::size_t kMaxWanted = 512;   ///< corners of it
  static constexpr double kSame_px = 1.5;
  static constexpr double kWide = 2;               ///< rivals are looked for as far as this times max_gate_px

  explicit Associator(const AssociateConfig& config);
  /// One Match for each track, in order. Tracks that are neither live nor coasting get kNotVisible.
  void associate(const TrackSet& tracks, const CornerSet& corners, MatchSet& out);
  [[nodiscard]] const AssociateCounters& counters() const { return counters_; }
  [[nodiscard]] double last_epsilon() const { return last_epsilon_; }

 private:
  struct Pair {
    std::int32_t corner{0};
    std::int32_t track{0};
    double gain{0};
    bool far{false};                    ///< outside the gate: no match, but it may be whose the corner is
  };
  [[nodiscard]] bool doubts() const { return config_.method == AssociateMethod::kAuction && config_.gate == Gate::kMahalanobis && config_.min_probability > 0; }
  [[nodiscard]] double radius_px(const Track& track, double corner_variance, double most_px) const;
  [[nodiscard]] double likelihood_gain(const Track& track, const Corner& corner) const;
  void gather(const TrackSet& tracks, const CornerSet& corners, MatchSet& out);
  std::size_t weigh(const Track& track, const CornerSet& corners, double gate_px, std::size_t n);
  std::size_t thin(std::size_t n);
  bool gather_one(const Track& track, std::size_t index, const CornerSet& corners, double gate_px, double wide_px);
  void sort_by_corner(std::size_t corners);
  void read_result(MatchSet& out);
  static void give(const Pair& pair, MatchSet& out);
  void assign(std::size_t tracks, std::size_t corners);
  void associate_readings(const TrackSet& tracks, const CornerSet& corners, MatchSet& out);
  void judge_reading(std::size_t reading, std::size_t tracks);
  void doubt(const CornerSet& corners, MatchSet& out);
  void find_rivals(std::size_t tracks);
  [[nodiscard]] std::int32_t rival_root(std::int32_t track);
  void doubt_rivals(const CornerSet& corners, MatchSet& out);
  [[nodiscard]] double probability(std::size_t rival, std::int32_t corner, std::size_t solutions, const CornerSet& corners) const;

  AssociateConfig config_;
  CornerCells cells_;
  Auction auction_;
  std::vector<Pair> gate_;              ///< candidates of one track
  std::vector<Pair> pairs_;             ///< of all tracks
  std::vector<std::uint32_t> first_;    ///< by corner, into offers_
  std::vector<Offer> offers_;
  std::vector<std::uint32_t> first_pair_;      ///< by track, into pairs_
  std::vector<std::int32_t> rival_;            ///< by track: another track that it competes with, up to the root
  std::vector<std::int32_t> claimant_;         ///< by corner: a track that may have it, or -1
  std::vector<std::int32_t> rivals_;           ///< tracks of one problem
  std::vector<std::uint32_t> first_claim_;
  std::vector<Claim> claims_;
  KBest k_best_;
  Hypotheses hypotheses_;
  TrackSet expected_{};
  std::size_t corners_{0};
  AssociateCounters counters_{};
  double last_epsilon_{0};
};

}  // namespace cyclops
