#pragma once
/// The sending side of the strobe stand-in: what the camera's strobe line is on the aircraft.
///
/// Clients may come and go at any time; an edge goes to all that are connected when it is sent, and is gone for the others,
/// as on a real line. Nothing blocks: a client that does not read loses edges, which is counted and, since each edge keeps
/// its line_seq, seen by the client.
/// Threads  one at a time. Memory: no heap after open, except when a client comes.
#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "capture/strobe_record.hpp"
#include "msg/strobe.hpp"

namespace cyclops::hil {

struct StrobeServerCounters {
  std::uint64_t edges{0};         ///< sent to whoever was there
  std::uint64_t delivered{0};     ///< edges times clients
  std::uint64_t no_client{0};     ///< edges nobody was there for
  std::uint64_t undelivered{0};   ///< edges a client's full buffer did not take
  std::uint64_t clients{0};       ///< connections accepted
  std::uint64_t gone{0};          ///< connections that ended
};

class StrobeServer {
 public:
  /// Listens on an abstract name such as "@cyclops-strobe". kInvalid: bad name. kIo: the name is in use.
  static Result<StrobeServer> open(const std::string& name);
  /// Takes in clients that are waiting; send does it too.
  void accept_waiting();
  void send(const StrobeEdge& edge, std::uint32_t line);
  /// Tells when the first packet of a frame comes, on the flight's clock; before the frame itself is sent.
  void send_arrival(std::uint64_t camera_frame_id, Time t);
  [[nodiscard]] std::size_t connected() const { return clients_.size(); }
  [[nodiscard]] const StrobeServerCounters& counters() const { return counters_; }

 private:
  StrobeServer() = default;
  void send_all(const StrobeRecord& record);
  Fd listener_;
  std::vector<Fd> clients_;
  StrobeServerCounters counters_;
};

}  // namespace cyclops::hil
