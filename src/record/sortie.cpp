#include "record/sortie.hpp"

#include <glib.h>

#include <filesystem>
#include <sstream>

#include "base/config.hpp"
#include "record/whole_file.hpp"

namespace cyclops::record {
namespace fs = std::filesystem;
namespace {

constexpr const char* kHead = "sortie.toml";

std::string to_toml(const SortieHead& h) {
  std::ostringstream out;
  out << "format = \"" << kSortieFormat << "\"\nname = " << quoted(h.name) << "\nversion = " << quoted(h.version) << "\nprogram_sha256 = " << quoted(h.program_sha256)
      << "\nprofile = " << quoted(h.profile) << "\nstarted_utc = " << quoted(h.started_utc) << "\nstarted_monotonic_ns = " << h.started_monotonic_ns
      << "\nstarted_realtime_ns = " << h.started_realtime_ns << "\nown_clock = " << (h.own_clock ? "true" : "false") << "\n\n[sha256]\n";
  for (const auto& [name, sum] : h.sha256) out << quoted(name) << " = " << quoted(sum) << "\n";
  return out.str();
}

}  // namespace

std::string sha256(const std::string& bytes) {
  gchar* text = g_compute_checksum_for_data(G_CHECKSUM_SHA256, reinterpret_cast<const guchar*>(bytes.data()), bytes.size());
  std::string out = text;
  g_free(text);
  return out;
}

Result<> begin_sortie(const std::string& folder, SortieHead& head, const std::vector<SortieFile>& files) {
  std::error_code error;
  const fs::path root = fs::absolute(folder, error);
  fs::create_directories(root.parent_path(), error);
  if (error) return make_error(ErrorCode::kIo, root.parent_path().string(), error.message());
  if (!fs::create_directory(root, error))
    return make_error(error ? ErrorCode::kIo : ErrorCode::kInvalid, root.string(), error ? error.message() : "is there already; a sortie never writes over anything");
  head.sha256.clear();
  for (const SortieFile& f : files) {
    head.sha256[f.name] = sha256(f.content);
    CYCLOPS_TRY(write_whole((root / f.name).string(), f.content));
  }
  CYCLOPS_TRY(write_whole((root / kHead).string(), to_toml(head)));
  CYCLOPS_TRY(to_disk(root.string()));
  return to_disk(root.parent_path().string());
}

Result<SortieHead> read_sortie(const std::string& folder) {
  auto file = ConfigFile::load((fs::path(folder) / kHead).string());
  if (!file.ok()) return file.error();
  ConfigTable root = file->root();
  SortieHead h;
  std::string format;
  root.require("format", format);
  if (format != kSortieFormat) return make_error(ErrorCode::kUnsupported, root.where("format"), "is \"" + format + "\", expected \"" + kSortieFormat + "\"");
  root.read("name", h.name);
  root.read("version", h.version);
  root.read("program_sha256", h.program_sha256);
  root.read("profile", h.profile);
  root.read("started_utc", h.started_utc);
  root.read("started_monotonic_ns", h.started_monotonic_ns);
  root.read("started_realtime_ns", h.started_realtime_ns);
  root.read("own_clock", h.own_clock);
  ConfigTable sums = root.table("sha256");
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored))
    if (const std::string name = entry.path().filename().string(); sums.has(name.c_str())) sums.read(name.c_str(), h.sha256[name]);
  CYCLOPS_TRY(file->finish());
  return h;
}

}  // namespace cyclops::record
