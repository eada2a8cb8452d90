#include "capture/missing_rows.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <set>
#include <vector>

#include "test/support.hpp"

namespace cyclops {
namespace {

struct Wire {
  int row_bytes, rows, packet_bytes, header;
  [[nodiscard]] std::size_t room() const { return static_cast<std::size_t>(packet_bytes - 28 - header); }
  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(row_bytes) * static_cast<std::size_t>(rows); }
  [[nodiscard]] std::size_t packets() const { return (size() + room() - 1) / room(); }
};

/// Lets every packet but `lost` (from 0) arrive with random pixels, and gives the rows that are missing in truth.
RowMask receive(const Wire& wire, const std::set<std::size_t>& lost, test::Random& random, std::vector<std::uint8_t>& image) {
  RowMask truth;
  for (std::size_t p = 0; p < wire.packets(); ++p) {
    const std::size_t begin = p * wire.room(), end = std::min(begin + wire.room(), wire.size());
    for (std::size_t i = begin; i < end; ++i) {
      if (lost.count(p) == 0) image[i] = static_cast<std::uint8_t>(random());
      else truth.set_missing(static_cast<int>(i / static_cast<std::size_t>(wire.row_bytes)));
    }
  }
  return truth;
}

TEST(MissingRows, FindsExactlyTheRowsOfThePacketsThatWereLost) {
  test::Random random(1);
  for (int trial = 0; trial < 400; ++trial) {
    // Last packets of a few bytes only are left to the next test.
    const Wire wire{100 + static_cast<int>(random() % 1000), 20 + static_cast<int>(random() % 100), 200 + static_cast<int>(random() % 3000),
                    random() % 2 == 0 ? 8 : 20};
    if (wire.size() % wire.room() < 16) continue;
    const MissingRows rows(wire.row_bytes, wire.rows, wire.packet_bytes);
    std::vector<std::uint8_t> image(wire.size());
    rows.arm(image.data());
    std::set<std::size_t> lost;
    for (std::uint64_t i = random() % 5; i > 0; --i) lost.insert(random() % wire.packets());
    const RowMask truth = receive(wire, lost, random, image);
    RowMask found;
    const int count = rows.find(image.data(), found);
    EXPECT_EQ(count, found.count());
    EXPECT_EQ(std::memcmp(found.bits, truth.bits, sizeof truth.bits), 0)
        << wire.row_bytes << " x " << wire.rows << " in " << wire.packet_bytes << ", header " << wire.header;
  }
}

TEST(MissingRows, NeverCallsAMissingRowPresent) {
  test::Random random(2);
  for (int trial = 0; trial < 400; ++trial) {
    const Wire wire{1 + static_cast<int>(random() % 300), 1 + static_cast<int>(random() % 60), 100 + static_cast<int>(random() % 400),
                    random() % 2 == 0 ? 8 : 20};
    const MissingRows rows(wire.row_bytes, wire.rows, wire.packet_bytes);
    std::vector<std::uint8_t> image(wire.size());
    rows.arm(image.data());
    std::set<std::size_t> lost;
    for (std::uint64_t i = random() % 5; i > 0; --i) lost.insert(random() % wire.packets());
    const RowMask truth = receive(wire, lost, random, image);
    RowMask found;
    (void)rows.find(image.data(), found);
    for (int v = 0; v < wire.rows; ++v) EXPECT_TRUE(!truth.missing(v) || found.missing(v));
  }
}

TEST(MissingRows, CallsEveryRowMissingWhenNothingCame) {
  const MissingRows rows(640, 481, 1500);
  std::vector<std::uint8_t> image(640 * 481);
  rows.arm(image.data());
  RowMask found;
  EXPECT_EQ(rows.find(image.data(), found), 481);
}

TEST(MissingRows, CallsEveryRowMissingWhenPacketsWereCutShort) {
  // GIVEN a packet that brought only half of what it should
  const MissingRows rows(640, 481, 1500);
  std::vector<std::uint8_t> image(640 * 481, 0);
  rows.arm(image.data());
  std::vector<std::uint8_t> arrived(image.size(), 0);
  const std::size_t room = 1500 - 48;
  std::memcpy(arrived.data() + 3 * room + room / 2, image.data() + 3 * room + room / 2, room - room / 2);
  RowMask found;
  EXPECT_EQ(rows.find(arrived.data(), found), 481);
}

}  // namespace
}  // namespace cyclops
