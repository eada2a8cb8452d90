#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "test/support.hpp"
#include "wire/link_gate.hpp"

namespace cyclops {
namespace {

constexpr std::int64_t kUtc = 1'800'000'000'000'000'000;
constexpr std::int64_t kSecond = 1'000'000'000;
const char* const kHex = "000102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1d1e1f\n";

class Signed : public testing::Test {
 protected:
  Key key(const std::string& hex = kHex, mode_t mode = 0600) {
    auto k = load(hex, mode);
    EXPECT_TRUE(k.ok()) << (k.ok() ? "" : k.error().message());
    return *k;
  }
  Result<Key> load(const std::string& hex, mode_t mode) {
    std::ofstream(folder_.file("key")) << hex;
    ::chmod(folder_.file("key").c_str(), mode);
    return Key::load(folder_.file("key"));
  }
  static std::vector<std::uint8_t> copy(const Encoded& e) { return {e.data, e.data + e.size}; }

  test::TempDir folder_;
  std::vector<std::uint8_t> payload_{1, 2, 3, 4, 5};
};

using Bytes = std::vector<std::uint8_t>;

TEST_F(Signed, WhatWasSignedIsOpenedAndGivesThePayload) {
  Signer signer(key());
  Verifier verifier(key(), "TSPI_TANKER", Duration::from_seconds(2));
  const Bytes m = copy(signer.sign("TSPI_TANKER", payload_, kUtc));
  const auto inside = verifier.open(m.data(), m.size(), kUtc + kSecond);
  ASSERT_TRUE(inside.ok()) << inside.error().message();
  EXPECT_EQ(Bytes(inside->begin(), inside->end()), payload_);
}

TEST_F(Signed, EveryFlippedBitAndEveryCutIsRefused) {
  Signer signer(key());
  const Bytes good = copy(signer.sign("TSPI_TANKER", payload_, kUtc));
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    Verifier verifier(key(), "TSPI_TANKER", Duration::from_seconds(1e6));
    Bytes bad = good;
    bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1U << (bit % 8)));
    EXPECT_FALSE(verifier.open(bad.data(), bad.size(), kUtc).ok()) << bit;
  }
  for (std::size_t n = 0; n < good.size(); ++n) {
    Verifier verifier(key(), "TSPI_TANKER", Duration::from_seconds(2));
    const Bytes cut(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(n));
    EXPECT_FALSE(verifier.open(cut.data(), cut.size(), kUtc).ok()) << n;
  }
}

TEST_F(Signed, AnotherKeyAnotherChannelAndAnotherTimeAreRefused) {
  Verifier verifier(key(), "TSPI_TANKER", Duration::from_seconds(2));
  Signer foreign(key(std::string(64, 'a')));
  Bytes m = copy(foreign.sign("TSPI_TANKER", payload_, kUtc));
  EXPECT_EQ(verifier.open(m.data(), m.size(), kUtc).error().code, ErrorCode::kUnusable);
  Signer signer(key());
  m = copy(signer.sign("TSPI_RECEIVER", payload_, kUtc));
  EXPECT_NE(verifier.open(m.data(), m.size(), kUtc).error().what.find("not for this channel"), std::string::npos);
  for (const std::int64_t shift : {-3 * kSecond, 3 * kSecond}) {
    m = copy(Signer(key()).sign("TSPI_TANKER", payload_, kUtc));
    EXPECT_NE(verifier.open(m.data(), m.size(), kUtc + shift).error().what.find("not fresh"), std::string::npos);
  }
}

TEST_F(Signed, AReplayedMessageIsRefusedAndADisorderedOneIsNot) {
  Signer signer(key());
  std::vector<Bytes> sent;
  for (int i = 0; i < 200; ++i) sent.push_back(copy(signer.sign("TIME_MARK", payload_, kUtc + i)));
  Verifier verifier(key(), "TIME_MARK", Duration::from_seconds(2));
  const auto taken = [&](int i) { return verifier.open(sent[static_cast<std::size_t>(i)].data(), sent[static_cast<std::size_t>(i)].size(), kUtc).ok(); };
  for (int i = 0; i < 200; i += 2) EXPECT_TRUE(taken(i));
  for (int i = 0; i < 200; i += 2) EXPECT_FALSE(taken(i)) << "again " << i;
  EXPECT_TRUE(taken(199));
  EXPECT_TRUE(taken(151));    // late, but within the newest 64 and never seen
  EXPECT_FALSE(taken(151));
  EXPECT_FALSE(taken(1));     // never seen, but too old to know
}

