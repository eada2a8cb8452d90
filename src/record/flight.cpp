#include "record/flight.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "base/config.hpp"
#include "record/log_stream.hpp"
#include "record/whole_file.hpp"
#include "wire/codec.hpp"

namespace cyclops {
namespace fs = std::filesystem;
using record::quoted;
using record::to_disk;
using record::write_whole;
namespace {

constexpr const char* kManifest = "manifest.toml";
constexpr std::int64_t kMicro = 1000;

std::string to_toml(const FlightManifest& m) {
  std::ostringstream out;
  out << "format = \"" << kFlightFormat << "\"\n"
      << "name = " << quoted(m.name) << "\norigin = " << quoted(m.origin) << "\nsource = " << quoted(m.source) << "\nframes = " << m.frames;
  if (m.pixels >= 0) out << "\npixels = " << m.pixels;
  out << "\nfirst_frame_ns = " << m.first_frame_ns << "\nlast_frame_ns = " << m.last_frame_ns << "\nnav_every_n = " << m.nav_every_n
      << "\nhas_truth = " << (m.has_truth ? "true" : "false") << "\n\n[files]  # size in bytes\n";
  for (const auto& [name, size] : m.files) out << quoted(name) << " = " << size << "\n";
  return out.str();
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
  if (frame.status == FrameStatus::kMissing) {
    view.pixels = {};
  } else if (frame.image.stride_bytes == static_cast<int>(row_bytes)) {
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

Result<> write_manifest(const std::string& folder, FlightManifest manifest) {
  manifest.files.clear();
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.is_regular_file() && entry.path().filename() != kManifest)
      manifest.files[entry.path().filename().string()] = static_cast<std::int64_t>(entry.file_size());
  if (error) return make_error(ErrorCode::kIo, folder, error.message());
  CYCLOPS_TRY(write_whole((fs::path(folder) / kManifest).string(), to_toml(manifest)));
  return to_disk(folder);
}

std::vector<std::string> log_parts(const std::string& folder, const std::string& name) {
  std::vector<std::string> out;
  std::error_code ignored;
  for (int part = 0;; ++part) {
    const std::string path = (fs::path(folder) / record::part_name(name, part)).string();
    if (!fs::exists(path, ignored)) return out;
    out.push_back(path);
  }
}

Result<> FlightWriter::finish(FlightManifest manifest) {
  CYCLOPS_TRY(messages_.close());
  CYCLOPS_TRY(frames_.close());
  CYCLOPS_TRY(write_manifest(*part_, std::move(manifest)));
  // Between these two steps there is no flight of this name; the old one waits under ".old".
  std::error_code error;
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
  root.read("pixels", m.pixels);
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
  for (const auto& [name, logs] : {std::pair{"messages", &r.messages_}, std::pair{"frames", &r.frames_}})
    for (const std::string& part : log_parts(folder, name)) {
      auto log = record::EventLog::open(part);
      if (!log.ok()) return log.error();
      logs->push_back(std::move(log).value());
    }
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
  for (std::size_t part = 0; part < frames_.size(); ++part)
    while (true) {
      auto more = frames_[part].skim(scratch_, bytes);
      if (!more.ok()) return more.error();
      if (!*more) break;
      if (scratch_.channel != channel::kSeal) places_.push_back({scratch_.number, part, scratch_.offset});
    }
  std::sort(places_.begin(), places_.end(), [](const Place& a, const Place& b) { return a.number < b.number; });
  const std::int64_t expected = manifest_.pixels >= 0 ? manifest_.pixels : manifest_.frames;
  if (static_cast<std::int64_t>(places_.size()) != expected)
    return make_error(ErrorCode::kCorrupt, path("frames.lcm"), "holds " + std::to_string(places_.size()) + " frames, expected " + std::to_string(expected) + " by manifest.toml");
  return Ok{};
}

const FlightReader::Place* FlightReader::find(std::int64_t number) const {
  const auto it = std::lower_bound(places_.begin(), places_.end(), number, [](const Place& p, std::int64_t n) { return p.number < n; });
  return it != places_.end() && it->number == number ? &*it : nullptr;
}

Result<bool> FlightReader::next_of(record::LogEvent& event, std::uint32_t* skimmed_bytes) {
  for (; at_part_ < messages_.size(); ++at_part_) {
    record::EventLog& log = messages_[at_part_];
    Result<bool> more = true;
    do more = skimmed_bytes != nullptr ? log.skim(event, *skimmed_bytes) : log.next(event);
    while (more.ok() && *more && event.channel == channel::kSeal);  // of the file, not of the flight
    if (!more.ok() || *more) return more;
    if (at_part_ + 1 == messages_.size()) break;
    CYCLOPS_TRY(messages_[at_part_ + 1].seek(0));
  }
  return false;
}

Result<bool> FlightReader::next(record::LogEvent& event) { return next_of(event, nullptr); }

Result<> FlightReader::rewind() {
  at_part_ = 0;
  return messages_[0].seek(0);
}

Result<> FlightReader::seek(Time arrival) {
  CYCLOPS_TRY(rewind());
  std::uint32_t bytes = 0;
  while (true) {
    auto more = next_of(scratch_, &bytes);
    if (!more.ok()) return more.error();
    if (!*more) return messages_[at_part_].seek(messages_[at_part_].size());
    if (scratch_.time_us >= arrival.ns / kMicro) return messages_[at_part_].seek(scratch_.offset);
  }
}

Result<> FlightReader::frame(std::int64_t number, std::vector<std::uint8_t>& memory, FlightFrame& out) {
  const Place* place = find(number);
  if (place == nullptr)
    return make_error(ErrorCode::kInvalid, path("frames.lcm"),
                      "has no event " + std::to_string(number) + (places_.empty() ? ", and no other" : ", expected " + std::to_string(places_.front().number) + " to " + std::to_string(places_.back().number)));
  record::EventLog& log = frames_[place->part];
  CYCLOPS_TRY(log.seek(place->offset));
  scratch_.data.swap(memory);
  auto more = log.next(scratch_);
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
  if (out.status == FrameStatus::kMissing) out.image.data = nullptr;
  else if (!view->aligned()) {  // an odd row mask in front of 16-bit pixels
    std::memmove(memory.data(), view->pixels.data(), view->pixels.size());
    out.image.data = memory.data();
  }
  return Ok{};
}

}  // namespace cyclops
