#include "record/flight.hpp"

#include <gtest/gtest.h>

#include <sys/resource.h>

#include <csignal>
#include <cstring>
#include <fstream>
#include <sstream>

#include "test/support.hpp"

namespace cyclops {
namespace {

namespace fs = std::filesystem;

using test::slurp;
using test::spill;
void change(const std::string& path, const std::string& from, const std::string& to) {
  std::string text = slurp(path);
  const auto at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  spill(path, text.replace(at, from.size(), to));
}

FlightFrame frame_of(std::vector<std::uint8_t>& pixels, std::uint64_t id, PixelFormat format, int stride) {
  FlightFrame f;
  f.camera_frame_id = id;
  f.camera_tick_ns = 1000 * static_cast<std::int64_t>(id);
  f.exposure = Duration{4'000'000};
  pixels.resize(static_cast<std::size_t>(stride) * 16);
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<std::uint8_t>(i * id);
  if (format != PixelFormat::kMono8)
    for (std::size_t i = 1; i < pixels.size(); i += 2) pixels[i] &= 0x0F;  // 12 bits a sample
  f.image = {pixels.data(), 16, 16, stride, format};
  return f;
}

/// Two frames and three messages; finished unless told not to be.
void write_flight(const std::string& folder, bool finished = true) {
  auto out = FlightWriter::create(folder, true).value();
  std::vector<std::uint8_t> pixels;
  EXPECT_EQ(out.frame(Time{1'000'000}, frame_of(pixels, 1, PixelFormat::kMono8, 16)).value(), 0);
  EXPECT_EQ(out.frame(Time{2'000'000}, frame_of(pixels, 2, PixelFormat::kMono12, 40)).value(), 1) << "rows with a gap behind them";
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(out.message(Time{1'000'000 * (i + 1)}, "TSPI_TANKER", "abc", static_cast<std::size_t>(i)).ok());
  EXPECT_TRUE(out.text("rig.toml", "# a rig\n").ok());
  if (!finished) return;
  FlightManifest m;
  m.name = "a \"quoted\" \\ name";
  m.origin = "recorded";
  m.source = "test";
  m.frames = 2;
  m.first_frame_ns = 500;
  m.last_frame_ns = 1'500'000;
  m.nav_every_n = 30;
  m.has_truth = true;
  EXPECT_TRUE(out.finish(m).ok());
}

Error open_error(const std::string& folder) {
  const auto r = FlightReader::open(folder);
  EXPECT_FALSE(r.ok());
  return r.ok() ? Error{} : r.error();
}

TEST(Flight, GivesBackItsManifest) {
  test::TempDir dir;
  write_flight(dir.file("f"));
  const auto flight = FlightReader::open(dir.file("f"));
  ASSERT_TRUE(flight.ok()) << flight.error().message();
  const FlightManifest& m = flight->manifest();
  EXPECT_EQ(m.name, "a \"quoted\" \\ name");
  EXPECT_EQ(m.origin, "recorded");
  EXPECT_EQ(m.frames, 2);
  EXPECT_EQ(m.first_frame_ns, 500);
  EXPECT_EQ(m.last_frame_ns, 1'500'000);
  EXPECT_EQ(m.nav_every_n, 30);
  EXPECT_TRUE(m.has_truth);
  EXPECT_EQ(m.files.size(), 3U);
  EXPECT_EQ(m.files.at("rig.toml"), 8);
}

TEST(Flight, GivesBackPixelsBitForBitInAnyOrder) {
  test::TempDir dir;
  write_flight(dir.file("f"));
  auto flight = FlightReader::open(dir.file("f")).value();
  std::vector<std::uint8_t> memory, expected;
  for (const std::int64_t n : {1, 0, 1}) {
    FlightFrame frame;
    ASSERT_TRUE(flight.frame(n, memory, frame).ok());
    const FlightFrame was = n == 0 ? frame_of(expected, 1, PixelFormat::kMono8, 16) : frame_of(expected, 2, PixelFormat::kMono12, 40);
    EXPECT_EQ(frame.camera_frame_id, was.camera_frame_id);
    EXPECT_EQ(frame.camera_tick_ns, was.camera_tick_ns);
    EXPECT_EQ(frame.exposure, was.exposure);
    ASSERT_EQ(frame.image.format, was.image.format);
    ASSERT_EQ(frame.image.width, 16);
    for (int v = 0; v < 16; ++v)
      EXPECT_EQ(std::memcmp(frame.image.row8(v), was.image.row8(v), n == 0 ? 16 : 32), 0) << "row " << v;
  }
  FlightFrame frame;
  EXPECT_EQ(flight.frame(2, memory, frame).error().message(), dir.file("f/frames.lcm") + ": has no event 2, expected 0 to 1");
  EXPECT_FALSE(flight.frame(-1, memory, frame).ok());
}

TEST(Flight, SeeksToTheFirstMessageAtOrAfterATime) {
  test::TempDir dir;
  write_flight(dir.file("f"));
  auto flight = FlightReader::open(dir.file("f")).value();
  record::LogEvent event;
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(flight.next(event).value());
  EXPECT_FALSE(flight.next(event).value());
  ASSERT_TRUE(flight.seek(Time{1'500'000}).ok());
  ASSERT_TRUE(flight.next(event).value());
  EXPECT_EQ(event.time_us, 2000);
  ASSERT_TRUE(flight.seek(Time{9'000'000}).ok());
  EXPECT_FALSE(flight.next(event).value());
  ASSERT_TRUE(flight.rewind().ok());
  ASSERT_TRUE(flight.next(event).value());
  EXPECT_EQ(event.time_us, 1000);
}

TEST(Flight, OneThatWasNotFinishedIsNone) {
  test::TempDir dir;
  write_flight(dir.file("f"), false);
  EXPECT_EQ(open_error(dir.file("f")).message(), dir.file("f") + ": is no flight: manifest.toml is missing (a flight that was not finished has none)");
  EXPECT_EQ(open_error(dir.file("nowhere")).code, ErrorCode::kNotFound);
}

TEST(Flight, IsNotWrittenOverUnlessWanted) {
  test::TempDir dir;
  write_flight(dir.file("f"));
  EXPECT_EQ(FlightWriter::create(dir.file("f"), false).error().message(), dir.file("f") + ": is a flight already");
  ASSERT_TRUE(FlightWriter::create(dir.file("f"), true).ok());
  EXPECT_TRUE(FlightReader::open(dir.file("f")).ok()) << "the old one stays until the new one is whole";
  EXPECT_FALSE(fs::exists(dir.file("f.part"))) << "what was not finished is removed";
  write_flight(dir.file("f"));
  EXPECT_TRUE(FlightReader::open(dir.file("f")).ok());
  EXPECT_FALSE(fs::exists(dir.file("f.old")));
}

TEST(Flight, NeverTakesThePlaceOfAFolderThatHoldsOtherFiles) {
  test::TempDir dir;
  fs::create_directories(dir.file("home"));
  spill(dir.file("home/letter.doc"), "dear");
  const auto refused = FlightWriter::create(dir.file("home"), true);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message().find("holds letter.doc, which is no file of a flight"), std::string::npos) << refused.error().message();
  EXPECT_EQ(slurp(dir.file("home/letter.doc")), "dear");
}

TEST(Flight, CanShareTheFramesOfAnother) {
  test::TempDir dir;
  write_flight(dir.file("f"));
  {
    auto out = FlightWriter::create(dir.file("g"), false, dir.file("f/frames.lcm")).value();
    ASSERT_TRUE(out.text("rig.toml", "# a rig\n").ok());
    FlightManifest m;
    m.frames = 2;
    ASSERT_TRUE(out.finish(m).ok());
  }
  EXPECT_TRUE(fs::equivalent(dir.file("f/frames.lcm"), dir.file("g/frames.lcm")));
  fs::remove_all(dir.file("f"));
  auto flight = FlightReader::open(dir.file("g")).value();
  std::vector<std::uint8_t> memory;
  FlightFrame frame;
  EXPECT_TRUE(flight.frame(1, memory, frame).ok());
}

TEST(Flight, AFileThatMayNotGrowIsNamedWithTheReasonAndNothingStays) {
  test::TempDir dir;
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  rlimit small = before;
  small.rlim_cur = 20000;
  std::string why;
  {
    auto out = FlightWriter::create(dir.file("f"), true).value();
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    const std::vector<char> much(6000);
    for (int i = 0; i < 10 && why.empty(); ++i)
      if (const auto said = out.message(Time{0}, "TSPI_TANKER", much.data(), much.size()); !said.ok()) why = said.error().message();
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  }
  std::signal(SIGXFSZ, old_handler);
  EXPECT_NE(why.find("messages.lcm: cannot be written: File too large"), std::string::npos) << why;
  EXPECT_TRUE(fs::is_empty(dir.path()));
}

TEST(Flight, RefusesAFileOfAnotherSizeAndNamesBothSizes) {
  test::TempDir dir;
  write_flight(dir.file("f"));
  const std::string rig = dir.file("f/rig.toml"), messages = dir.file("f/messages.lcm");
  spill(rig, "# a rig and more\n");
  EXPECT_EQ(open_error(dir.file("f")).message(), rig + ": has 17 bytes, expected 8 by manifest.toml");
  spill(rig, "# a rig\n");
  fs::resize_file(messages, fs::file_size(messages) - 1);
  EXPECT_EQ(open_error(dir.file("f")).code, ErrorCode::kTruncated);
}

TEST(Flight, RefusesAFolderInWhichAListedFileIsMissing) {
  test::TempDir dir;
  write_flight(dir.file("f"));
  fs::remove(dir.file("f/rig.toml"));
  const Error e = open_error(dir.file("f"));
  EXPECT_EQ(e.code, ErrorCode::kNotFound);
  EXPECT_NE(e.message().find("rig.toml"), std::string::npos) << e.message();
}

TEST(Flight, RefusesAManifestThatDoesNotFit) {
  test::TempDir dir;
  const std::string manifest = dir.file("f/manifest.toml");
  const std::pair<const char*, const char*> wrong[] = {
      {"cyclops-flight-1", "cyclops-flight-9"}, {"frames = 2", "frames = 3"},        {"frames = 2", "frames = -2"},
      {"frames = 2", "fames = 2"},              {"nav_every_n = 30", "nav_every_n = 0"}, {"has_truth = true", "has_truth = 7"},
      {"[files]", "[flies]"},                   {"\"messages.lcm\" = ", "\"massages.lcm\" = "}};
  for (const auto& [from, to] : wrong) {
    write_flight(dir.file("f"));
    change(manifest, from, to);
    const Error e = open_error(dir.file("f"));
    EXPECT_NE(e.message().find(dir.file("f")), std::string::npos) << to << ": " << e.message();
    EXPECT_FALSE(e.what.empty()) << to;
  }
}

TEST(Flight, RefusesAManifestCutAnywhere) {
  // GIVEN a manifest that ends at any byte before its last line is complete THEN an error, never a flight with less in it
  test::TempDir dir;
  write_flight(dir.file("f"));
  const std::string manifest = dir.file("f/manifest.toml"), whole = slurp(manifest);
  for (std::size_t n = 0; n + 2 < whole.size(); ++n) {
    spill(manifest, whole.substr(0, n));
    EXPECT_FALSE(FlightReader::open(dir.file("f")).ok()) << n << ": " << whole.substr(0, n);
  }
}

TEST(Flight, NamesTheEventWhoseFrameIsCorrupt) {
  test::TempDir dir;
  write_flight(dir.file("f"));
  std::string bytes = slurp(dir.file("f/frames.lcm"));
  bytes[28 + 10] ^= 0x55;  // the message's fingerprint, behind the event's head and its channel
  spill(dir.file("f/frames.lcm"), bytes);
  auto flight = FlightReader::open(dir.file("f")).value();
  std::vector<std::uint8_t> memory;
  FlightFrame frame;
  const auto read = flight.frame(0, memory, frame);
  ASSERT_FALSE(read.ok());
  EXPECT_NE(read.error().message().find("frames.lcm: event 0"), std::string::npos) << read.error().message();
  EXPECT_TRUE(flight.frame(1, memory, frame).ok()) << "the next one is whole";
}

TEST(Flight, AFullDiskEndsItWithAnErrorAndLeavesNoFlight) {
  // GIVEN a folder whose log lies on a device that is always full
  test::TempDir dir;
  auto out = FlightWriter::create(dir.file("f"), true).value();
  fs::create_symlink("/dev/full", out.path("rig.toml.part"));
  // WHEN a file is written THEN kFull
  const auto text = out.text("rig.toml", "# a rig\n");
  ASSERT_FALSE(text.ok());
  EXPECT_EQ(text.error().code, ErrorCode::kFull);
  EXPECT_FALSE(fs::exists(out.path("rig.toml")));
  // AND the manifest likewise
  fs::create_symlink("/dev/full", out.path("manifest.toml.part"));
  const auto done = out.finish({});
  ASSERT_FALSE(done.ok());
  EXPECT_EQ(done.error().code, ErrorCode::kFull);
  EXPECT_EQ(open_error(dir.file("f")).code, ErrorCode::kNotFound);
}

TEST(Flight, WithoutARigIsNone) {
  test::TempDir dir;
  auto out = FlightWriter::create(dir.file("f"), true).value();
  ASSERT_TRUE(out.finish({}).ok());
  EXPECT_EQ(open_error(dir.file("f")).message(), dir.file("f/manifest.toml") + ": does not list rig.toml");
}

}  // namespace
}  // namespace cyclops
