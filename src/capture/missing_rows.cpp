#include "capture/missing_rows.hpp"

#include <algorithm>

#include "base/result.hpp"

namespace cyclops {
namespace {

constexpr std::size_t kMark = 8;
constexpr int kShortHeader = 28 + 8, kExtendedHeader = 28 + 20;

/// The byte that stands at `offset`; its top bit is one that the high byte of a 10 or 12 bit pixel never has.
std::uint8_t mark_at(std::size_t offset) {
  std::uint64_t x = offset * 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 29)) * 0xbf58476d1ce4e5b9ULL;
  return static_cast<std::uint8_t>((x >> 56) | 0x80U);
}
void write_mark(std::uint8_t* image, std::size_t from, std::size_t to) {
  for (std::size_t i = from; i < to; ++i) image[i] = mark_at(i);
}
bool has_mark(const std::uint8_t* image, std::size_t from, std::size_t to) {
  for (std::size_t i = from; i < to; ++i)
    if (image[i] != mark_at(i)) return false;
  return true;
}

}  // namespace

MissingRows::MissingRows(int row_bytes, int rows, int packet_bytes)
    : row_bytes_(static_cast<std::size_t>(row_bytes)),
      rows_(static_cast<std::size_t>(rows)),
      size_(row_bytes_ * rows_),
      rooms_{static_cast<std::size_t>(packet_bytes - kShortHeader), static_cast<std::size_t>(packet_bytes - kExtendedHeader)} {
  CYCLOPS_ASSERT(row_bytes > 0 && rows > 0 && rows <= kMaxImageSide && packet_bytes >= 100);
}

void MissingRows::arm(std::uint8_t* image) const {
  for (std::size_t room : rooms_) {
    for (std::size_t begin = 0; begin < size_; begin += room) {
      const std::size_t end = std::min(begin + room, size_);
      write_mark(image, begin, std::min(begin + kMark, end));
      write_mark(image, end - std::min(kMark, end - begin), end);
    }
  }
}

void MissingRows::read(const std::uint8_t* image, std::size_t room, Reading& out) const {
  for (std::size_t begin = 0; begin < size_; begin += room) {
    const std::size_t end = std::min(begin + room, size_);
    const std::size_t first_end = std::min(begin + kMark, end), last_begin = end - std::min(kMark, end - begin);
    const bool first = has_mark(image, begin, first_end), last = has_mark(image, last_begin, end);
    if (first) mark_rows(begin, first_end - 1, out.marks);
    if (last) mark_rows(last_begin, end - 1, out.marks);
    if (first && last) mark_rows(begin, end - 1, out.lost);
    out.consistent = out.consistent && first == last;
  }
}

void MissingRows::mark_rows(std::size_t first_byte, std::size_t last_byte, RowMask& mask) const {
  for (std::size_t v = first_byte / row_bytes_; v <= last_byte / row_bytes_; ++v) mask.set_missing(static_cast<int>(v));
}

int MissingRows::find(const std::uint8_t* image, RowMask& mask) const {
  // A hole can hide between two marks of the wrong layout, which then looks consistent too: the answer is the union.
  RowMask marks;
  for (std::size_t room : rooms_) {
    Reading reading;
    read(image, room, reading);
    for (std::size_t i = 0; i < std::size(mask.bits); ++i) {
      marks.bits[i] |= reading.marks.bits[i];
      if (reading.consistent) mask.bits[i] |= reading.lost.bits[i];
    }
  }
  bool explained = true;
  for (std::size_t i = 0; i < std::size(mask.bits); ++i) explained = explained && (marks.bits[i] & ~mask.bits[i]) == 0;
  if (!explained) mark_rows(0, size_ - 1, mask);
  return mask.count();
}

}  // namespace cyclops
