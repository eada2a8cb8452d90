#pragma once
/// Finds the rows of an incomplete frame that never arrived.
///
/// The receiving library reports that packets are missing, not which. So each buffer gets marks before it is handed to
/// the network: eight bytes at the first and at the last bytes of every packet's place. A packet that arrives overwrites
/// both its marks, one that does not leaves both. Whether packets are numbered with 16 or 64 bits changes their size by
/// 12 bytes and is not known beforehand, so both layouts are marked (a mark depends only on where it stands) and both
/// are read back. A layout in which a packet kept one mark and lost the other is not the one that was used. Each mark that
/// is left must be explained by a packet missing as a whole, or else all rows are called missing: a doubt never makes a
/// row present.
///
/// Cost     arm(): 32 bytes written per packet, 4 kB for 1024 x 1024 x 8 bit at 9000 bytes.
/// Frames   row v is missing when any byte of it belongs to a packet that did not arrive.
/// Threads  const: any. Memory: no heap. Errors: none.
#include <array>
#include <cstddef>
#include <cstdint>

#include "msg/frame.hpp"

namespace cyclops {

class MissingRows {
 public:
  /// `row_bytes` x `rows` <= 2^31; `packet_bytes` counts IP and UDP headers and is at least 100.
  MissingRows(int row_bytes, int rows, int packet_bytes);
  void arm(std::uint8_t* image) const;
  /// Marks the missing rows in `mask` (which comes empty) and returns how many there are.
  int find(const std::uint8_t* image, RowMask& mask) const;

 private:
  /// What the marks of one layout say.
  struct Reading {
    bool consistent{true};
    RowMask lost;   ///< rows of packets that kept both marks
    RowMask marks;  ///< rows in which a whole mark is left
  };
  void read(const std::uint8_t* image, std::size_t room, Reading& out) const;
  void mark_rows(std::size_t first_byte, std::size_t last_byte, RowMask& mask) const;

  std::size_t row_bytes_;
  std::size_t rows_;
  std::size_t size_;
  std::array<std::size_t, 2> rooms_;  // payload bytes of a packet with short and with extended ids
};

}  // namespace cyclops
