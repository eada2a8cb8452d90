#include "record/flight.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "base/config.hpp"
#include "wire/codec.hpp"

namespace cyclops {
namespace fs = std::filesystem;
namespace {

constexpr const char* kManifest = "manifest.toml";
constexpr std::int64_t kMicro = 1000;

std::string quoted(const std::string& s) {
  std::string out = "\"";
  for (char c : s) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out + "\"";
}

std::string to_toml(const FlightManifest& m) {
  std::ostringstream out;
  out << "format = \"" << kFlightFormat << "\"\n"
      << "name = " << quoted(m.name) << "\norigin = " << quoted(m.origin) << "\nsource = " << quoted(m.source) << "\nframes = " << m.frames
      << "\nfirst_frame_ns = " << m.first_frame_ns << "\nlast_frame_ns = " << m.last_frame_ns << "\nnav_every_n = " << m.nav_every_n
      << "\nhas_truth = " << (m.has_truth ? "true" : "false") << "\n\n[files]  # size in bytes\n";
  for (const auto& [name, size] : m.files) out << quoted(name) << " = " << size << "\n";
  return out.str();
}

/// Writes beside the file, brings it to the disk, then gives it its name: it is there whole or not at all.
Result<> write_whole(const std::string& path, const std::string& content) {
  const std::string part = path + ".part";
  const int fd = ::open(part.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd < 0) return make_error(ErrorCode::kIo, part, std::strerror(errno));
  std::size_t done = 0;
  while (done < content.size()) {
    const ssize_t n = ::write(fd, content.data() + done, content.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    done += static_cast<std::size_t>(n);
  }
  const bool good = done == content.size() && ::fsync(fd) == 0;
  const int why = errno;
  ::close(fd);
  if (!good) return make_error(why == ENOSPC ? ErrorCode::kFull : ErrorCode::kIo, part, std::string("cannot be written: ") + std::strerror(why));
  if (std::rename(part.c_str(), path.c_str()) != 0) return make_error(ErrorCode::kIo, path, std::strerror(errno));
  return Ok{};
}

/// The names in a folder survive a loss of power only when the folder itself has been brought to the disk.
Result<> to_disk(const std::string& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return make_error(ErrorCode::kIo, folder, std::strerror(errno));
  const bool good = ::fsync(fd) == 0 || errno == EINVAL;  // EINVAL: a file system that needs none
  const int why = errno;
  ::close(fd);
  if (!good) return make_error(ErrorCode::kIo, folder, std::string("cannot be brought to the disk: ") + std::strerror(why));
  return Ok{};
}

/// Nothing that somebody else put there is ever replaced.
Result<> holds_only_flights(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder, error)) return Ok{};
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    const std::string end = entry.path().extension().string();
    if (entry.is_directory() || (end != ".lcm" && end != ".toml" && end != ".csv" && end != ".bin" && end != ".json" && end != ".part"))
      return make_error(ErrorCode::kInvalid, folder.string(), "holds " + name + ", which is no file of a flight");
  }
  if (error) return make_error(ErrorCode::kIo, folder.string(), error.message());
  return Ok{};
}

Result<> share(const std::string& from, const std::string& to) {
  if (::link(from.c_str(), to.c_str()) == 0) return Ok{};
  std::error_code error;
  fs::copy_file(from, to, error);
  if (error) return make_error(error.value() == ENOSPC ? ErrorCode::kFull : ErrorCode::kIo, to, "cannot be written: " + error.message());
  return Ok{};
}

}  // namespace

void FlightWriter::Remove::operator()(const std::string* folder) const {
  std::error_code ignored;
  fs::remove_all(*folder, ignored);
  delete folder;
}

std::string FlightWriter::path(const std::string& name) const { return (fs::path(*part_) / name).string(); }

Result<FlightWriter> FlightWriter::create(const std::string& folder, bool replace, const std::string& frames_from) {
  std::error_code error;
  const fs::path root = fs::path(folder).lexically_normal();
  if (fs::exists(root / kManifest, error) && !replace) return make_error(ErrorCode::kInvalid, folder, "is a flight already");
  CYCLOPS_TRY(holds_only_flights(root));
  FlightWriter w;
  w.folder_ = root.has_filename() ? root.string() : root.parent_path().string();
  w.part_.reset(new std::string(w.folder_ + ".part"));
  fs::remove_all(*w.part_, error);
  fs::create_directories(*w.part_, error);
  if (error) return make_error(ErrorCode::kIo, *w.part_, error.message());
  auto messages = record::EventLogWriter::create(w.path("messages.lcm"));
  if (!messages.ok()) return messages.error();
  w.messages_ = std::move(messages).value();
  if (!frames_from.empty()) {
    CYCLOPS_TRY(share(frames_from, w.path("frames.lcm")));
    return w;
  }
  auto frames = record::EventLogWriter::create(w.path("frames.lcm"));
  if (!frames.ok()) return frames.error();
  w.frames_ = std::move(frames).value();
  return w;
}

