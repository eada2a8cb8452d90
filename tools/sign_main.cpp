#include <csignal>
#include <cstdio>

#include <CLI/CLI.hpp>
#include <lcm/lcm.h>

#include "base/clock.hpp"
#include "wire/channels.hpp"
#include "wire/signed.hpp"

namespace {

using namespace cyclops;

volatile std::sig_atomic_t g_stop = 0;

/// One channel on its way from the plain side to the signed one.
struct Relay {
  std::string channel;
  Signer signer;
  lcm_t* out;
  std::uint64_t sent{0}, failed{0};
};

void on_message(const lcm_recv_buf_t* buffer, const char*, void* relay) {
  auto& r = *static_cast<Relay*>(relay);
  const Encoded m = r.signer.sign(r.channel, {static_cast<const std::uint8_t*>(buffer->data), buffer->data_size}, utc_now_ns());
  const bool good = m && lcm_publish(r.out, (channel::kSignedPrefix + r.channel).c_str(), m.data, static_cast<unsigned>(m.size)) == 0;
  ++(good ? r.sent : r.failed);
}

struct Destroy { void operator()(lcm_t* lcm) const { lcm_destroy(lcm); } };
using Lcm = std::unique_ptr<lcm_t, Destroy>;

int fail(const std::string& what) {
  std::fprintf(stderr, "cyclops-sign: %s\n", what.c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Puts a keyed tag on TSPI, time marks and event marks: runs beside a sender that knows no keys. What is heard on one LCM URL goes out on another."};
  app.set_version_flag("--version", CYCLOPS_VERSION);
  app.footer("Let --from reach no further than this host (ttl 0): whatever comes in there is signed.");
  std::string key_path, from, to;
  app.add_option("--key", key_path, "key file: 64 hexadecimal digits, mode 600")->required();
  app.add_option("--from", from, "LCM URL of the plain messages")->required();
  app.add_option("--to", to, "LCM URL of the signed ones")->required();
  CLI11_PARSE(app, argc, argv);
  const auto key = Key::load(key_path);
  if (!key.ok()) return fail(key.error().message());
  if (from == to) return fail("--from and --to are the same: the plain messages would be there beside the signed ones");
  const Lcm in(lcm_create(from.c_str())), out(lcm_create(to.c_str()));
  if (!in) return fail(from + " cannot be opened");
  if (!out) return fail(to + " cannot be opened");
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { g_stop = 1; });

  std::vector<std::unique_ptr<Relay>> relays;
  for (const char* name : {channel::kTspiReceiver, channel::kTspiTanker, channel::kTimeMark, channel::kMark}) {
    relays.push_back(std::make_unique<Relay>(Relay{name, Signer(*key), out.get()}));
    lcm_subscription_set_queue_capacity(lcm_subscribe(in.get(), name, on_message, relays.back().get()), 256);
  }
  while (g_stop == 0)
    if (lcm_handle_timeout(in.get(), 200) < 0 && g_stop == 0) return fail(from + " cannot be read");
  for (const auto& r : relays) std::printf("%-14s %llu signed, %llu failed\n", r->channel.c_str(), static_cast<unsigned long long>(r->sent), static_cast<unsigned long long>(r->failed));
  return 0;
}
