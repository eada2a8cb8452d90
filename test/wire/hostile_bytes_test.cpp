// A short run of the fuzz target over damaged good messages, with constant seeds, so that `make check` and the sanitizers
// see it without libFuzzer.
#include <gtest/gtest.h>

#include <algorithm>
#include <cyclops/signed_t.hpp>

#include "test/fuzz/wire_fuzz.cpp"
#include "test/support.hpp"
#include "test/wire/examples.hpp"

namespace cyclops {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes selected(std::uint8_t selector, const Bytes& message) {
  Bytes out(message.size() + 1, selector);
  std::copy(message.begin(), message.end(), out.begin() + 1);
  return out;
}

std::vector<Bytes> corpus() {
  static const Bytes pixels(16 * 20 * 2, 5);
  strobe_edge_t strobe;
  fill(strobe, LineEdge{});
  time_mark_t mark;
  fill(mark, TimeMark{}, MarkSource::kPps);
  frame_index_t frame;
  fill(frame, test::good_frame());
  truth_t truth;
  fill(truth, test::good_truth());
  event_t event;
  fill(event, test::good_event());
  signed_t wrapped{};
  wrapped.channel = "TSPI_TANKER";
  wrapped.size_bytes = 5;
  wrapped.payload.assign(5, 7);
  acquisition_t acquisition;
  fill(acquisition, Acquisition{AcquisitionChange::kStarted, Time{INT64_MIN}});
  mark_t note;
  fill(note, Mark{3, "contact"});
  seal_t seal;
  fill(seal, Seal{0, 1000, ~std::uint64_t{0}});
  return {selected(1, test::bytes_of(test::good_tspi())), selected(2, test::bytes_of(strobe)), selected(3, test::bytes_of(mark)),
          selected(4, test::bytes_of(frame)), selected(5, test::frame_data_bytes(test::good_frame_data(pixels))),
          selected(6, test::bytes_of(truth)), selected(10, test::bytes_of(event)),
          selected(7, test::bytes_of(acquisition)), selected(8, test::bytes_of(note)), selected(9, test::bytes_of(seal)), selected(11, test::bytes_of(wrapped))};
}

/// Cut, stretched, or with some bytes changed; seldom in the fingerprint, which would end the matter at once.
Bytes damaged(Bytes b, test::Random& random) {
  const std::uint8_t extreme[] = {0x00, 0x7f, 0x80, 0xff, 0x01};
  for (std::uint64_t n = random() % 6; n > 0; --n) {
    const std::size_t from = b.size() > 9 && random() % 50 != 0 ? 9 : 0;
    if (from < b.size()) b[from + random() % (b.size() - from)] = random() % 2 != 0 ? static_cast<std::uint8_t>(random()) : extreme[random() % 5];
  }
  if (random() % 4 == 0) b.resize(random() % (b.size() + 8));
  return b;
}

TEST(HostileBytes, NeverBreakADecoderAndWhatIsAcceptedCanBeSentAgain) {
  const auto good = corpus();
  test::Random random(99);
  for (int n = 0; n < 60000; ++n) {
    const Bytes b = damaged(good[random() % good.size()], random);
    LLVMFuzzerTestOneInput(b.data(), b.size());  // aborts when something is wrong
  }
}

}  // namespace
}  // namespace cyclops