Result<> FlightWriter::message(Time arrival, const char* channel, const void* data, std::size_t bytes) {
  return messages_.write(arrival.ns / kMicro, channel, data, bytes);
}

Result<std::int64_t> FlightWriter::frame(Time arrival, const FlightFrame& frame) {
  FrameDataView view;
  view.camera_frame_id = frame.camera_frame_id;
  view.camera_tick_ns = frame.camera_tick_ns;
  view.exposure = frame.exposure;
  view.status = frame.status;
  view.format = frame.image.format;
  view.width = frame.image.width;
  view.height = frame.image.height;
  view.missing = frame.missing;
  const auto row_bytes = static_cast<std::size_t>(frame.image.width * bytes_per_pixel(frame.image.format));
  if (frame.image.stride_bytes == static_cast<int>(row_bytes)) {
    view.pixels = {frame.image.data, row_bytes * static_cast<std::size_t>(frame.image.height)};
  } else {
    rows_.clear();
    for (int v = 0; v < frame.image.height; ++v) rows_.insert(rows_.end(), frame.image.row8(v), frame.image.row8(v) + row_bytes);
    view.pixels = rows_;
  }
  buffer_.resize(encoded_size(view));
  const Encoded bytes = encode_into(view, buffer_);
  CYCLOPS_ASSERT(static_cast<bool>(bytes));
  const std::int64_t number = frames_.events();
  CYCLOPS_TRY(frames_.write(arrival.ns / kMicro, channel::kFrameData, bytes.data, bytes.size));
  return number;
}

Result<> FlightWriter::text(const std::string& name, const std::string& content) { return write_whole(path(name), content); }

Result<> FlightWriter::finish(FlightManifest manifest) {
  CYCLOPS_TRY(messages_.close());
  CYCLOPS_TRY(frames_.close());
  manifest.files.clear();
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(*part_, error))
    if (entry.is_regular_file() && entry.path().filename() != kManifest)
      manifest.files[entry.path().filename().string()] = static_cast<std::int64_t>(entry.file_size());
  CYCLOPS_TRY(write_whole(path(kManifest), to_toml(manifest)));
  CYCLOPS_TRY(to_disk(*part_));
  // Between these two steps there is no flight of this name; the old one waits under ".old".
  const std::string old = folder_ + ".old";
  fs::remove_all(old, error);
  const bool there = std::rename(folder_.c_str(), old.c_str()) == 0;
  if (std::rename(part_->c_str(), folder_.c_str()) != 0) {
    const int why = errno;
    if (there && std::rename(old.c_str(), folder_.c_str()) != 0) return make_error(ErrorCode::kIo, old, "is the flight that was to be replaced; it cannot be put back");
    return make_error(ErrorCode::kIo, folder_, std::strerror(why));
  }
  delete part_.release();
  fs::remove_all(old, error);
  const fs::path parent = fs::path(folder_).parent_path();
  return to_disk(parent.empty() ? "." : parent.string());
}

std::string FlightReader::path(const std::string& name) const { return (fs::path(folder_) / name).string(); }

