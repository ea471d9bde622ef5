#pragma once

#include <memory>
#include <optional>
#include <string>

#include "pointflight/ros/common/wire.hpp"

namespace pointflight {

/// What a recording is made with.
struct RecordingRequest {
  std::string path;        ///< The recording grows as `path`.active.
  bool overwrite = false;  ///< What is there already, complete or cut short.
};

/// Throws InputError if a recording cannot be made: the path is a folder or no regular file, or
/// something is there and shall not be overwritten.
void check_recording(const RecordingRequest& request);

/// A recording that stops at a write error (a full disk) while the run continues. What was written
/// until then stays as `path`.active.
class Recording : public Outlet {
 public:
  /// `lock`: a descriptor to close with the recording, or -1.
  Recording(std::string path, std::unique_ptr<Outlet> outlet, int lock = -1);
  ~Recording() override;
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  [[nodiscard]] Wire wire() const override { return wire_; }
  int advertise(const Topic& topic) override;
  [[nodiscard]] bool has_readers(int /*topic*/) const override { return outlet_ != nullptr; }
  void send(int topic, const Bytes& bytes, std::int64_t time) override;
  void close() override;

  /// As given to the constructor.
  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::string failure() const override { return failure_; }

 private:
  template <class Action>
  void guarded(const Action& action);

  std::string path_;
  Wire wire_;
  std::unique_ptr<Outlet> outlet_;  ///< Null once it is closed or has failed.
  int lock_;
  int topics_ = 0;
  std::string failure_;
};

}  // namespace pointflight
