// sources: hil/gige_registers.cpp hil/gige_writes.cpp hil/gige_xml.cpp hil/gvcp.cpp hil/gvsp.cpp src/base src/capture/camera_config.cpp
// The control protocol of the bench camera on any bytes: the input is a row of packets, each after its length.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/result.hpp"
#include "hil/gige_registers.hpp"
#include "hil/gvsp.hpp"

using namespace cyclops;       // NOLINT
using namespace cyclops::hil;  // NOLINT

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static GigeRegisters registers({}, 0x7f000001);
  registers.power_on();
  constexpr GvcpPeer client{0x7f000001, 40000}, other{0x7f000001, 40001};
  GvcpEffects ignored;
  (void)registers.write(reg::kControl, 2, {client, 0, 0}, ignored);  // past the first gate
  std::int64_t now_ns = 0;
  std::span<const std::uint8_t> rest(data, size);
  while (!rest.empty()) {
    const std::size_t n = std::min<std::size_t>(rest[0], rest.size() - 1);
    const GvcpReply reply = handle_gvcp(registers, rest.subspan(1, n), n % 16 == 5 ? other : client, now_ns, size);
    CYCLOPS_ASSERT(reply.bytes.empty() || reply.bytes.size() >= kGvcpHeader);
    CYCLOPS_ASSERT(!reply.effects.resend || reply.effects.resend->first <= reply.effects.resend->last);
    rest = rest.subspan(1 + n);
    now_ns += 1'000'000;
  }
  // Whatever was written, frames can still be cut into packets that fit and go nowhere else.
  const StreamTarget target = registers.target();
  CYCLOPS_ASSERT(target.address == 0 || is_local_address(target.address));
  CYCLOPS_ASSERT(target.packet_bytes >= 576 && target.packet_bytes <= 9000);
  CYCLOPS_ASSERT(registers.value(reg::kPayload) <= 2U * 4096 * 4096);
  return 0;
}
