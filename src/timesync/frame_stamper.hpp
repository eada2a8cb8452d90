#pragma once
/// Gives every frame the middle of its exposure on the service clock: edge - delay + exposure / 2.
///
/// An edge belongs to a frame by number: the edges counted since the last confirmed pair must equal the frames counted by
/// the camera, and the edge must lie where the camera's own clock puts it. Arrival never places an edge; it only gates
/// the whole-number offset when that is locked. Both are checked on every frame, for ever. A contradiction drops the
/// lock; then the time is less exact and says so (`time_source`, `t_mid_sigma`), until a new lock is proven.
/// How it works, and what happens on each fault: docs/time.md.
///
/// Order    frames must come in the order the camera numbered them and leave in that order, every one of them, each once.
///          Edges must come in order of time. Frames and edges may interleave freely.
/// Same in, same out: the stamper decides a frame only when it has seen every edge that could matter, so the result does
///          not depend on how edges and frames interleave, unless an edge is later than `max_wait_frames` frames.
/// Needs    a camera that runs freely at a steady rate and stamps its frames; without a tick there is no proof and the
///          time is kArrival.
/// Threads  one at a time. No clock, no file. Memory: in place, no heap.
#include <array>
#include <cstdint>
#include <optional>

#include "base/config.hpp"
#include "base/result.hpp"
#include "msg/frame.hpp"
#include "msg/strobe.hpp"
#include "timesync/lock_search.hpp"
#include "timesync/ring.hpp"
#include "timesync/tick_line.hpp"

