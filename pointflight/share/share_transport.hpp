#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pointflight/ros/common/wire.hpp"

namespace pointflight {

/// What goes between processes that share a run, by how it has to arrive.
enum class ShareChannel : std::uint8_t {
  kMembers,  ///< Introductions: reliable; the last one is kept for late joiners.
  kStates,   ///< States: the newest counts; in lockstep reliably and all.
  kClock,    ///< Clocks and beats: late is useless.
  kPast,     ///< Pasts: reliably.
};
/// How many there are.
inline constexpr std::size_t kShareChannels = 4;

/// Something that came from another process.
struct ShareArrival {
  ShareChannel channel = ShareChannel::kMembers;  ///< Which topic.
  std::vector<std::byte> bytes;  ///< Empty: `writer` is lost, its lease has run out.
  std::uint64_t writer = 0;      ///< Who wrote it, on whatever channel: not what the bytes say.
  std::int64_t at = 0;           ///< When it came, ns of the steady clock.
};

/// Messages between processes, by DDS or in memory. `take` and `wait` from one thread.
class ShareTransport {
 public:
  virtual ~ShareTransport() = default;
  /// To all others.
  virtual void send(ShareChannel channel, const Bytes& bytes) = 0;
  /// Sends it on the clocks' channel every `ShareTransportOptions::beat` from a thread of its own,
  /// until it is given something else; null ends it.
  virtual void repeat(const Bytes& bytes) = 0;
  /// What has come, in order per writer and channel.
  virtual std::vector<ShareArrival> take() = 0;
  /// Waits until something has come, so long at most (ns).
  virtual void wait(std::int64_t at_most) = 0;
  /// Nothing of a writer is taken any more.
  virtual void ignore(std::uint64_t writer) = 0;
  /// Bytes of messages that were sent.
  [[nodiscard]] virtual std::uint64_t bytes_sent() const = 0;
};

/// How processes find each other.
struct ShareTransportOptions {
  std::string name;                             ///< Of the shared run: letters, digits and _.
  bool lockstep = false;                        ///< States must all arrive.
  double lease = 1.0;                           ///< s
  double beat = 0.25;                           ///< s between what is repeated.
  std::int64_t ahead = 0;                       ///< Steps that may be on their way.
  bool localhost_only = false;                  ///< No other machine.
  std::function<void(const std::string&)> log;  ///< Lines for users, from any thread.
};

/// What the library with DDS gives (one of its own, so that the program needs no DDS); errors are
/// std::runtime_error with words for the user.
struct DdsModule {
  /// Joins a shared run.
  std::unique_ptr<ShareTransport> (*share)(const ShareTransportOptions& options);
};

}  // namespace pointflight
