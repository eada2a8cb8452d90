// sources: src/wire src/base
// Every decoder of src/wire under arbitrary bytes: the first byte selects one, the rest is the message. What a decoder
// accepts must be within its limits and survive being encoded and decoded again.
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "wire/codec.hpp"
#include "wire/signed.hpp"

namespace {

using namespace cyclops;

void must(bool good) {
  if (!good) std::abort();
}

template <class Message>
std::vector<std::uint8_t> again(const Message& message) {
  std::vector<std::uint8_t> room(static_cast<std::size_t>(message.getEncodedSize()));
  must(static_cast<bool>(encode_into(message, room)));
  return room;
}

void try_tspi(const std::uint8_t* data, std::size_t size, Aircraft aircraft) {
  const auto r = decode_tspi(data, size, aircraft);
  if (!r.ok()) { must(!r.error().what.empty()); return; }
  must(r->q_n_b.coeffs().allFinite() && r->velocity_ned_mps.norm() <= tspi_limits::kSpeed_mps);
  tspi_t m;
  fill(m, *r);
  const auto b = again(m);
  must(b.size() == size && decode_tspi(b.data(), b.size(), aircraft).ok());
}

void try_strobe(const std::uint8_t* data, std::size_t size) {
  const auto r = decode_strobe_edge(data, size);
  if (!r.ok()) return;
  strobe_edge_t m;
  fill(m, *r);
  must(again(m) == std::vector<std::uint8_t>(data, data + size));
}

void try_acquisition(const std::uint8_t* data, std::size_t size) {
  const auto r = decode_acquisition(data, size);
  if (!r.ok()) return;
  acquisition_t m;
  fill(m, *r);
  must(again(m) == std::vector<std::uint8_t>(data, data + size));
}

void try_note(const std::uint8_t* data, std::size_t size) {
  const auto r = decode_mark(data, size);
  if (!r.ok()) return;
  must(r->text.size() <= Mark::kMaxText);
  mark_t m;
  fill(m, *r);
  must(again(m) == std::vector<std::uint8_t>(data, data + size));
}

void try_seal(const std::uint8_t* data, std::size_t size) {
  const auto r = decode_seal(data, size);
  if (!r.ok()) return;
  seal_t m;
  fill(m, *r);
  must(again(m) == std::vector<std::uint8_t>(data, data + size));
}

void try_mark(const std::uint8_t* data, std::size_t size) {
  const auto r = decode_time_mark(data, size);
  if (!r.ok()) return;
  time_mark_t m;
  fill(m, r->mark, r->source);
  must(again(m) == std::vector<std::uint8_t>(data, data + size));
}

void try_frame(const std::uint8_t* data, std::size_t size) {
  const auto r = decode_frame_index(data, size);
  if (!r.ok()) return;
  frame_index_t m;
  fill(m, *r);
  must(again(m) == std::vector<std::uint8_t>(data, data + size));
}

void try_frame_data(const std::uint8_t* data, std::size_t size) {
  const auto r = decode_frame_data(data, size);
  if (!r.ok()) return;
  std::vector<std::uint8_t> b(encoded_size(*r));
  must(static_cast<bool>(encode_into(*r, b)));
  must(decode_frame_data(b.data(), b.size()).ok());
  if (r->aligned() && r->status != FrameStatus::kMissing) must(r->image().size_bytes() == r->pixels.size());
}

void try_truth(const std::uint8_t* data, std::size_t size) {
  static Truth out;
  if (!decode_truth(data, size, out).ok()) return;
  truth_t m;
  fill(m, out);
  const auto b = again(m);
  must(b.size() == size && decode_truth(b.data(), b.size(), out).ok());
}

void try_event(const std::uint8_t* data, std::size_t size) {
  const auto r = decode_event(data, size);
  if (!r.ok()) return;
  event_t m;
  fill(m, *r);
  must(again(m) == std::vector<std::uint8_t>(data, data + size));
}

/// No tag can be right here: the key is not the fuzzer's.
void try_signed(const std::uint8_t* data, std::size_t size) {
  Verifier verifier(Key(), "TSPI_TANKER", Duration::from_seconds(1e9));
  must(!verifier.open(data, size, 0).ok());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::uint8_t* rest = data + 1;
  switch (data[0] % 12) {
    case 0: try_tspi(rest, size - 1, Aircraft::kReceiver); break;
    case 1: try_tspi(rest, size - 1, Aircraft::kTanker); break;
    case 2: try_strobe(rest, size - 1); break;
    case 3: try_mark(rest, size - 1); break;
    case 4: try_frame(rest, size - 1); break;
    case 5: try_frame_data(rest, size - 1); break;
    case 6: try_truth(rest, size - 1); break;
    case 7: try_acquisition(rest, size - 1); break;
    case 8: try_note(rest, size - 1); break;
    case 9: try_seal(rest, size - 1); break;
    case 10: try_event(rest, size - 1); break;
    default: try_signed(rest, size - 1); break;
  }
  return 0;
}
