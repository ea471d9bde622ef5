#include "pointflight/recording/recording.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <utility>

#include "pointflight/core/input_error.hpp"

namespace pointflight {

namespace fs = std::filesystem;

void check_recording(const RecordingRequest& request) {
  for (const std::string& path : {request.path, request.path + ".active"}) {
    std::error_code error;
    const fs::file_status status = fs::symlink_status(path, error);
    if (!fs::exists(status)) continue;
    if (!fs::is_regular_file(status)) {
      throw InputError(
          fmt::format("{}: is there and is not a regular file; give another name", path));
    }
    if (request.overwrite) continue;
    throw InputError(fmt::format("{}: is there already{}; give another name or --force",
                                 path,
                                 path == request.path ? "" : ", a recording that was cut short"));
  }
}

Recording::Recording(std::string path, std::unique_ptr<Outlet> outlet, int lock)
    : path_(std::move(path)), wire_(outlet->wire()), outlet_(std::move(outlet)), lock_(lock) {}

Recording::~Recording() {
  outlet_.reset();
  if (lock_ >= 0) ::close(lock_);
}

template <class Action>
void Recording::guarded(const Action& action) {
  if (!outlet_) return;
  try {
    action();
  } catch (const std::exception& error) {
    failure_ = error.what();
    outlet_.reset();
  }
}

int Recording::advertise(const Topic& topic) {
  guarded([&] { outlet_->advertise(topic); });
  return topics_++;
}

void Recording::send(int topic, const Bytes& bytes, std::int64_t time) {
  guarded([&] { outlet_->send(topic, bytes, time); });
}

void Recording::close() {
  guarded([&] { outlet_->close(); });
  outlet_.reset();
}

}  // namespace pointflight
