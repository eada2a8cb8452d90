#include "record/log_stream.hpp"

#include <gtest/gtest.h>

#include <sys/uio.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <sstream>

#include "record/event_buffer.hpp"
#include "record/scan.hpp"
#include "test/support.hpp"

namespace cyclops::record {
namespace {

namespace fs = std::filesystem;

using test::slurp;
using test::spill;

/// Writes events of 100 bytes on channel DATA, n at a time.
class Feeder {
 public:
  explicit Feeder(const LogStreamConfig& config) : stream_(LogStream::create(config).value()) {}
  Result<> events(int n, Time now = Time{1}) {
    for (int i = 0; i < n; ++i) {
      const std::vector<std::uint8_t> data(100, static_cast<std::uint8_t>(number_++));
      buffer_.append(now.ns / 1000, "DATA", data.data(), data.size());
    }
    return stream_->write(now, {buffer_.take().bytes});
  }
  LogStream& stream() { return *stream_; }

 private:
  EventBuffer buffer_{1 << 20};
  std::unique_ptr<LogStream> stream_;
  int number_{0};
};

LogStreamConfig config_in(const test::TempDir& dir) {
  LogStreamConfig c;
  c.folder = dir.path().string();
  c.name = "log";
  c.seal_bytes = 1000;
  return c;
}

std::vector<std::int64_t> numbers_in(const std::string& path, LogScan* scan = nullptr) {
  std::vector<std::int64_t> out;
  const auto s = scan_log(path, [&](const LogEvent& e) { out.push_back(e.number); });
  EXPECT_TRUE(s.ok());
  if (scan != nullptr && s.ok()) *scan = *s;
  return out;
}

TEST(EventBuffer, LeavesOutTheNumberOfAnEventThatFoundNoRoom) {
  // GIVEN room for two events of 100 bytes and a little WHEN three come, then one after the writer has been there
  EventBuffer buffer(2 * (kEventHeadBytes + 4 + 100) + kMaxChannelBytes);
  const std::vector<std::uint8_t> data(100);
  EXPECT_TRUE(buffer.append(1, "DATA", data.data(), data.size()));
  EXPECT_TRUE(buffer.append(2, "DATA", data.data(), data.size()));
  EXPECT_FALSE(buffer.append(3, "DATA", data.data(), data.size()));
  const auto first = buffer.take();
  EXPECT_EQ(first.events, 2U);
  EXPECT_TRUE(buffer.append(4, "DATA", data.data(), data.size()));
  // THEN number 2 is missing in the log, and counted
  test::TempDir dir;
  std::string all(first.bytes.begin(), first.bytes.end());
  const auto second = buffer.take();
  all.append(second.bytes.begin(), second.bytes.end());
  spill(dir.file("log.lcm"), all);
  EXPECT_EQ(numbers_in(dir.file("log.lcm")), (std::vector<std::int64_t>{0, 1, 3}));
  EXPECT_EQ(buffer.refused(), 1U);
  EXPECT_TRUE(buffer.take().bytes.empty());
}

TEST(EventBuffer, TakesNoMemoryPerEvent) {
  EventBuffer buffer(4096);
  const std::vector<std::uint8_t> data(100);
  const test::HeapGuard guard;
  for (int i = 0; i < 100; ++i) {
    buffer.append(i, "DATA", data.data(), data.size());
    if (i % 10 == 0) (void)buffer.take();
  }
  EXPECT_EQ(guard.count(), 0U);
}

TEST(LogStream, SplitsBetweenEventsBySizeAndByTime) {
  test::TempDir dir;
  LogStreamConfig config = config_in(dir);
  config.split_bytes = 1000;
  config.split_time = Duration::from_seconds(10);
  Feeder feed(config);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(feed.events(5, Time{1'000'000'000}).ok());   // two fill a part
  ASSERT_TRUE(feed.events(1, Time{20'000'000'000}).ok());                                 // the next is too old
  ASSERT_TRUE(feed.stream().close(Time{20'000'000'000}).ok());
  EXPECT_EQ(feed.stream().files().size(), 3U);
  std::vector<std::int64_t> all;
  for (const char* name : {"log.lcm", "log.001.lcm", "log.002.lcm"}) {
    LogScan scan;
    const auto part = numbers_in(dir.file(name), &scan);
    all.insert(all.end(), part.begin(), part.end());
    EXPECT_TRUE(scan.unreadable.empty() && scan.damaged.empty() && scan.tail_bytes == 0) << name;
    EXPECT_GT(scan.seals, 0) << name;
    EXPECT_EQ(feed.stream().files().at(name), scan.bytes);
  }
  ASSERT_EQ(all.size(), 16U);
  for (std::size_t i = 0; i < all.size(); ++i) EXPECT_EQ(all[i], static_cast<std::int64_t>(i));
}

TEST(LogStream, NeverWritesOverAFile) {
  test::TempDir dir;
  spill(dir.file("log.lcm"), "dear");
  EXPECT_FALSE(LogStream::create(config_in(dir)).ok());
  EXPECT_EQ(slurp(dir.file("log.lcm")), "dear");
}

TEST(LogStream, LeavesNoPartOfAnEventBehindWhenTheDiskIsFullAndGoesOnWhenItIsNot) {
  // GIVEN a disk that takes 500 bytes, then nothing, then everything again
  test::TempDir dir;
  LogStreamConfig config = config_in(dir);
  config.seal_bytes = 1 << 30;
  std::int64_t room = 500;
  config.write = [&room](int fd, const iovec* v, int n) -> ssize_t {
    if (room <= 0) {
      errno = ENOSPC;
      return -1;
    }
    iovec first = v[0];
    first.iov_len = std::min<std::size_t>(first.iov_len, static_cast<std::size_t>(room));
    const ssize_t done = room > 10'000 ? ::writev(fd, v, n) : ::writev(fd, &first, 1);
    room -= done;
    return done;
  };
  Feeder feed(config);
  ASSERT_TRUE(feed.events(2).ok());
  // WHEN three more do not fit THEN kFull, and the file ends with the second event
  const auto full = feed.events(3);
  ASSERT_FALSE(full.ok());
  EXPECT_EQ(full.error().code, ErrorCode::kFull);
  EXPECT_EQ(numbers_in(dir.file("log.lcm")), (std::vector<std::int64_t>{0, 1}));
  // AND with room again it goes on; the seal is right for what is there
  room = 1 << 20;
  ASSERT_TRUE(feed.events(1).ok());
  ASSERT_TRUE(feed.stream().close(Time{2}).ok());
  LogScan scan;
  EXPECT_EQ(numbers_in(dir.file("log.lcm"), &scan), (std::vector<std::int64_t>{0, 1, 5}));
  EXPECT_TRUE(scan.damaged.empty() && scan.unreadable.empty() && scan.tail_bytes == 0);
  EXPECT_EQ(scan.seals, 1);
}

TEST(LogStream, WritesEverythingToADiskThatTakesAFewBytesAtATime) {
  test::TempDir dir;
  LogStreamConfig config = config_in(dir);
  int call = 0;
  config.write = [&call](int fd, const iovec* v, int) -> ssize_t {
    if (++call % 3 == 0) {
      errno = EINTR;
      return -1;
    }
    return ::write(fd, v[0].iov_base, std::min<std::size_t>(v[0].iov_len, 7));
  };
  Feeder feed(config);
  ASSERT_TRUE(feed.events(20).ok());
  ASSERT_TRUE(feed.stream().close(Time{2}).ok());
  LogScan scan;
  EXPECT_EQ(numbers_in(dir.file("log.lcm"), &scan).size(), 20U);
  EXPECT_TRUE(scan.damaged.empty() && scan.unreadable.empty());
  EXPECT_GT(scan.seals, 0);
}

/// A sealed log of 30 events.
std::string sealed_log(const test::TempDir& dir) {
  Feeder feed(config_in(dir));
  for (int i = 0; i < 6; ++i) EXPECT_TRUE(feed.events(5).ok());
  EXPECT_TRUE(feed.stream().close(Time{2}).ok());
  return slurp(dir.file("log.lcm"));
}

TEST(ScanLog, FindsEveryWholeEventInAFileCutAtAnyByte) {
  test::TempDir dir;
  const std::string whole = sealed_log(dir);
  const std::string cut = dir.file("cut.lcm");
  std::vector<std::int64_t> ends;   // of events and seals
  auto log = EventLog::open(dir.file("log.lcm")).value();
  LogEvent e;
  std::vector<bool> is_seal;
  while (log.next(e).value()) {
    ends.push_back(e.offset + static_cast<std::int64_t>(kEventHeadBytes + e.channel.size() + e.data.size()));
    is_seal.push_back(e.channel == "SEAL");
  }
  for (std::size_t n = 0; n < whole.size(); n += 3) {
    spill(cut, whole.substr(0, n));
    LogScan scan;
    const auto found = numbers_in(cut, &scan);
    std::int64_t expected = 0, end = 0;
    for (std::size_t i = 0; i < ends.size() && ends[i] <= static_cast<std::int64_t>(n); ++i) {
      expected += is_seal[i] ? 0 : 1;
      end = ends[i];
    }
    ASSERT_EQ(static_cast<std::int64_t>(found.size()), expected) << n;
    ASSERT_EQ(scan.tail_bytes, static_cast<std::int64_t>(n) - end) << n;
    ASSERT_TRUE(scan.damaged.empty() && scan.unreadable.empty()) << n;
  }
}

TEST(ScanLog, FindsAnyFlippedByte) {
  // GIVEN one wrong byte anywhere before the last seal THEN its piece is damaged, or no event begins there; all others are found
  test::TempDir dir;
  const std::string whole = sealed_log(dir);
  const std::string bad = dir.file("bad.lcm");
  LogScan good;
  (void)numbers_in(dir.file("log.lcm"), &good);
  ASSERT_GT(good.seals, 2);
  for (std::int64_t at = 0; at < good.sealed_to; at += 7) {
    std::string bytes = whole;
    bytes[static_cast<std::size_t>(at)] = static_cast<char>(bytes[static_cast<std::size_t>(at)] ^ 0x10);
    spill(bad, bytes);
    LogScan scan;
    const auto found = numbers_in(bad, &scan);
    ASSERT_FALSE(scan.damaged.empty() && scan.unreadable.empty()) << "byte " << at;
    ASSERT_GE(found.size(), 29U) << "byte " << at;
    for (const Range& r : scan.damaged) ASSERT_LE(r.to - r.from, 1500) << "byte " << at;
  }
}

TEST(ScanLog, FindsTheNextEventBehindBytesThatAreNone) {
  test::TempDir dir;
  const std::string whole = sealed_log(dir);
  const std::string event = whole.substr(0, kEventHeadBytes + 4 + 100);
  spill(dir.file("bad.lcm"), event + std::string(200'000, 'x') + event);
  LogScan scan;
  EXPECT_EQ(numbers_in(dir.file("bad.lcm"), &scan).size(), 2U);
  ASSERT_EQ(scan.unreadable.size(), 1U);
  EXPECT_EQ(scan.unreadable[0].from, static_cast<std::int64_t>(event.size()));
  EXPECT_EQ(scan.unreadable[0].to, static_cast<std::int64_t>(event.size()) + 200'000);
}

}  // namespace
}  // namespace cyclops::record
