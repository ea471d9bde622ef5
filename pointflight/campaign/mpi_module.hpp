#pragma once

#include <cstddef>

namespace pointflight {

/// What the library with MPI gives (a module of its own, so that the program needs no MPI). All
/// from one thread; errors end the job, as MPI's do.
struct MpiModule {
  /// Joins the job that `mpirun` started; without it a job of one.
  void (*begin)();
  /// Which of its processes this is, from 0, and how many there are.
  ///@{
  int (*rank)();
  int (*size)();
  ///@}
  /// Waits until all have come here, without keeping a core busy.
  void (*barrier)();
  /// Returns the next number of 0, 1, 2, ...: each once per job, between two calls of `barrier`.
  std::size_t (*next)();
  /// Leaves the job.
  void (*end)();
};

}  // namespace pointflight
