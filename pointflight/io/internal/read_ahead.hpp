#pragma once

#include <future>
#include <vector>

#include "pointflight/io/cloud_reader.hpp"

namespace pointflight {

/// Reads the next batch of a cloud on another thread while the caller uses the present one.
class ReadAhead {
 public:
  /// `in_background` false: reads when asked. The reader must outlive this.
  ReadAhead(CloudReader& reader, bool in_background)
      : reader_(reader), in_background_(in_background) {
    if (in_background_) start();
  }

  /// As CloudReader::read; what the reader throws comes out here.
  bool read(std::vector<CloudPoint>& batch) {
    if (!in_background_) {
      const bool more = reader_.read(batch);
      share_ = reader_.share_read();
      return more;
    }
    const bool more = pending_.get();
    share_ = reader_.share_read();
    std::swap(batch, next_);
    if (more) start();
    return more;
  }

  /// Share of the file up to the last batch that was given out.
  [[nodiscard]] double share_read() const { return share_; }

 private:
  void start() {
    pending_ = std::async(std::launch::async, [this] { return reader_.read(next_); });
  }

  CloudReader& reader_;
  bool in_background_;
  double share_ = 0.0;
  std::vector<CloudPoint> next_;
  std::future<bool> pending_;  ///< Last: its end waits for the reader.
};

}  // namespace pointflight
