#pragma once
/// Messages that prove where they come from: a keyed tag around any message (signed_t), and its check.
///
/// Tag      BLAKE2b-256 with the shared 32-byte key (libsodium, crypto_generichash) over "cyclops-signed-1", the length and
///          name of the channel, sent_ns and the payload. So a message can neither be altered nor moved to another channel.
/// Replay   a channel takes each sent_ns once; one that is older than the 64 newest, or further than `freshness` from this
///          host's UTC clock, is refused. Both hosts' clocks must therefore agree to within `freshness`.
/// Not      encrypted: everyone on the wire can read.
/// Threads  one at a time for one object. Memory: none in sign() and open().
/// Source   keyed hashing: libsodium documentation, "Generic hashing"; RFC 7693.
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "wire/encode.hpp"

namespace cyclops {

inline constexpr std::size_t kTagBytes = 32;
/// Payloads above this are refused: the largest that is signed is TSPI with some 240 bytes.
inline constexpr std::size_t kMaxSignedBytes = 4096;

class Key {
 public:
  /// A file with 64 hexadecimal digits and nothing else but white space. Errors: not a plain file, readable or writable by
  /// others than its owner, owned by somebody else than this user or root, other content.
  static Result<Key> load(const std::string& path);
  [[nodiscard]] const std::array<std::uint8_t, 32>& bytes() const { return bytes_; }

 private:
  std::array<std::uint8_t, 32> bytes_{};
};

class Signer {
 public:
  explicit Signer(const Key& key) : key_(key) {}
  /// `channel` is that of the message inside. Later calls get a later sent_ns even when `now_ns` stands still.
  /// No data: the payload is too large.
  [[nodiscard]] Encoded sign(std::string_view channel, std::span<const std::uint8_t> payload, std::int64_t now_ns);

 private:
  Key key_;
  std::int64_t last_ns_{0};
  std::vector<std::uint8_t> buffer_ = std::vector<std::uint8_t>(kMaxSignedBytes + 128);
};

/// Of one channel.
class Verifier {
 public:
  Verifier(const Key& key, std::string channel, Duration freshness) : key_(key), channel_(std::move(channel)), freshness_(freshness) {}
  /// The message inside, a view into `data`. Errors: kTruncated, kCorrupt, kInvalid as in decode.hpp; kUnusable: the
  /// tag does not fit, or the message is for another channel; kTimeout: authentic, but not fresh or not for the first time.
  [[nodiscard]] Result<std::span<const std::uint8_t>> open(const void* data, std::size_t size, std::int64_t now_ns);

 private:
  static constexpr std::size_t kWindow = 64;
  bool seen(std::int64_t sent_ns) const;
  void remember(std::int64_t sent_ns);

  Key key_;
  std::string channel_;
  Duration freshness_;
  std::array<std::int64_t, kWindow> newest_{};   // ascending, the last `count_` of them
  std::size_t count_{0};
};

}  // namespace cyclops
