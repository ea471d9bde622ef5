// Messages of any type as Cyclone DDS takes them: CDR that is ready, by the name of its type.
#pragma once

#include <dds/dds.h>

#include <chrono>
#include <string>
#include <vector>

#include "pointflight/ros/common/wire.hpp"

struct ddsi_sertype;

namespace pointflight {

/// A topic of a participant whose samples are bytes: CDR with its header of four bytes.
struct RawTopic {
  dds_entity_t topic = 0;
  const ddsi_sertype* type = nullptr;  ///< Of the topic, which keeps it.
};

/// Throws std::runtime_error with words for the user.
RawTopic make_raw_topic(dds_entity_t participant, const std::string& name, const std::string& type);

/// Hands a message to a writer of such a topic. False if it was not taken.
bool write_raw(dds_entity_t writer, const ddsi_sertype* type, const Bytes& bytes);

/// A message that was read.
struct RawSample {
  std::vector<std::byte> bytes;
  dds_sample_info_t info;
};

/// The next message of a reader of such a topic; false if there is none. Samples without data
/// (a writer has gone) are passed over.
bool take_raw(dds_entity_t reader, RawSample& sample);

/// While one exists, what its thread writes leaves no faster than `rate` bytes per second, fragment
/// by fragment: a large message that leaves at once overruns the receive buffers of stock Linux
/// (208 kB), and Cyclone DDS knows no pacing. It lets go of each fragment when that is sent, with
/// no lock of the writer's held, so that is where the thread waits. Messages that are sent again
/// leave from threads of DDS and are not held up.
class Pacing {
 public:
  explicit Pacing(double rate);
  ~Pacing();
  Pacing(const Pacing&) = delete;
  Pacing& operator=(const Pacing&) = delete;

  /// So many bytes have left: waits until the next may.
  void sent(std::size_t bytes);

 private:
  using Clock = std::chrono::steady_clock;
  double rate_;
  Clock::time_point free_at_;  ///< When all that has left is paid for.
};

}  // namespace pointflight
