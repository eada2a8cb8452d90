#include "capture/camera_supervisor.hpp"

#include <chrono>
#include <utility>

namespace cyclops {
namespace {

std::chrono::nanoseconds chrono_of(Duration d) { return std::chrono::nanoseconds(d.ns); }

}  // namespace

CameraSupervisor::CameraSupervisor(const CameraConfig& config) : config_(config), thread_([this] { run(); }) {}

CameraSupervisor::~CameraSupervisor() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  order_.notify_all();
  thread_.join();
}

void CameraSupervisor::watch(const CameraSession& session) {
  const std::lock_guard lock(mutex_);
  watched_.reset(ARV_CAMERA(g_object_ref(session.camera().camera.get())));
  changed_.reset();
  has_changed_ = false;
  order_.notify_all();
}

std::optional<Error> CameraSupervisor::changed() {
  if (!has_changed_) return std::nullopt;
  const std::lock_guard lock(mutex_);
  has_changed_ = false;
  return std::exchange(changed_, std::nullopt);
}

void CameraSupervisor::retire(std::unique_ptr<CameraSession> session) {
  {
    const std::lock_guard lock(mutex_);
    watched_.reset();
    to_end_ = std::move(session);
    wanted_ = true;
  }
  order_.notify_all();
}

CameraSupervisor::News CameraSupervisor::take(Duration timeout) {
  std::unique_lock lock(mutex_);
  news_.wait_for(lock, chrono_of(timeout), [&] { return fresh_ != nullptr || fault_.has_value(); });
  News news;
  std::swap(news.fault, fault_);
  if (!news.fault) news.session = std::move(fresh_);
  return news;
}

std::uint64_t CameraSupervisor::failed_opens() const {
  const std::lock_guard lock(mutex_);
  return failed_opens_;
}

void CameraSupervisor::run() {
  for (;;) {
    if (!wait_for_order()) return;
    std::unique_ptr<CameraSession> old;
    {
      const std::lock_guard lock(mutex_);
      wanted_ = false;
      old = std::move(to_end_);
    }
    if (!end_session(std::move(old))) return;
    open_again();
  }
}

/// False when the service stops.
bool CameraSupervisor::wait_for_order() {
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      const auto ordered = [&] { return stopping_ || wanted_; };
      const bool verifies = config_.verify_every.ns > 0;
      if (!verifies) order_.wait(lock, ordered);
      else (void)order_.wait_for(lock, chrono_of(config_.verify_every), ordered);
      if (wanted_) return true;
      if (stopping_) return false;
    }
    verify();
  }
}

void CameraSupervisor::verify() {
  arv::Owner<ArvCamera> camera;
  {
    const std::lock_guard lock(mutex_);
    if (!watched_ || changed_) return;
    camera.reset(ARV_CAMERA(g_object_ref(watched_.get())));
  }
  const Result<> as_configured = verify_settings(config_, camera.get());
  const std::lock_guard lock(mutex_);
  // Only a value that differs counts; that nobody answers is for the watchdog to find.
  if (as_configured || as_configured.error().code != ErrorCode::kInvalid || !watched_) return;
  changed_ = as_configured.error();
  has_changed_ = true;
}

/// Readers may still hold frames of it: it ends when the last one is back. False when the service stops.
bool CameraSupervisor::end_session(std::unique_ptr<CameraSession> session) {
  while (session != nullptr && session->lent() != 0 && pause(Duration::from_ms(5))) {}
  session.reset();
  const std::lock_guard lock(mutex_);
  return !stopping_;
}

void CameraSupervisor::open_again() {
  do {
    auto session = CameraSession::open(config_);
    const std::lock_guard lock(mutex_);
    if (session) {
      fresh_ = std::move(session).value();
      last_fault_.clear();
    } else {
      ++failed_opens_;
      const std::string message = session.error().message();
      if (message != last_fault_) fault_ = session.error();
      last_fault_ = message;
    }
    news_.notify_all();
    if (session) return;
  } while (pause(config_.retry_every));
}

/// False when the service stops.
bool CameraSupervisor::pause(Duration time) {
  std::unique_lock lock(mutex_);
  return !order_.wait_for(lock, chrono_of(time), [&] { return stopping_; });
}

}  // namespace cyclops
