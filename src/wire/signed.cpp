#include "wire/signed.hpp"

#include <fcntl.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <cyclops/signed_t.hpp>

#include "wire/channels.hpp"
#include "wire/decode.hpp"
#include "wire/reader.hpp"

namespace cyclops {
namespace {

constexpr std::string_view kDomain = "cyclops-signed-1";
constexpr std::size_t kMaxChannel = 63;

struct Descriptor {
  explicit Descriptor(int d) : fd(d) {}
  ~Descriptor() { if (fd >= 0) ::close(fd); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int fd;
};

std::array<std::uint8_t, 8> big_endian(std::uint64_t v) {
  std::array<std::uint8_t, 8> out;
  for (std::size_t i = 8; i > 0; --i, v >>= 8) out[i - 1] = static_cast<std::uint8_t>(v);
  return out;
}

std::array<std::uint8_t, kTagBytes> tag_of(const Key& key, std::string_view channel, std::int64_t sent_ns, std::span<const std::uint8_t> payload) {
  crypto_generichash_state state;
  crypto_generichash_init(&state, key.bytes().data(), key.bytes().size(), kTagBytes);
  const auto add = [&](const void* data, std::size_t n) { crypto_generichash_update(&state, static_cast<const unsigned char*>(data), n); };
  add(kDomain.data(), kDomain.size());
  add(big_endian(channel.size()).data(), 8);
  add(channel.data(), channel.size());
  add(big_endian(static_cast<std::uint64_t>(sent_ns)).data(), 8);
  add(payload.data(), payload.size());
  std::array<std::uint8_t, kTagBytes> tag;
  crypto_generichash_final(&state, tag.data(), tag.size());
  return tag;
}

Error not_believed(ErrorCode code, const std::string& channel, const std::string& what) { return make_error(code, channel::kSignedPrefix + channel, what); }

}  // namespace

Result<Key> Key::load(const std::string& path) {
  if (sodium_init() < 0) return make_error(ErrorCode::kIo, path, "libsodium cannot be started");
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.fd < 0) return make_error(ErrorCode::kNotFound, path, std::string("cannot be opened: ") + std::strerror(errno));
  struct stat s{};
  if (::fstat(file.fd, &s) != 0) return make_error(ErrorCode::kIo, path, std::strerror(errno));
  if (!S_ISREG(s.st_mode)) return make_error(ErrorCode::kInvalid, path, "is not a plain file");
  if ((s.st_mode & 077) != 0) return make_error(ErrorCode::kInvalid, path, "may be used by others than its owner, expected mode 600 or 400");
  if (s.st_uid != ::geteuid() && s.st_uid != 0) return make_error(ErrorCode::kInvalid, path, "belongs to another user");
  char text[256];
  const ssize_t n = ::read(file.fd, text, sizeof text);
  if (n < 0) return make_error(ErrorCode::kIo, path, std::strerror(errno));
  Key key;
  std::size_t got = 0;
  const char* end = nullptr;
  const bool hex = sodium_hex2bin(key.bytes_.data(), key.bytes_.size(), text, static_cast<std::size_t>(n), " \t\r\n", &got, &end) == 0;
  const bool good = hex && got == key.bytes_.size() && end == text + n;
  sodium_memzero(text, sizeof text);
  if (!good) return make_error(ErrorCode::kInvalid, path, "expected 64 hexadecimal digits");
  return key;
}

Encoded Signer::sign(std::string_view channel, std::span<const std::uint8_t> payload, std::int64_t now_ns) {
  if (payload.size() > kMaxSignedBytes || channel.size() > kMaxChannel) return {};
  last_ns_ = std::max(now_ns, last_ns_ + 1);
  const auto tag = tag_of(key_, channel, last_ns_, payload);
  std::uint8_t* out = buffer_.data();
  const auto put = [&](const void* data, std::size_t n) { out = std::copy_n(static_cast<const std::uint8_t*>(data), n, out); };
  const auto put_length = [&](std::size_t v) { put(big_endian(v).data() + 4, 4); };
  put(big_endian(static_cast<std::uint64_t>(signed_t::getHash())).data(), 8);
  put_length(channel.size() + 1);
  put(channel.data(), channel.size());
  put("", 1);
  put(big_endian(static_cast<std::uint64_t>(last_ns_)).data(), 8);
  put(tag.data(), tag.size());
  put_length(payload.size());
  put(payload.data(), payload.size());
  return {buffer_.data(), static_cast<std::size_t>(out - buffer_.data())};
}

Result<std::span<const std::uint8_t>> Verifier::open(const void* data, std::size_t size, std::int64_t now_ns) {
  wire::Reader in(channel_.c_str(), signed_t::getTypeName(), signed_t::getHash(), data, size);
  const std::string_view channel = in.text("channel", kMaxChannel);
  const std::int64_t sent_ns = in.whole("sent_ns", 0, kMaxTime_ns);
  const auto tag = in.take("tag", kTagBytes);
  const auto payload = in.take("payload", in.length("size_bytes", kMaxSignedBytes));
  in.finish();
  if (!in.ok()) return in.error();
  const auto expected = tag_of(key_, channel, sent_ns, payload);
  if (sodium_memcmp(expected.data(), tag.data(), kTagBytes) != 0) return not_believed(ErrorCode::kUnusable, channel_, "not authentic: tag does not fit");
  if (channel != channel_) return not_believed(ErrorCode::kUnusable, channel_, "not for this channel: \"" + std::string(channel) + "\"");
  const double late_s = static_cast<double>(now_ns - sent_ns) * 1e-9;
  if (std::abs(late_s) > freshness_.seconds())
    return not_believed(ErrorCode::kTimeout, channel_, "not fresh: sent " + std::to_string(late_s) + " s ago by the sender's clock, expected within " + std::to_string(freshness_.seconds()) + " s");
  if (seen(sent_ns)) return not_believed(ErrorCode::kTimeout, channel_, "replayed: sent_ns was used before, or is older than the newest 64");
  remember(sent_ns);
  return payload;
}

bool Verifier::seen(std::int64_t sent_ns) const {
  const auto begin = newest_.end() - static_cast<std::ptrdiff_t>(count_);
  return (count_ == kWindow && sent_ns < *begin) || std::binary_search(begin, newest_.end(), sent_ns);
}

void Verifier::remember(std::int64_t sent_ns) {
  if (count_ < kWindow) ++count_;
  const auto begin = newest_.end() - static_cast<std::ptrdiff_t>(count_);  // holds the oldest, or room
  const auto place = std::lower_bound(begin + 1, newest_.end(), sent_ns);
  std::copy(begin + 1, place, begin);
  *(place - 1) = sent_ns;
}

}  // namespace cyclops
