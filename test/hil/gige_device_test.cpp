// The control protocol of the bench camera, byte by byte, without a socket.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>

#include "hil/gige_registers.hpp"
#include "hil/gige_xml.hpp"
#include "test/support.hpp"

namespace cyclops::hil {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr GvcpPeer kClient{0x7f000001, 40000}, kOther{0x7f000001, 40001}, kElsewhere{0x7f000063, 40000};
constexpr std::int64_t kSecond = 1'000'000'000;

Bytes words(std::initializer_list<std::uint32_t> values) {
  Bytes out;
  for (std::uint32_t v : values) {
    out.resize(out.size() + 4);
    put_be32(&out[out.size() - 4], v);
  }
  return out;
}
Bytes command(GvcpCommand c, const Bytes& body, std::uint8_t flags = 1) {
  Bytes out(kGvcpHeader + body.size());
  std::copy(body.begin(), body.end(), out.begin() + kGvcpHeader);
  out[0] = 0x42;
  out[1] = flags;
  put_be16(&out[2], static_cast<std::uint16_t>(c));
  put_be16(&out[4], static_cast<std::uint16_t>(body.size()));
  put_be16(&out[6], 77);
  return out;
}

class Gvcp : public ::testing::Test {
 protected:
  GvcpReply ask(const Bytes& packet, GvcpPeer peer = kClient) { return handle_gvcp(registers, packet, peer, now_ns, tick); }
  GvcpReply write(std::uint32_t address, std::uint32_t value, GvcpPeer peer = kClient) {
    return ask(command(GvcpCommand::kWriteRegister, words({address, value})), peer);
  }
  std::uint32_t read(std::uint32_t address) {
    const GvcpReply r = ask(command(GvcpCommand::kReadRegister, words({address})));
    EXPECT_EQ(r.status, GvcpStatus::kSuccess);
    return r.bytes.size() == 12 ? get_be32(&r.bytes[8]) : 0xdeadbeef;
  }
  void take_control() { ASSERT_EQ(write(reg::kControl, 2).status, GvcpStatus::kSuccess); }
  void start() {
    take_control();
    ASSERT_EQ(write(reg::kStreamAddress, 0x7f000001).status, GvcpStatus::kSuccess);
    ASSERT_EQ(write(reg::kStreamPort, 5000).status, GvcpStatus::kSuccess);
    ASSERT_EQ(write(reg::kAcquisition, 1).status, GvcpStatus::kSuccess);
  }
  GigeConfig config;
  GigeRegisters registers{config, 0x7f000001};
  std::int64_t now_ns{kSecond};
  std::uint64_t tick{0x1122334455667788ULL};
};

TEST_F(Gvcp, AnswersDiscoveryWithNamesAndAddress) {
  const GvcpReply r = ask(command(GvcpCommand::kDiscovery, {}));
  ASSERT_EQ(r.bytes.size(), kGvcpHeader + kDiscoveryBytes);
  EXPECT_EQ(get_be16(&r.bytes[0]), 0);
  EXPECT_EQ(get_be16(&r.bytes[2]), 0x03);
  EXPECT_EQ(get_be16(&r.bytes[6]), 77);
  EXPECT_EQ(get_be32(&r.bytes[8 + 0x24]), 0x7f000001U);
  EXPECT_STREQ(reinterpret_cast<const char*>(&r.bytes[8 + 0x48]), "Cyclops");
  EXPECT_STREQ(reinterpret_cast<const char*>(&r.bytes[8 + 0xd8]), "CYC0001");
}

TEST_F(Gvcp, ReadsSeveralRegistersAtOnce) {
  const GvcpReply r = ask(command(GvcpCommand::kReadRegister, words({reg::kWidth, reg::kHeight, reg::kPayload})));
  ASSERT_EQ(r.bytes.size(), 20U);
  EXPECT_EQ(get_be32(&r.bytes[8]), 1024U);
  EXPECT_EQ(get_be32(&r.bytes[16]), 1024U * 1024U);
}

TEST_F(Gvcp, OffersItsDescriptionWhereTheUrlSays) {
  GvcpReply r = ask(command(GvcpCommand::kReadMemory, words({reg::kXmlUrl, 64})));
  ASSERT_EQ(r.bytes.size(), 8U + 4 + 64);
  const std::string url = reinterpret_cast<const char*>(&r.bytes[12]);
  unsigned address = 0, size = 0;
  ASSERT_EQ(std::sscanf(url.c_str(), "Local:camera.xml;%x;%x", &address, &size), 2) << url;
  std::string text;
  while (text.size() < size) {
    const auto n = std::min<std::uint32_t>(512, size - static_cast<std::uint32_t>(text.size()));
    r = ask(command(GvcpCommand::kReadMemory, words({address + static_cast<std::uint32_t>(text.size()), n})));
    ASSERT_EQ(r.status, GvcpStatus::kSuccess);
    text.append(reinterpret_cast<const char*>(&r.bytes[12]), n);
  }
  EXPECT_EQ(text.substr(0, gige_xml(config).size()), gige_xml(config));
}

TEST_F(Gvcp, LetsOnlyTheControllerWrite) {
  EXPECT_EQ(write(reg::kWidth, 640).status, GvcpStatus::kAccessDenied);
  take_control();
  EXPECT_EQ(write(reg::kWidth, 640).status, GvcpStatus::kSuccess);
  EXPECT_EQ(write(reg::kWidth, 641, kOther).status, GvcpStatus::kAccessDenied);
  EXPECT_EQ(write(reg::kControl, 2, kOther).status, GvcpStatus::kAccessDenied);
  EXPECT_EQ(read(reg::kWidth), 640U);
  EXPECT_EQ(read(reg::kPayload), 640U * 1024U);
}

TEST_F(Gvcp, HidesEverythingButDiscoveryUnderExclusiveAccess) {
  ASSERT_EQ(write(reg::kControl, 1).status, GvcpStatus::kSuccess);
  EXPECT_EQ(ask(command(GvcpCommand::kReadRegister, words({reg::kWidth})), kOther).status, GvcpStatus::kAccessDenied);
  EXPECT_EQ(ask(command(GvcpCommand::kDiscovery, {}), kOther).status, GvcpStatus::kSuccess);
}

TEST_F(Gvcp, EndsControlAndStreamWhenTheControllerFallsSilent) {
  start();
  now_ns += 2 * kSecond;
  EXPECT_EQ(read(reg::kWidth), 1024U);  // any command of the controller is a heartbeat
  now_ns += 2 * kSecond;
  EXPECT_FALSE(registers.expire(now_ns));
  now_ns += 2 * kSecond;
  EXPECT_TRUE(registers.expire(now_ns));
  EXPECT_FALSE(registers.acquiring());
  EXPECT_EQ(registers.target().port, 0);
  EXPECT_EQ(write(reg::kControl, 2, kOther).status, GvcpStatus::kSuccess);
}

TEST_F(Gvcp, RefusesValuesOutOfRange) {
  take_control();
  const std::uint32_t nan = 0x7fc00000, negative = std::bit_cast<std::uint32_t>(-1.0F);
  for (const auto& [address, value] : std::initializer_list<std::pair<std::uint32_t, std::uint32_t>>{
           {reg::kWidth, 0}, {reg::kWidth, 4097}, {reg::kHeight, 0xffffffff}, {reg::kPixelFormat, 0x01080009}, {reg::kOffsetX, 8},
           {reg::kExposure, nan}, {reg::kExposure, negative}, {reg::kFrameRate, 0}, {reg::kHeartbeat, 10}, {reg::kPacketSize, 64},
           {reg::kPacketSize, 9004}, {reg::kPacketSize, 1501}, {reg::kStreamPort, 70000}, {reg::kAcquisition, 2}, {reg::kControl, 8},
           {reg::kLineSelector, 2}, {reg::kTimestampControl, 1}})
    EXPECT_EQ(write(address, value).status, GvcpStatus::kInvalidParameter) << std::hex << address << " = " << value;
}

TEST_F(Gvcp, SendsOnlyToLocalAddresses) {
  take_control();
  for (std::uint32_t outside : {0x08080808U, 0xe0000001U, 0xffffffffU, 0xac200001U})
    EXPECT_EQ(write(reg::kStreamAddress, outside).status, GvcpStatus::kInvalidParameter);
  for (std::uint32_t inside : {0x7f000001U, 0x0a000001U, 0xac100001U, 0xc0a80001U, 0xa9fe0001U})
    EXPECT_EQ(write(reg::kStreamAddress, inside).status, GvcpStatus::kSuccess);
}

TEST_F(Gvcp, KeepsSizeAndFormatWhileItStreams) {
  start();
  EXPECT_EQ(write(reg::kWidth, 640).status, GvcpStatus::kBusy);
  EXPECT_EQ(write(reg::kPacketSize, 1500).status, GvcpStatus::kBusy);
  EXPECT_EQ(write(reg::kWidth, 1024).status, GvcpStatus::kSuccess);
  const GvcpReply stopped = write(reg::kStreamPort, 0);
  EXPECT_TRUE(stopped.effects.acquisition_changed);
  EXPECT_FALSE(registers.acquiring());
}

TEST_F(Gvcp, DoesNotStartWithoutADestination) {
  take_control();
  EXPECT_EQ(write(reg::kAcquisition, 1).status, GvcpStatus::kBusy);
}

TEST_F(Gvcp, LatchesItsClock) {
  take_control();
  ASSERT_EQ(write(reg::kTimestampControl, 2).status, GvcpStatus::kSuccess);
  const GvcpReply r = ask(command(GvcpCommand::kReadMemory, words({reg::kLatchHigh, 8})));
  ASSERT_EQ(r.bytes.size(), 20U);
  EXPECT_EQ(get_be64(&r.bytes[12]), tick);
}

TEST_F(Gvcp, FiresATestPacketOnceAndForgetsTheBit) {
  take_control();
  const GvcpReply r = write(reg::kPacketSize, 0xc0000000U | 8000U);
  EXPECT_TRUE(r.effects.fire_test_packet);
  EXPECT_EQ(read(reg::kPacketSize), 0x40000000U | 8000U);
}

TEST_F(Gvcp, TellsHowFarABatchOfWritesGot) {
  take_control();
  const GvcpReply r = ask(command(GvcpCommand::kWriteRegister, words({reg::kWidth, 640, reg::kHeight, 0, reg::kExposure, 0})));
  EXPECT_EQ(r.status, GvcpStatus::kInvalidParameter);
  ASSERT_EQ(r.bytes.size(), 12U);
  EXPECT_EQ(get_be32(&r.bytes[8]), 1U);
  EXPECT_EQ(read(reg::kWidth), 640U);
}

TEST_F(Gvcp, WritesMemoryWordByWord) {
  take_control();
  const GvcpReply r = ask(command(GvcpCommand::kWriteMemory, words({reg::kWidth, 800, 600})));
  EXPECT_EQ(r.status, GvcpStatus::kSuccess);
  EXPECT_EQ(read(reg::kHeight), 600U);
  EXPECT_EQ(ask(command(GvcpCommand::kWriteMemory, words({reg::kXml, 0}))).status, GvcpStatus::kWriteProtect);
  EXPECT_EQ(ask(command(GvcpCommand::kWriteMemory, words({0xfffffffc, 0, 0}))).status, GvcpStatus::kInvalidAddress);
}

TEST_F(Gvcp, TakesResendRequestsOfBothIdLengths) {
  start();
  GvcpReply r = ask(command(GvcpCommand::kPacketResend, words({0x00001234, 0xff000005, 9}), 0), kOther);
  ASSERT_TRUE(r.effects.resend.has_value());
  EXPECT_EQ(r.effects.resend->block_id, 0x1234U);
  EXPECT_EQ(r.effects.resend->first, 5U);
  EXPECT_TRUE(r.bytes.empty());
  r = ask(command(GvcpCommand::kPacketResend, words({0, 5, 9, 0x12, 0x3456789a}), 0x10), kOther);
  ASSERT_TRUE(r.effects.resend.has_value());
  EXPECT_EQ(r.effects.resend->block_id, 0x123456789aULL);
  EXPECT_TRUE(r.effects.resend->extended);
}

TEST_F(Gvcp, TakesResendRequestsOnlyFromTheHostInControl) {
  const Bytes request = command(GvcpCommand::kPacketResend, words({1, 0, 9}), 0);
  EXPECT_FALSE(ask(request).effects.resend.has_value());
  start();
  EXPECT_FALSE(ask(request, kElsewhere).effects.resend.has_value());
  EXPECT_TRUE(ask(request, kClient).effects.resend.has_value());
}

TEST_F(Gvcp, CountsAndAnswersMalformedCommands) {
  take_control();
  Bytes wrong_length = command(GvcpCommand::kReadRegister, words({0}));
  put_be16(&wrong_length[4], 400);
  Bytes no_id = command(GvcpCommand::kReadRegister, words({0}));
  put_be16(&no_id[6], 0);
  const Bytes cases[] = {wrong_length,
                         no_id,
                         command(GvcpCommand::kReadRegister, {}),
                         command(GvcpCommand::kReadRegister, Bytes(6)),
                         command(GvcpCommand::kReadRegister, Bytes(1400)),
                         command(GvcpCommand::kWriteRegister, Bytes(4)),
                         command(GvcpCommand::kWriteRegister, Bytes(12)),
                         command(GvcpCommand::kReadMemory, Bytes(4)),
                         command(GvcpCommand::kReadMemory, words({0, 0})),
                         command(GvcpCommand::kReadMemory, words({0, 0xffff})),
                         command(GvcpCommand::kWriteMemory, Bytes(4)),
                         command(GvcpCommand::kPacketResend, Bytes(8)),
                         command(GvcpCommand::kPacketResend, words({0x00010001, 0, 1})),  // another channel
                         command(GvcpCommand::kPacketResend, words({1, 9, 5})),           // backwards
                         command(GvcpCommand::kDiscovery, Bytes(4))};
  for (const Bytes& c : cases) {
    const GvcpReply r = ask(c);
    EXPECT_TRUE(r.malformed);
    EXPECT_NE(r.status, GvcpStatus::kSuccess);
    EXPECT_FALSE(r.bytes.empty());
  }
}

TEST_F(Gvcp, AnswersWhatItDoesNotKnowWithAStatus) {
  EXPECT_EQ(ask(command(static_cast<GvcpCommand>(0x100), {})).status, GvcpStatus::kNotImplemented);
  EXPECT_EQ(ask(command(GvcpCommand::kReadRegister, words({0x9000}))).status, GvcpStatus::kInvalidAddress);
  EXPECT_EQ(ask(command(GvcpCommand::kReadRegister, words({0x2}))).status, GvcpStatus::kBadAlignment);
  EXPECT_EQ(ask(command(GvcpCommand::kReadMemory, words({0xffe, 4}))).status, GvcpStatus::kBadAlignment);
  EXPECT_EQ(ask(command(GvcpCommand::kReadMemory, words({0xffc, 8}))).status, GvcpStatus::kInvalidAddress);
}

TEST_F(Gvcp, SaysNothingToWhatIsNotGvcp) {
  for (const Bytes& c : {Bytes{}, Bytes{0x42}, Bytes(7, 0x42), Bytes(64, 0x00), Bytes(2000, 0xff)}) {
    const GvcpReply r = ask(c);
    EXPECT_TRUE(r.malformed);
    EXPECT_TRUE(r.bytes.empty());
  }
}

TEST_F(Gvcp, SurvivesRandomBytes) {
  test::Random random(20240607);
  take_control();
  for (int i = 0; i < 50'000; ++i) {
    Bytes packet(random() % 64);
    for (std::uint8_t& b : packet) b = static_cast<std::uint8_t>(random());
    if (packet.size() >= kGvcpHeader && random() % 4 != 0) {  // mostly near the truth
      packet[0] = 0x42;
      put_be16(&packet[2], static_cast<std::uint16_t>(0x80 + 2 * (random() % 4)));
      put_be16(&packet[4], static_cast<std::uint16_t>(packet.size() - kGvcpHeader));
      if (packet.size() >= 12 && random() % 2 == 0) put_be32(&packet[8], static_cast<std::uint32_t>(random() % 0x12000) & ~3U);
    }
    const GvcpReply r = ask(packet);
    ASSERT_LE(r.bytes.size(), kGvcpHeader + kGvcpMaxPayload);
  }
  const StreamTarget t = registers.target();
  EXPECT_TRUE(t.address == 0 || is_local_address(t.address));
  EXPECT_GE(t.packet_bytes, 576);
}

TEST_F(Gvcp, IsAsConfiguredAfterALossOfPower) {
  start();
  registers.power_on();
  EXPECT_FALSE(registers.acquiring());
  EXPECT_FALSE(registers.controlled());
  EXPECT_EQ(read(reg::kWidth), 1024U);
}

}  // namespace
}  // namespace cyclops::hil
