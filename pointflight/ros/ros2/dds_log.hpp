#pragma once

#include <dds/ddsrt/log.h>

#include <atomic>
#include <cstddef>
#include <functional>
#include <string>
#include <utility>

namespace pointflight {

/// What DDS says of packets that it cannot read and the like, to the user: a few lines of it. DDS
/// has one such log: the last that was made gets it.
class DdsLog {
 public:
  /// Lines begin with `who`; without `log` nothing is said.
  DdsLog(std::string who, std::function<void(const std::string&)> log)
      : who_(std::move(who)), log_(std::move(log)) {
    dds_set_log_sink(&DdsLog::take, this);
  }
  ~DdsLog() { dds_set_log_sink(nullptr, nullptr); }
  DdsLog(const DdsLog&) = delete;
  DdsLog& operator=(const DdsLog&) = delete;

 private:
  static constexpr int kSaidMax = 3;

  static void take(void* self, const dds_log_data_t* data) {
    static_cast<DdsLog*>(self)->say({data->message, data->size});
  }
  void say(std::string text) {
    const int before = said_.fetch_add(1);
    if (!log_ || before >= kSaidMax) return;
    for (char& c : text) {
      if (c < ' ' || c > '~') c = ' ';
    }
    while (!text.empty() && text.back() == ' ') text.pop_back();
    constexpr std::size_t kLine = 160;
    if (text.size() > kLine) text = text.substr(0, kLine) + " ...";
    log_(who_ + ": DDS says: " + text + (before + 1 == kSaidMax ? " (more is not said)" : ""));
  }

  std::string who_;
  std::function<void(const std::string&)> log_;
  std::atomic<int> said_{0};
};

}  // namespace pointflight