TEST_F(Signed, ASenderWhoseClockStandsStillOrGoesBackIsStillTaken) {
  Signer signer(key());
  Verifier verifier(key(), "TIME_MARK", Duration::from_seconds(2));
  for (const std::int64_t t : {kUtc, kUtc, kUtc - kSecond}) {
    const Bytes m = copy(signer.sign("TIME_MARK", payload_, t));
    EXPECT_TRUE(verifier.open(m.data(), m.size(), kUtc).ok());
  }
}

TEST_F(Signed, AKeyFileThatOthersMayReadOrThatHoldsSomethingElseIsRefused) {
  EXPECT_TRUE(load(kHex, 0400).ok());
  EXPECT_NE(load(kHex, 0640).error().what.find("expected mode 600"), std::string::npos);
  EXPECT_NE(load(kHex, 0604).error().what.find("expected mode 600"), std::string::npos);
  for (const std::string& text : {std::string(), std::string(62, 'a'), std::string(66, 'a'), std::string(64, 'g'), std::string(64, 'a') + "\nx"})
    EXPECT_NE(load(text, 0600).error().what.find("64 hexadecimal digits"), std::string::npos) << text;
  EXPECT_EQ(Key::load(folder_.file("none")).error().code, ErrorCode::kNotFound);
  EXPECT_NE(Key::load(folder_.path().string()).error().what.find("not a plain file"), std::string::npos);
}

TEST_F(Signed, WithAKeyAPlainMessageIsRefusedAndAFloodOfThemLeavesRoomForSignedOnes) {
  LinkGateConfig config;
  config.rate_hz = 100;
  config.burst = 10;
  config.key = key();
  LinkGate gate("TIME_MARK", config);
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(gate.step(false, payload_.data(), payload_.size(), Time{i}, kUtc).ok());
  EXPECT_EQ(gate.counters().not_authentic, 10U);
  EXPECT_EQ(gate.counters().flooded, 990U);
  Signer signer(key());
  const Bytes m = copy(signer.sign("TIME_MARK", payload_, kUtc));
  EXPECT_TRUE(gate.step(true, m.data(), m.size(), Time{1000}, kUtc).ok());
  EXPECT_FALSE(gate.step(true, m.data(), m.size(), Time{1001}, kUtc).ok());
  EXPECT_EQ(gate.counters().replayed, 1U);
}

TEST(LinkGate, AFloodIsCutToTheRateAndEveryMessageIsCounted) {
  LinkGateConfig config;
  config.rate_hz = 500;
  config.burst = 500;
  LinkGate gate("TSPI_TANKER", config);
  const std::uint8_t byte = 0;
  std::uint64_t passed = 0;
  for (int i = 0; i < 100'000; ++i)  // 20 000 a second for 5 s
    passed += gate.step(false, &byte, 1, Time{i * 50'000LL}, kUtc).ok() ? 1 : 0;
  EXPECT_NEAR(static_cast<double>(passed), 500 + 5 * 500, 2);
  EXPECT_EQ(gate.counters().received, 100'000U);
  EXPECT_EQ(gate.counters().received, passed + gate.counters().flooded);
}

TEST(LinkGate, AfterAFloodAndAPauseThereIsRoomAgain) {
  RateLimit limit(10, 2);
  EXPECT_TRUE(limit.pass(Time{0}));
  EXPECT_TRUE(limit.pass(Time{0}));
  EXPECT_FALSE(limit.pass(Time{0}));
  EXPECT_FALSE(limit.pass(Time{-kSecond}));   // a clock that goes back gives nothing
  EXPECT_TRUE(limit.pass(Time{kSecond}));
}

}  // namespace
}  // namespace cyclops
