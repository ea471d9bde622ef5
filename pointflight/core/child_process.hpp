#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace pointflight {

/// What a child may use before it is ended.
struct ChildLimits {
  double cpu_seconds = 20.0;                        ///< Of its own threads together.
  std::size_t memory_bytes = std::size_t{2} << 30;  ///< Beyond what the process has; not under
                                                    ///< sanitizers, whose shadow would count.
};

/// Where a child's work leaves its results.
class ChildOutput {
 public:
  /// Writes to a descriptor, which stays the caller's.
  explicit ChildOutput(int pipe) : pipe_(pipe) {}
  /// Bytes for the parent, after those of earlier calls.
  void write(std::span<const std::byte> bytes);

 private:
  int pipe_;
};

/// `ChildResult::failure` of a child that wanted more memory than it may have.
inline constexpr const char* kTooMuchMemory = "it takes too much memory";

/// What came back from a child.
struct ChildResult {
  std::vector<std::byte> bytes;  ///< All that was written, in order.
  std::string failure;           ///< Empty if the work was done, else why not: for a message.
};

/// Between fork and exec, or in a copy: signals do what they do in a program that was just started,
/// whatever this one ignores or blocks.
void restore_default_signals();

/// Runs `work` in a copy of this process (fork), so that a library that crashes, hangs or takes all
/// memory ends the copy and not the program. Of what `work` changes only what it writes comes back;
/// what it throws comes back as `failure`. The copy has the calling thread only and nothing on
/// standard input, output and error; it ends with `_exit`, so no destructor of a static object runs
/// twice.
///
/// `while_waiting` is called about ten times a second and may throw, which ends the child. Throws
/// InputError if the system gives no process.
ChildResult run_in_child(const std::function<void(ChildOutput&)>& work,
                         const ChildLimits& limits,
                         const std::function<void()>& while_waiting = {});

}  // namespace pointflight