namespace cyclops {

struct FrameStamperConfig {
  Duration period{33'333'333};        ///< nominal; the camera's own clock refines it
  Duration edge_delay{};              ///< edge later than the start of exposure by this
  bool rising{true};                  ///< the edge at the start of the exposure; others are counted and ignored
  Duration transport_max{};           ///< first packet after the end of exposure in quiet conditions; 0: 80 % of the period.
                                      ///< A period or more: arrivals prove nothing, see docs/time.md
  Duration arrival_slack{500'000};    ///< an arrival before the end of exposure by more than this proves a wrong number
  Duration residual_max{1'000'000};   ///< edge against camera clock
  Duration delay_sigma{20'000};       ///< what is not known of edge_delay, 1 sigma: a constant that no scatter shows
  Duration arrival_sigma{5'000'000};  ///< of a time made from the arrival, once the usual transport is known
  Duration tick_holdover{600'000'000'000};  ///< so long the camera clock alone is trusted; its sigma grows all the while
  std::uint64_t first_frame_id{1};    ///< number of the first frame after a start; 0: the camera does not start afresh
  int id_bits{64};                    ///< 16: block ids wrap from 65535 to 1
  int max_wait_frames{8};             ///< frames that may wait for an edge
  int lock_frames{4};                 ///< frames that must agree for a lock
  ClockNoise clock{};                 ///< camera clock against service clock

  /// Optional keys of the rig's [time]: transport_max_ms, first_frame_id, block_ids ("16 bit", "64 bit"),
  /// max_wait_frames, tick_holdover_s, clock_wander_ppm.
  /// Period, delay and edge are the caller's to set: they stand in [camera] and [strobe].
  static Result<FrameStamperConfig> read(ConfigTable& time);
  [[nodiscard]] Result<> validated() const;
};

/// Why a lock was dropped.
enum class LockLoss : std::uint8_t {
  kRestart,        ///< the caller said so
  kNumberBack,     ///< the camera's numbers started afresh
  kTickStep,       ///< camera number and camera clock disagree
  kCount,          ///< edges counted and frames counted disagree
  kEarlyArrival,   ///< a frame was here before its exposure had ended
  kLateArrival,    ///< four frames in a row evenly late by a period, or late for longer than can be waited
  kResidual,       ///< five edges in a row beside the line
  kHoldover,       ///< no edge for too long
  kNumberOf,
};
[[nodiscard]] const char* to_string(LockLoss cause);

struct StampCounters {
  std::uint64_t frames{0};              ///< frames in
  std::uint64_t by_source[4]{};         ///< frames out, by TimeSource
  std::uint64_t matched{0};             ///< frames with their edge
  std::uint64_t lock_count{0};          ///< locks gained
  std::uint64_t lock_loss[static_cast<std::size_t>(LockLoss::kNumberOf)]{};
  std::uint64_t first_edges_lost{0};    ///< locks where the first edges after the start were missing
  std::uint64_t start_refused{0};       ///< no lock: more edges than frames at the start, or arrivals too late; needs a restart
  std::uint64_t doubtful{0};            ///< no lock: frames came late by a period, and the number that fits now is another one
  std::uint64_t ambiguous{0};           ///< no lock: more than one number fits
  std::uint64_t no_edge_lost{0};        ///< frames without edge: a later edge came, this one did not
  std::uint64_t no_edge_waited{0};      ///< frames without edge: none came in the time allowed
  std::uint64_t no_edge_beside{0};      ///< frames without edge: there was one, off the line
  std::uint64_t starved{0};             ///< times that waiting for an edge was given up
  std::uint64_t unproven{0};            ///< late, and the acquisition ended or broke off before a frame in time proved the number
  std::uint64_t unnumbered{0};          ///< frames without number or tick (lost leader, stale id)
  std::uint64_t refused_frames{0};      ///< not taken: the caller does not pop
  std::uint64_t edges{0};               ///< edges in
  std::uint64_t edges_lost_seq{0};      ///< by gaps in line_seq
  std::uint64_t edges_lost_inferred{0}; ///< by intervals of two and more periods, when line_seq tells nothing
  std::uint64_t edges_doubled{0};       ///< within an eighth of a period of the one before
  std::uint64_t edges_spurious{0};      ///< off the grid of exposures
  std::uint64_t edges_without_frame{0}; ///< on the grid, its frame never came
  std::uint64_t edges_disordered{0};    ///< not later than the one before; dropped
  std::uint64_t edges_other{0};         ///< the other slope; dropped
  std::uint64_t edges_before_start{0};  ///< older than the start of acquisition; dropped
};

using FrameToken = std::uint64_t;   ///< the caller's own mark for the frame; comes out as it went in

class FrameStamper {
 public:
  /// `config` must be validated().
  explicit FrameStamper(const FrameStamperConfig& config);
  /// The camera (re)starts its acquisition after a pause; to be called before it does. Frames still waiting leave now;
  /// edges before `start` no longer count.
  void restart(Time start);
  void on_edge(const StrobeEdge& edge);
  /// False, and not taken, when the caller has not popped what is ready.
  [[nodiscard]] bool on_frame(const FrameInfo& frame, FrameToken token);
  /// Decides every waiting frame with what is known: end of a flight, or of an acquisition.
  void flush();
  /// The next frame with t_mid, t_mid_sigma and time_source set; false when none is ready.
  [[nodiscard]] bool pop(FrameInfo& frame, FrameToken& token);

  /// The newest numbered frame's tick: where to ask `line()` for its sigma and age; 0 before any.
  [[nodiscard]] std::int64_t newest_tick_ns() const { return last_frame_.tick_ns; }
  [[nodiscard]] bool locked() const { return locked_; }
  [[nodiscard]] const StampCounters& counters() const { return counters_; }
  [[nodiscard]] const TickLine& line() const { return line_; }

 private:
  struct Entry { FrameInfo info{}; FrameToken token{0}; std::uint64_t number{0}; };   // number 0: unnumbered
  struct Pair { std::uint64_t number{0}; std::int64_t tick_ns{0}; Time edge{}; };
  struct Search {
    std::optional<Time> edge;          // the frame's own
    std::optional<Duration> beside;    // distance of the nearest edge that is not on the line
    std::uint64_t next{0};             // first edge after this frame's
    bool complete{false};              // a later edge has been seen: nothing more can come for this frame
  };
  enum class Proof : std::uint8_t { kRight, kWrong, kLater, kNever };   // of the first waiting frame's number; kLater: another frame is needed
  static constexpr std::size_t kReady = 64;

  // intake
  std::uint64_t number_of(const FrameInfo& frame);
  void count_interval(const StrobeEdge& before, const StrobeEdge& edge);
  void note_start(Time before, Time edge);
  // one decision; false when an input is missing
  void run();
  bool follow();
  bool acquire();
  [[nodiscard]] bool may_wait();
  // following
  [[nodiscard]] std::optional<LockLoss> contradiction(const Entry& f, const Pair& before) const;
  [[nodiscard]] bool counts_agree(const Entry& f, Time edge) const;
  [[nodiscard]] Search find_edge(const Entry& f) const;
  [[nodiscard]] Duration tolerance(const Entry& f) const;
  void pass_edges(const Search& search, Time expected);
  bool without_edge(const Entry& f, const Search& search);
  [[nodiscard]] double transport_of(const Entry& f, Time edge) const;
  [[nodiscard]] bool late(double transport_ns) const;
  [[nodiscard]] Proof arrivals_say() const;
  void without_proof(const Entry& f, const Search& search);
  // locking
  [[nodiscard]] std::size_t gather(std::array<LockFrame, kMaxLockFrames>& frames) const;
  const LockCandidate* choose(const LockCandidates& found, std::span<const LockFrame> frames, Duration period);
  void lock(const LockCandidate& chosen, std::span<const LockFrame> frames, Duration period);
  void unlock(LockLoss cause);
  // results
  void confirm(const Entry& f, Time edge);
  void give_up_front();
  void note_arrival(const Entry& f, Time edge);
  void emit_edge(const Entry& f, Time edge);
  void emit_tick(const Entry& f, Duration least_sigma);
  void emit_arrival(const Entry& f, Duration least_sigma);
  void emit(Entry f, Time t_mid, Duration sigma, TimeSource source);
  [[nodiscard]] LockGates gates() const;
  [[nodiscard]] Time mid(const Entry& f, Time edge) const;
  [[nodiscard]] Duration with_scatter(Duration sigma) const;

  FrameStamperConfig config_;
  StampCounters counters_;
  EdgeRing edges_;
  std::uint64_t next_edge_{0};          // first edge no frame has passed
  Ring<Entry, kReady> waiting_;
  Ring<Entry, kReady> ready_;
  TickLine line_;
  bool locked_{false};
  bool starved_{false};                 // edges are overdue: frames no longer wait, until one comes
  bool flushing_{false};
  double period_ns_;
  Pair last_frame_{};                   // last numbered frame out while locked
  Pair last_pair_{};                    // last confirmed pair
  int beside_in_a_row_{0};
  std::optional<Duration> doubt_;       // edge - tick when late frames dropped the lock: only this, or a restart, locks again
  std::uint64_t last_number_{0};        // intake, unwrapped
  std::uint64_t last_id_{0};
  std::optional<StrobeEdge> last_edge_;
  Time not_before_{INT64_MIN};          // edges before the start are not of this acquisition
  bool start_known_{false};             // the gap before the first edge can still be used
  std::optional<Time> first_edge_;      // first edge after the start that another follows after one period
  std::uint64_t first_number_{0};       // first frame after the start
  bool start_refused_{false};
  Time last_t_mid_{INT64_MIN};
  std::optional<double> transport_ns_;  // usual first packet after the end of exposure
};

}  // namespace cyclops
