#pragma once
/// Where edges of the strobe or of PPS come from: a GPIO line (strobe_uapi.cpp, strobe_gpiod.cpp) or the bench's socket (strobe_socket.cpp).
///
/// Time     edges carry the stamp of the kernel (GPIO) or of the sender (socket) on CLOCK_MONOTONIC, the service clock.
/// Order    by time, within one opening.
/// Loss     is never silent where it can be seen: see StrobeStatus.
/// Threads  one thread owns a source; it should run with real-time priority, since the old GPIO interface keeps 16 edges only.
/// Errors   a Result with the device as its place. After an error from wait or read_many, open may be called again.
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "base/config.hpp"
#include "base/result.hpp"
#include "msg/strobe.hpp"

namespace cyclops {

enum class StrobeKind : std::uint8_t { kGpio, kSocket, kNone };

/// Of one line: the strobe's, or with the same keys that of PPS.
struct StrobeConfig {
  StrobeKind kind{StrobeKind::kSocket};
  std::string socket{"@cyclops-strobe"};  ///< abstract name, begins with @
  std::string chip{"gpiochip0"};          ///< label, name or path
  int line{17};                           ///< offset in the chip
  std::string line_name;                  ///< when given, found by name instead of offset
  bool rising{true};                      ///< the edge at the start of the exposure
  Duration delay{};                       ///< edge later than the start of exposure, or of the second, by this; for timesync
  Duration delay_sigma{20'000};           ///< what is not known of it, 1 sigma

  /// Keys of the rig's [strobe] and [pps]: source, socket, chip, line, line_name, edge, delay_us, delay_sigma_us.
  static Result<StrobeConfig> read(ConfigTable& line, const StrobeConfig& defaults);
};

struct StrobeStatus {
  bool connected{false};            ///< line requested, or server there
  bool numbered{false};             ///< edges carry line_seq, so that every loss shows
  std::uint64_t edges{0};           ///< handed out
  std::uint64_t lost{0};            ///< gaps in line_seq
  std::uint64_t overruns{0};        ///< reads that found the kernel's buffer full: without line_seq edges were probably lost
  std::uint64_t disconnects{0};     ///< the server went away
  std::uint64_t foreign{0};         ///< other line or other slope, not handed out
  std::uint64_t malformed{0};       ///< records of the wrong size or type, not handed out
};

/// When the first packet of a frame came, on the clock of the edges.
struct FrameArrival {
  std::uint64_t camera_frame_id{0};
  Time t{};
};

class StrobeSource {
 public:
  virtual ~StrobeSource() = default;
  StrobeSource() = default;
  StrobeSource(const StrobeSource&) = delete;
  StrobeSource& operator=(const StrobeSource&) = delete;

  /// Opens, or opens again. kNotFound: no such chip or line. kIo: refused, with the reason (busy, no permission).
  /// A socket whose server is not there yet is no error.
  virtual Result<> open() = 0;
  /// Blocks until an edge can be read or the time is over; true: read_many will give something.
  virtual Result<bool> wait(Duration timeout) = 0;
  /// Does not block. How many edges were written to the front of `out`; 0 when there are none.
  virtual Result<std::size_t> read_many(std::span<StrobeEdge> out) = 0;
  [[nodiscard]] virtual StrobeStatus status() const = 0;
  /// True: the edges are of a recorded clock, not of this host's, so the source also says when frames arrive on it. Only the
  /// bench's socket does; it is what lets a flight be replayed at any speed with the same bits.
  [[nodiscard]] virtual bool has_own_clock() const { return false; }
  /// Arrivals read since the last call, oldest first. After read_many, by the same thread.
  virtual std::size_t take_arrivals(std::span<FrameArrival>) { return 0; }
};

/// Not opened yet. Null for kNone.
[[nodiscard]] std::unique_ptr<StrobeSource> make_strobe_source(const StrobeConfig& config);
/// The best way this build and this kernel have: libgpiod 2 if it was built with that, else the kernel's interface v2, else libgpiod 1.6.
/// Which one is decided when it is opened; `StrobeStatus::numbered` tells it.
[[nodiscard]] std::unique_ptr<StrobeSource> make_gpio_strobe(const StrobeConfig& config);
[[nodiscard]] std::unique_ptr<StrobeSource> make_gpiod_strobe(const StrobeConfig& config);   ///< the library alone
[[nodiscard]] std::unique_ptr<StrobeSource> make_uapi_strobe(const StrobeConfig& config);    ///< interface v2 alone; kUnsupported where there is none
[[nodiscard]] std::unique_ptr<StrobeSource> make_socket_strobe(const StrobeConfig& config);

}  // namespace cyclops
