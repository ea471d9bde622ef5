// A program run to its end under limits.
#pragma once

#include <atomic>
#include <string>
#include <vector>

namespace pointflight {

/// How a program is run.
struct ProcessRequest {
  std::vector<std::string> command;  ///< A program (found along PATH) and its arguments.
  std::string log;                   ///< File that takes what it writes on stdout and stderr.
  std::string errors;                ///< The same of stderr alone; empty: it goes into `log`.
  std::string folder;                ///< To run in; empty: where we are.
  double time_limit = 0.0;           ///< s of the wall clock; 0: none.
  double memory_limit = 0.0;         ///< Bytes beside mapped files (RLIMIT_DATA); 0: any.
};

/// How it ended.
struct ProcessResult {
  int exit_code = -1;         ///< -1: by a signal, or nobody knows (SIGCHLD is ignored).
  int signal = 0;             ///< That ended it; 0: none.
  bool timed_out = false;     ///< It took longer than it may.
  bool interrupted = false;   ///< `stop` was set: it was ended for that.
  double wall_seconds = 0.0;  ///< From start to end.
};

/// Runs it in a process group of its own and waits. It ends with the calling thread, whatever ends
/// that; after its time, and once `stop` is set, the group gets SIGTERM and 5 s later SIGKILL.
/// Callable from several threads. Throws InputError if it cannot be started.
ProcessResult run_process(const ProcessRequest& request, const std::atomic<bool>& stop);

}  // namespace pointflight
