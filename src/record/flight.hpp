#pragma once
/// Flights: folders that hold everything a camera, a strobe and two aircraft said, bit for bit (docs/architecture.md).
///
/// Either log may be split into parts (log_stream.hpp); they are read as one. Event numbers of frames are those in the log.
/// A folder is a flight when its manifest is there and agrees with the files; the manifest is written last. A writer works in
/// a folder beside it, `<folder>.part`, that takes the flight's name when all of it is on the disk: half a flight is never
/// taken for one, and an old one stays until then. A writer that is dropped unfinished removes its part folder.
/// Errors   name the file, the byte or line, what is there and what was expected.
/// Threads  one at a time.
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "msg/frame.hpp"
#include "record/event_log.hpp"

namespace cyclops {

inline constexpr const char* kFlightFormat = "cyclops-flight-1";

struct FlightManifest {
  std::string name;
  std::string origin{"generated"};    ///< generated, imported or recorded
  std::string source;                 ///< what made it, with seed
  std::int64_t frames{0};
  std::int64_t pixels{-1};            ///< frames whose pixels are there; below 0: all of them
  std::int64_t first_frame_ns{0};     ///< mid-exposure, service clock
  std::int64_t last_frame_ns{0};
  int nav_every_n{1};                 ///< frames between the navigation updates the source marks; 1: every frame
  bool has_truth{false};
  std::map<std::string, std::int64_t> files;  ///< size in bytes
};

/// Writes manifest.toml with the sizes of the files that are in the folder, and brings both to the disk.
Result<> write_manifest(const std::string& folder, FlightManifest manifest);
/// NAME.lcm and, as far as they go on without a gap, NAME.001.lcm ...
[[nodiscard]] std::vector<std::string> log_parts(const std::string& folder, const std::string& name);

/// Pixels of one frame of a flight, and what the camera said with them.
struct FlightFrame {
  std::uint64_t camera_frame_id{0};
  std::int64_t camera_tick_ns{0};
  Duration exposure{};
  FrameStatus status{FrameStatus::kComplete};
  RowMask missing{};
  ImageView image{};                  ///< into the owner's memory
};

class FlightWriter {
 public:
  /// The folder must not be a flight already, unless `replace`, and must hold nothing but files of a flight.
  /// `frames_from`: frames.lcm of another flight with the same frames; shared (hard link) where the file system can, else
  /// copied. Then frame() must not be called.
  static Result<FlightWriter> create(const std::string& folder, bool replace, const std::string& frames_from = {});
  Result<> message(Time arrival, const char* channel, const void* data, std::size_t bytes);
  /// Pixels; returns the event number for frame_index_t.recorded_at.
  Result<std::int64_t> frame(Time arrival, const FlightFrame& frame);
  /// Any other file of the folder: rig.toml, tanker.csv, windscreen.bin.
  Result<> text(const std::string& name, const std::string& content);
  /// Where a file of the flight is while it is being written.
  [[nodiscard]] std::string path(const std::string& name) const;
  /// Writes the manifest and gives the folder its name; only now is it a flight. `files` is filled in.
  Result<> finish(FlightManifest manifest);

 private:
  struct Remove { void operator()(const std::string* folder) const; };
  std::string folder_;
  std::unique_ptr<const std::string, Remove> part_;  // removed with all that is in it, unless finish() let go of it
  record::EventLogWriter messages_;
  record::EventLogWriter frames_;
  std::vector<std::uint8_t> buffer_;
  std::vector<std::uint8_t> rows_;
};

class FlightReader {
 public:
  static Result<FlightReader> open(const std::string& folder);
  [[nodiscard]] const FlightManifest& manifest() const { return manifest_; }
  [[nodiscard]] std::string path(const std::string& name) const;
  /// Messages in order of arrival; false at the end.
  Result<bool> next(record::LogEvent& event);
  Result<> rewind();
  /// To the first message at or after the arrival time; linear in the size of the log.
  Result<> seek(Time arrival);
  /// False: the frame's pixels were not recorded.
  [[nodiscard]] bool has_frame(std::int64_t number) const { return find(number) != nullptr; }
  /// `number`: recorded_at of the frame's index message. `image` points into `memory`, which is used again.
  Result<> frame(std::int64_t number, std::vector<std::uint8_t>& memory, FlightFrame& out);

 private:
  struct Place {
    std::int64_t number{0};
    std::size_t part{0};
    std::int64_t offset{0};
  };
  Result<> check();
  Result<> index_frames();
  Result<bool> next_of(record::LogEvent& event, std::uint32_t* skimmed_bytes);
  [[nodiscard]] const Place* find(std::int64_t number) const;
  std::string folder_;
  FlightManifest manifest_;
  std::vector<record::EventLog> messages_;
  std::size_t at_part_{0};             // of messages_
  std::vector<record::EventLog> frames_;
  std::vector<Place> places_;          // by number
  record::LogEvent scratch_;
};

}  // namespace cyclops