Result<FlightReader> FlightReader::open(const std::string& folder) {
  FlightReader r;
  r.folder_ = folder;
  std::error_code ignored;
  if (!fs::exists(r.path(kManifest), ignored))
    return make_error(ErrorCode::kNotFound, folder, "is no flight: manifest.toml is missing (a flight that was not finished has none)");
  auto file = ConfigFile::load(r.path(kManifest));
  if (!file.ok()) return file.error();
  ConfigTable root = file->root();
  std::string format;
  FlightManifest& m = r.manifest_;
  root.require("format", format);
  if (format != kFlightFormat) return make_error(ErrorCode::kUnsupported, root.where("format"), "is \"" + format + "\", expected \"" + kFlightFormat + "\"");
  root.read("name", m.name);
  root.read("origin", m.origin);
  root.read("source", m.source);
  root.require("frames", m.frames);
  root.read("first_frame_ns", m.first_frame_ns);
  root.read("last_frame_ns", m.last_frame_ns);
  root.read_in("nav_every_n", 1, 1000000, m.nav_every_n);
  root.read("has_truth", m.has_truth);
  ConfigTable files = root.table("files");
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (files.has(name.c_str())) files.read(name.c_str(), m.files[name]);
  }
  if (auto done = file->finish(); !done.ok()) {
    if (done.error().where.find(": files.") == std::string::npos) return done.error();
    return make_error(ErrorCode::kNotFound, done.error().where, "file is missing from the folder");
  }
  CYCLOPS_TRY(r.check());
  auto messages = record::EventLog::open(r.path("messages.lcm"));
  if (!messages.ok()) return messages.error();
  auto frames = record::EventLog::open(r.path("frames.lcm"));
  if (!frames.ok()) return frames.error();
  r.messages_ = std::move(messages).value();
  r.frames_ = std::move(frames).value();
  CYCLOPS_TRY(r.index_frames());
  return r;
}

Result<> FlightReader::check() {
  for (const char* name : {"messages.lcm", "frames.lcm", "rig.toml"})
    if (manifest_.files.count(name) == 0) return make_error(ErrorCode::kCorrupt, path(kManifest), std::string("does not list ") + name);
  for (const auto& [name, size] : manifest_.files) {
    std::error_code error;
    const auto there = static_cast<std::int64_t>(fs::file_size(path(name), error));
    if (error) return make_error(ErrorCode::kNotFound, path(name), error.message());
    if (there != size)
      return make_error(there < size ? ErrorCode::kTruncated : ErrorCode::kCorrupt, path(name),
                        "has " + std::to_string(there) + " bytes, expected " + std::to_string(size) + " by manifest.toml");
  }
  return Ok{};
}

Result<> FlightReader::index_frames() {
  std::uint32_t bytes = 0;
  while (true) {
    auto more = frames_.skim(scratch_, bytes);
    if (!more.ok()) return more.error();
    if (!*more) break;
    frame_offset_.push_back(scratch_.offset);
  }
  if (static_cast<std::int64_t>(frame_offset_.size()) != manifest_.frames)
    return make_error(ErrorCode::kCorrupt, path("frames.lcm"), "holds " + std::to_string(frame_offset_.size()) + " frames, expected " + std::to_string(manifest_.frames) + " by manifest.toml");
  return Ok{};
}

Result<bool> FlightReader::next(record::LogEvent& event) { return messages_.next(event); }
Result<> FlightReader::rewind() { return messages_.seek(0); }

Result<> FlightReader::seek(Time arrival) {
  CYCLOPS_TRY(messages_.seek(0));
  std::uint32_t bytes = 0;
  while (true) {
    auto more = messages_.skim(scratch_, bytes);
    if (!more.ok()) return more.error();
    if (!*more || scratch_.time_us >= arrival.ns / kMicro) return messages_.seek(*more ? scratch_.offset : messages_.size());
  }
}

Result<> FlightReader::frame(std::int64_t number, std::vector<std::uint8_t>& memory, FlightFrame& out) {
  if (number < 0 || number >= static_cast<std::int64_t>(frame_offset_.size()))
    return make_error(ErrorCode::kInvalid, path("frames.lcm"), "has no event " + std::to_string(number) + ", expected 0 to " + std::to_string(static_cast<std::int64_t>(frame_offset_.size()) - 1));
  CYCLOPS_TRY(frames_.seek(frame_offset_[static_cast<std::size_t>(number)]));
  scratch_.data.swap(memory);
  auto more = frames_.next(scratch_);
  scratch_.data.swap(memory);
  if (!more.ok()) return more.error();
  const auto view = decode_frame_data(memory.data(), memory.size());
  if (!view.ok()) return make_error(view.error().code, path("frames.lcm") + ": event " + std::to_string(number), view.error().message());
  out.camera_frame_id = view->camera_frame_id;
  out.camera_tick_ns = view->camera_tick_ns;
  out.exposure = view->exposure;
  out.status = view->status;
  out.missing = view->missing;
  out.image = {view->pixels.data(), view->width, view->height, view->width * bytes_per_pixel(view->format), view->format};
  if (!view->aligned()) {  // an odd row mask in front of 16-bit pixels
    std::memmove(memory.data(), view->pixels.data(), view->pixels.size());
    out.image.data = memory.data();
  }
  return Ok{};
}

}  // namespace cyclops
