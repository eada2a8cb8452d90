#include "record/event_log.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <sstream>

#include "test/support.hpp"

namespace cyclops::record {
namespace {

using Bytes = std::string;

using test::slurp;
using test::spill;

/// Three events of 5, 0 and 300 bytes.
Bytes three_events(const test::TempDir& dir) {
  auto log = EventLogWriter::create(dir.file("three.lcm")).value();
  const Bytes big(300, '\xDA');
  EXPECT_TRUE(log.write(10, "TSPI", "hello", 5).ok());
  EXPECT_TRUE(log.write(-20, "S", "", 0).ok());
  EXPECT_TRUE(log.write(INT64_MAX, std::string(63, 'C').c_str(), big.data(), big.size()).ok());
  EXPECT_EQ(log.events(), 3);
  EXPECT_TRUE(log.close().ok());
  EXPECT_EQ(static_cast<std::int64_t>(slurp(dir.file("three.lcm")).size()), log.bytes());
  return slurp(dir.file("three.lcm"));
}

/// Events until the end or the first error.
struct Read {
  int events{0};
  std::optional<Error> error;
};
Read read_all(const std::string& path) {
  Read out;
  auto log = EventLog::open(path);
  if (!log.ok()) return out.error = log.error(), out;
  LogEvent event;
  while (true) {
    auto more = log->next(event);
    if (!more.ok()) return out.error = more.error(), out;
    if (!*more) return out;
    ++out.events;
  }
}

TEST(EventLog, GivesBackWhatWasWritten) {
  test::TempDir dir;
  three_events(dir);
  auto log = EventLog::open(dir.file("three.lcm")).value();
  LogEvent event;
  ASSERT_TRUE(log.next(event).value());
  EXPECT_EQ(event.number, 0);
  EXPECT_EQ(event.time_us, 10);
  EXPECT_EQ(event.channel, "TSPI");
  EXPECT_EQ(Bytes(event.data.begin(), event.data.end()), "hello");
  ASSERT_TRUE(log.next(event).value());
  EXPECT_EQ(event.time_us, -20);
  EXPECT_TRUE(event.data.empty());
  ASSERT_TRUE(log.next(event).value());
  EXPECT_EQ(event.number, 2);
  EXPECT_EQ(event.time_us, INT64_MAX);
  EXPECT_EQ(event.channel.size(), 63U);
  EXPECT_EQ(event.data, std::vector<std::uint8_t>(300, 0xDA));
  EXPECT_FALSE(log.next(event).value());
  EXPECT_FALSE(log.next(event).value()) << "the end stays the end";
}

TEST(EventLog, SkimsAndSeeksToTheSameEvents) {
  test::TempDir dir;
  three_events(dir);
  auto log = EventLog::open(dir.file("three.lcm")).value();
  LogEvent event;
  std::uint32_t bytes = 0;
  ASSERT_TRUE(log.skim(event, bytes).value());
  ASSERT_TRUE(log.skim(event, bytes).value());
  EXPECT_EQ(bytes, 0U);
  ASSERT_TRUE(log.skim(event, bytes).value());
  EXPECT_EQ(bytes, 300U);
  const std::int64_t third = event.offset;
  EXPECT_FALSE(log.skim(event, bytes).value());
  ASSERT_TRUE(log.seek(third).ok());
  ASSERT_TRUE(log.next(event).value());
  EXPECT_EQ(event.number, 2);
  EXPECT_FALSE(log.seek(-1).ok());
  EXPECT_FALSE(log.seek(log.size() + 1).ok());
}

TEST(EventLog, CutAnywhereItGivesWholeEventsAndThenNamesFileAndByte) {
  // GIVEN a log of three events WHEN it ends at any byte THEN the events before are good and the error says where
  test::TempDir dir;
  const Bytes whole = three_events(dir);
  const std::string path = dir.file("cut.lcm");
  const std::size_t ends[] = {0, 28 + 4 + 5, 28 + 4 + 5 + 28 + 1, whole.size()};
  for (std::size_t n = 0; n <= whole.size(); ++n) {
    spill(path, whole.substr(0, n));
    const Read read = read_all(path);
    int expected = 0;
    while (expected < 3 && n >= ends[expected + 1]) ++expected;
    EXPECT_EQ(read.events, expected) << n;
    const bool between = n == ends[expected];
    ASSERT_EQ(read.error.has_value(), !between) << n;
    if (between) continue;
    EXPECT_EQ(read.error->code, ErrorCode::kTruncated) << n;
    EXPECT_EQ(read.error->message(), path + ": byte " + std::to_string(ends[expected]) + ": the file ends inside an event");
  }
}

TEST(EventLog, RefusesLengthsThatCannotBeWithoutTakingMemoryForThem) {
  // GIVEN lengths up to 4 GB in a file of a few hundred bytes THEN an error, and no buffer of that size
  test::TempDir dir;
  const Bytes whole = three_events(dir);
  const std::string path = dir.file("bad.lcm");
  for (const std::size_t at : {20, 24})
    for (const int high : {0x01, 0x02, 0x7F, 0x80, 0xFF}) {
      Bytes bad = whole;
      bad[at] = static_cast<char>(high);
      spill(path, bad);
      auto log = EventLog::open(path).value();
      LogEvent event;
      const auto more = log.next(event);
      ASSERT_FALSE(more.ok());
      EXPECT_NE(more.error().message().find("byte 0"), std::string::npos) << more.error().message();
      EXPECT_LE(event.data.capacity() + event.channel.capacity(), 1024U);
    }
}

TEST(EventLog, RefusesAnEmptyChannelName) {
  test::TempDir dir;
  Bytes bad = three_events(dir);
  std::memset(bad.data() + 20, 0, 4);
  spill(dir.file("bad.lcm"), bad);
  const Read read = read_all(dir.file("bad.lcm"));
  ASSERT_TRUE(read.error.has_value());
  EXPECT_EQ(read.error->code, ErrorCode::kCorrupt);
}

TEST(EventLog, SaysThatNoEventBeginsWhereTheSyncIsBroken) {
  test::TempDir dir;
  Bytes bad = three_events(dir);
  bad[28 + 4 + 5] ^= 1;
  spill(dir.file("bad.lcm"), bad);
  const Read read = read_all(dir.file("bad.lcm"));
  EXPECT_EQ(read.events, 1);
  ASSERT_TRUE(read.error.has_value());
  EXPECT_EQ(read.error->message(), dir.file("bad.lcm") + ": byte 37: no event begins here");
}

TEST(EventLog, SaysThatAFileIsNotThereOrIsNone) {
  test::TempDir dir;
  const auto absent = EventLog::open(dir.file("absent.lcm"));
  ASSERT_FALSE(absent.ok());
  EXPECT_EQ(absent.error().code, ErrorCode::kNotFound);
  const auto folder = EventLog::open(dir.path().string());
  ASSERT_FALSE(folder.ok());
  EXPECT_EQ(folder.error().message(), dir.path().string() + ": is not a file");
  EXPECT_FALSE(EventLogWriter::create(dir.file("no/such/folder.lcm")).ok());
}

TEST(EventLog, AFullDiskIsAnErrorOfItsOwn) {
  // GIVEN a device that is always full WHEN more is written than is held back THEN kFull, from write or at the latest from close
  auto log = EventLogWriter::create("/dev/full").value();
  const Bytes big(100'000, 'x');
  const auto written = log.write(0, "BIG", big.data(), big.size());
  ASSERT_FALSE(written.ok());
  EXPECT_EQ(written.error().code, ErrorCode::kFull);
  EXPECT_EQ(written.error().where, "/dev/full");

  auto small = EventLogWriter::create("/dev/full").value();
  ASSERT_TRUE(small.write(0, "SMALL", "x", 1).ok()) << "still in memory";
  const auto closed = small.close();
  ASSERT_FALSE(closed.ok());
  EXPECT_EQ(closed.error().code, ErrorCode::kFull);
  EXPECT_TRUE(small.close().ok()) << "closed is closed";
}

}  // namespace
}  // namespace cyclops::record
